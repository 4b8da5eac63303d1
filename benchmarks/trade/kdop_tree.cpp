// SPDX-License-Identifier: BSD-3-Clause
//
// Compiled once for every instruction set, as files named -inl.h are: it sees no FCL and no Eigen.
#include "kdop_tree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kdop_tree.cpp"
#include <hwy/foreach_target.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "geometry/lanes-inl.h"
#include "geometry/rounding.h"
#include "tree/fiber_tree.h"
#include "tree/pair_search.h"
#include "tree/traversal-inl.h"
#include "tree/wide_overlaps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::benchmarks::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using geometry::LaneMask;
using geometry::Segment;
using geometry::Vec3d;

/// Axes first, then the cube's corners and edges; of each two opposite ones, one.
constexpr double kDirections[13][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1}, {1, 1, 1},  {1, 1, -1},
                                       {1, -1, 1}, {-1, 1, 1}, {1, 1, 0}, {1, -1, 0}, {1, 0, 1},
                                       {1, 0, -1}, {0, 1, 1},  {0, 1, -1}};

template <int K>
constexpr int directionOf(int i) {
  constexpr int kCorners = 4;
  return K == 18 && i >= 3 ? i + kCorners : i;
}

inline void roundOutward(double low, double high, float& to_low, float& to_high) {
  to_low = geometry::roundedDown(low);
  to_high = geometry::roundedUp(high);
}
inline void roundOutward(double low, double high, double& to_low, double& to_high) {
  to_low = low;
  to_high = high;
}

template <int K, class Real, int N>
class KDopPack;

/// A volume, see geometry/volume.h: all points between K / 2 pairs of planes.
template <int K, class Real>
struct KDop {
  static constexpr int kSlabs = K / 2;
  Real low[kSlabs], high[kSlabs];

  template <int N>
  using Pack = KDopPack<K, Real, N>;

  static KDop around(const Segment& segment, double padding) {
    KDop dop;
    for (int i = 0; i < kSlabs; ++i) {
      const double(&d)[3] = kDirections[directionOf<K>(i)];
      const Vec3d direction{d[0], d[1], d[2]};
      const double a = dot(direction, segment.a), b = dot(direction, segment.b);
      // A coordinate's error counts three times at most; that of the sums is smaller.
      const double reach =
          norm(direction) * (segment.thickness() + padding) + 6 * endPointError(segment);
      constexpr double kEps = std::numeric_limits<double>::epsilon();
      const double outer = (1 + 8 * kEps) * reach;
      roundOutward(std::min(a, b) - outer, std::max(a, b) + outer, dop.low[i], dop.high[i]);
    }
    return dop;
  }
  /// That of the box, so that all k descend alike.
  float size() const {
    return static_cast<float>((high[0] - low[0]) + (high[1] - low[1]) + (high[2] - low[2]));
  }
};

template <int K, class Real, int N>
class alignas(sizeof(Real) * N) KDopPack {
  using Dop = KDop<K, Real>;
  static constexpr int kSlabs = Dop::kSlabs;

 public:
  KDopPack() {
    for (int lane = 0; lane < N; ++lane) clear(lane);
  }
  void set(int lane, const Dop& dop) {
    for (int i = 0; i < kSlabs; ++i) {
      low_[i][lane] = dop.low[i];
      high_[i][lane] = dop.high[i];
    }
  }
  bool replace(int lane, const Dop& dop) {
    bool differs = false;
    for (int i = 0; i < kSlabs; ++i) {
      differs |= !(low_[i][lane] == dop.low[i] && high_[i][lane] == dop.high[i]);
    }
    if (differs) set(lane, dop);
    return differs;
  }
  void clear(int lane) {
    for (int i = 0; i < kSlabs; ++i) {
      low_[i][lane] = high_[i][lane] = std::numeric_limits<Real>::quiet_NaN();
    }
  }
  Dop get(int lane) const {
    Dop dop;
    for (int i = 0; i < kSlabs; ++i) {
      dop.low[i] = low_[i][lane];
      dop.high[i] = high_[i][lane];
    }
    return dop;
  }
  Dop unite() const {
    constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
    Dop dop;
    for (int i = 0; i < kSlabs; ++i) {
      dop.low[i] = kInfinity;
      dop.high[i] = -kInfinity;
      for (int lane = 0; lane < N; ++lane) {
        // In this order NaN loses every comparison.
        const Real low = low_[i][lane], high = high_[i][lane];
        dop.low[i] = low < dop.low[i] ? low : dop.low[i];
        dop.high[i] = high > dop.high[i] ? high : dop.high[i];
      }
    }
    return dop;
  }

  const Real* low(int i) const { return low_[i]; }
  const Real* high(int i) const { return high_[i]; }

 private:
  Real low_[kSlabs][N], high_[kSlabs][N];
};

template <int K, class Real, int N>
LaneMask overlaps(const KDopPack<K, Real, N>& pack, const KDop<K, Real>& dop) {
  using Tag = hn::CappedTag<Real, static_cast<std::size_t>(N)>;
  constexpr int kWidth = static_cast<int>(hn::MaxLanes(Tag()));
  LaneMask mask = 0;
  for (int lane = 0; lane < N; lane += kWidth) {
    const auto meet = [&](int i) HWY_ATTR {
      return hn::And(hn::Le(hn::Load(Tag(), pack.low(i) + lane), hn::Set(Tag(), dop.high[i])),
                     hn::Le(hn::Set(Tag(), dop.low[i]), hn::Load(Tag(), pack.high(i) + lane)));
    };
    auto all = meet(0);
    for (int i = 1; i < K / 2; ++i) all = hn::And(all, meet(i));
    mask |= geometry::HWY_NAMESPACE::laneMask(Tag(), all) << lane;
  }
  return mask;
}

struct CountPairs final : tree::PairSink {
  tree::Visit take(const tree::Pair*, std::size_t count) override {
    pairs += count;
    return tree::Visit::kContinue;
  }
  std::size_t pairs = 0;
};

struct CountTests : tree::HWY_NAMESPACE::CountedOverlapAdmission {
  tree::Visit leafPair(tree::SegmentId, tree::SegmentId) { return tree::Visit::kContinue; }
};

template <int K, class Real>
class KDopTreeOf final : public KDopTree {
  using Tree = tree::FiberTree<tree::Layered<KDop<K, Real>, 8>>;

 public:
  explicit KDopTreeOf(tree::Topology<8> topology) : tree_(std::move(topology)) {}

  void refit(const Segments& segments) override { tree_.refit(segments, 0); }
  std::size_t countPairs() const override { return count(nullptr); }
  std::size_t countTouching(const Segments& segments) const override {
    double length = 0;
    for (const Segment& segment : segments) length += norm(segment.b - segment.a);
    const double unit = std::exp2(-std::ilogb(length / static_cast<double>(segments.size())));
    const tree::CapsuleFilter filter(segments.data(), segments.data(), nullptr, 0, unit);
    return count(&filter);
  }
  std::size_t countVolumeTests() const override {
    CountTests query;
    tree::HWY_NAMESPACE::visitPairs(tree_, query);
    return query.tests;
  }
  std::size_t memoryUsage() const override { return tree_.memoryUsage(); }

 private:
  std::size_t count(const tree::CapsuleFilter* filter) const {
    using geometry::SameFrame;
    using tree::HWY_NAMESPACE::AllMeet;
    constexpr SameFrame kSame;
    CountPairs sink;
    tree::internal::SerialRun run(filter, sink);
    tree::HWY_NAMESPACE::WideOverlaps<Tree, SameFrame, SameFrame, AllMeet> search(
        tree_, tree_, kSame, kSame, AllMeet(), run);
    search.run(tree::Work{0, 0, 0});
    run.full();
    return sink.pairs;
  }

  Tree tree_;
};

std::unique_ptr<KDopTree> make(int directions, Bounds bounds, tree::Topology<8>&& topology) {
  if (bounds == Bounds::kDouble)
    return std::make_unique<KDopTreeOf<6, double>>(std::move(topology));
  switch (directions) {
    case 6:
      return std::make_unique<KDopTreeOf<6, float>>(std::move(topology));
    case 14:
      return std::make_unique<KDopTreeOf<14, float>>(std::move(topology));
    case 18:
      return std::make_unique<KDopTreeOf<18, float>>(std::move(topology));
    default:
      return std::make_unique<KDopTreeOf<26, float>>(std::move(topology));
  }
}

}  // namespace fcl_fibers::benchmarks::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "geometry/simd.h"

namespace fcl_fibers::benchmarks {

std::unique_ptr<KDopTree> makeKDopTree(int directions, Bounds bounds, tree::Topology<8> topology) {
  using Make = std::unique_ptr<KDopTree> (*)(int, Bounds, tree::Topology<8>&&);
#define FCL_FIBERS_MAKE(NAMESPACE) static_cast<Make>(&NAMESPACE::make)
  return FCL_FIBERS_BEST_TARGET(Make, FCL_FIBERS_MAKE)(directions, bounds, std::move(topology));
#undef FCL_FIBERS_MAKE
}

}  // namespace fcl_fibers::benchmarks
#endif
