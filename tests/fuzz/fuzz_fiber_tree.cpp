// SPDX-License-Identifier: BSD-3-Clause
//
// A tree over arrays of any bits, with groups or without: built, updated, searched, met by
// another one. What is refused must leave the tree as it was; what is answered must have each pair
// once, all pairs that surely touch, and under Report::kCapsules none that are surely apart.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include <fcl_fibers/fiber_tree.h>

#include "fuzz_input.h"
#include "support/assembly.h"
#include "support/touch_oracle.h"

namespace {

using fcl_fibers::FiberArrays;
using fcl_fibers::FiberTree;
using fcl_fibers::FiberTreeOptions;
using fcl_fibers::Report;
using fcl_fibers::SegmentPair;
using fcl_fibers::fuzz::isRefused;
using fcl_fibers::fuzz::readNumber;
using fcl_fibers::fuzz::require;
using fcl_fibers::test::Assembly;
using fcl_fibers::test::GivenCapsule;
using fcl_fibers::test::TouchOracle;
using Pairs = std::vector<std::pair<int, int>>;

constexpr int kNumbers = 8;  // see readNumber()

FiberTreeOptions readOptions(FuzzedDataProvider& data) {
  FiberTreeOptions options;
  options.topology =
      data.ConsumeBool() ? fcl_fibers::Topology::kBundle : fcl_fibers::Topology::kSuperThread;
  options.volumes = data.ConsumeBool() ? FiberTreeOptions::Volumes::kLayeredBoxes
                                       : FiberTreeOptions::Volumes::kWrappedSpheres;
  options.report = data.ConsumeBool() ? Report::kCapsules : Report::kVolumes;
  options.ignored_neighbors = data.ConsumeIntegralInRange(0, 3);
  options.margin = data.ConsumeBool() ? 0 : data.ConsumeFloatingPointInRange(0.0, 10.0);
  return options;
}

template <typename S>
struct Hair : Assembly<S> {
  std::vector<std::int32_t> groups;  ///< empty if there are none

  explicit Hair(FuzzedDataProvider& data) {
    const int fibers = data.ConsumeIntegralInRange(0, 12);
    for (int f = 0; f < fibers; ++f) {
      this->point_begin.push_back(this->pointCount() +
                                  data.ConsumeIntegralInRange<std::size_t>(0, 12));
    }
    this->radii_are = data.PickValueInArray({Radii::kOne, Radii::kPerFiber, Radii::kPerSegment});
    if (data.ConsumeBool()) {
      for (int f = 0; f < fibers; ++f) groups.push_back(data.ConsumeIntegralInRange(0, 2));
    }
    readNumbers(data);
  }

  void readNumbers(FuzzedDataProvider& data) {
    this->points.resize(3 * this->pointCount());
    for (S& x : this->points) x = readNumber<S>(data, kNumbers);
    this->radii.resize(this->radii_are == Radii::kOne        ? 1
                       : this->radii_are == Radii::kPerFiber ? this->fiberCount()
                                                             : this->pointCount());
    for (S& radius : this->radii) radius = std::fabs(readNumber<S>(data, kNumbers)) / 4;
  }

  FiberArrays<S> arrays() const {
    FiberArrays<S> arrays = this->view();
    if (!groups.empty()) arrays.groups = groups.data();
    return arrays;
  }

  bool areOfOneGroup(std::size_t a, std::size_t b) const {
    if (groups.empty()) return false;
    const std::int32_t group = groups[this->fiberOf(a)];
    return group != 0 && group == groups[this->fiberOf(b)];
  }

  /// The largest coordinate or radius.
  double size() const {
    double size = 0;
    for (const S x : this->points) size = std::max(size, std::fabs(static_cast<double>(x)));
    for (const S radius : this->radii) size = std::max(size, static_cast<double>(radius));
    return size;
  }

 private:
  using Radii = typename FiberArrays<S>::Radii;
};

Pairs pairsOf(const FiberTree& tree) {
  Pairs pairs;
  tree.visitPairs([&](SegmentPair pair) { pairs.emplace_back(pair.a, pair.b); });
  return pairs;
}

/// The band about contact in which either answer is right, see docs/numerics.md, is smaller than
/// this part of the scene's size.
constexpr double kBand = 1e-12;

template <typename S>
void checkPair(const Hair<S>& hair, std::size_t a, std::size_t b, const FiberTreeOptions& options,
               bool found) {
  const GivenCapsule p = hair.capsule(a), q = hair.capsule(b);
  const bool touch = TouchOracle::judge(p, q, options.margin).touching;
  const double band = kBand * (hair.size() + options.margin);
  if (!found) {
    require(!touch || !TouchOracle::touchExactly(p, q, options.margin - band));
  } else if (options.report == Report::kCapsules) {
    require(touch || TouchOracle::judge(p, q, options.margin + band).touching);
  }
}

template <typename S>
void checkAnswers(const FiberTree& tree, const Hair<S>& hair) {
  const FiberTreeOptions& options = tree.options();
  const Pairs pairs = pairsOf(tree);
  const std::set<std::pair<int, int>> found(pairs.begin(), pairs.end());
  require(found.size() == pairs.size());
  std::size_t counted = 0;
  for (std::size_t a = 0; a < hair.pointCount(); ++a) {
    if (!hair.startsCapsule(a)) continue;
    for (std::size_t b = a + 1; b < hair.pointCount(); ++b) {
      if (!hair.startsCapsule(b)) continue;
      const bool is_found = found.count({static_cast<int>(a), static_cast<int>(b)}) > 0;
      counted += is_found;
      if (hair.areOfOneGroup(a, b) ||
          (hair.fiberOf(a) == hair.fiberOf(b) &&
           b - a <= static_cast<std::size_t>(options.ignored_neighbors))) {
        require(!is_found);
      } else {
        checkPair(hair, a, b, options, is_found);
      }
    }
  }
  require(counted == pairs.size());
}

template <typename S>
void fuzz(FuzzedDataProvider& data) {
  const FiberTreeOptions options = readOptions(data);
  FiberTree tree(options), other(options);
  std::optional<Hair<S>> hair;
  while (data.remaining_bytes() > 0) {
    switch (data.ConsumeIntegralInRange(0, 4)) {
      case 0:
      case 1: {
        Hair<S> next = hair && data.ConsumeBool() ? *hair : Hair<S>(data);
        const bool same_fibers =
            hair && next.point_begin == hair->point_begin && next.groups == hair->groups;
        if (same_fibers) next.readNumbers(data);
        const Pairs before = pairsOf(tree);
        const bool updates = same_fibers && data.ConsumeBool();
        if (isRefused([&] { updates ? tree.update(next.arrays()) : tree.build(next.arrays()); })) {
          require(pairsOf(tree) == before);
        } else {
          hair = next;
          checkAnswers(tree, *hair);
        }
        break;
      }
      case 2: {
        const Hair<S> next(data);
        if (isRefused([&] { other.build(next.arrays()); })) break;
        std::set<std::pair<int, int>> seen;
        tree.visitPairs(other, [&](SegmentPair pair) {
          require(hair->startsCapsule(static_cast<std::size_t>(pair.a)));
          require(next.startsCapsule(static_cast<std::size_t>(pair.b)));
          require(seen.emplace(pair.a, pair.b).second);
        });
        break;
      }
      case 3: {
        const int most = data.ConsumeIntegralInRange(1, 40);
        int calls = 0;
        const bool stopped = tree.visitPairs([&](SegmentPair) { return ++calls == most; });
        require(calls <= most && stopped == (calls == most));
        break;
      }
      default: {
        const int segment = data.ConsumeIntegral<int>();
        isRefused([&] { tree.fiberSegment(segment); });
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  if (data.ConsumeBool()) {
    fuzz<float>(data);
  } else {
    fuzz<double>(data);
  }
  return 0;
}
