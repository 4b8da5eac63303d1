// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "numerics/extreme_rows.h"
#include "numerics/row_copies.h"
#include "numerics/specimen.h"
#include "support/exact_geometry.h"

namespace fcl_fibers::test {

inline constexpr Real kEps = std::numeric_limits<double>::epsilon();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline bool isOfBoxes(const FiberTreeOptions& options) {
  return options.volumes == FiberTreeOptions::Volumes::kLayeredBoxes;
}

/// Trees that know capsules: of all volumes and topologies.
inline std::vector<FiberTreeOptions> capsuleKinds(double margin) {
  std::vector<FiberTreeOptions> kinds = allKinds(margin);
  kinds.erase(std::remove_if(kinds.begin(), kinds.end(),
                             [](const auto& kind) { return kind.report != Report::kCapsules; }),
              kinds.end());
  return kinds;
}

template <typename S>
FiberTree treeOf(const Assembly<S>& fibers, const FiberTreeOptions& options) {
  FiberTree tree(options);
  tree.build(fibers.view());
  return tree;
}

/// A row, and what is true of it.
template <typename S>
class Judge {
 public:
  explicit Judge(const ExtremeRow<S>& of_row) : Judge(of_row, of_row.fibers) {}
  Judge(const ExtremeRow<S>& of_row, const Assembly<S>& of_fibers)
      : row(of_row), fibers(of_fibers), truth(of_fibers.capsules()) {
    fibers.visitCapsules([&](std::size_t, std::size_t point) {
      points.push_back(static_cast<std::int32_t>(point));
      exact.push_back(roundedCapsule(fibers.capsule(point)));
    });
    const ExactBox box = boxAround(fibers);
    touching_ = touchingPairs(truth, row.margin);
    middle = (box.min + box.max) / 2;
    half = (box.max - box.min) / 2;
    // What is flushed to zero is off by as much as that may be.
    least = row.environment.flushes_to_zero ? 16 * Real(std::numeric_limits<S>::min())
                                            : 16 * Real(std::numeric_limits<double>::denorm_min());
  }

  /// Runs `ask` in the row's environment, in which nothing is judged.
  template <class F>
  auto ask(F&& ask) const {
    const ScopedFloatEnvironment scoped(row.environment);
    return ask();
  }
  std::size_t numberOf(std::int32_t point) const {
    const auto place = std::lower_bound(points.begin(), points.end(), point);
    return static_cast<std::size_t>(place - points.begin());
  }

  /// Remembers the distances of all pairs, for what asks for each of them many times.
  void measureAll() {
    std::vector<Real> all(exact.size() * exact.size());
    for (std::size_t i = 0; i < exact.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        all[i * exact.size() + j] = all[j * exact.size() + i] = axisDistance(i, j);
      }
    }
    distances_ = std::move(all);
  }

  Real axisDistance(std::size_t i, std::size_t j) const {
    return distances_.empty() ? segmentDistance(exact[i].a, exact[i].b, exact[j].a, exact[j].b)
                              : distances_[i * exact.size() + j];
  }
  Real distance(std::size_t i, std::size_t j) const { return axisDistance(i, j) - reach(i, j); }
  Real reach(std::size_t i, std::size_t j) const { return exact[i].radius + exact[j].radius; }
  Real lengthOf(std::size_t i) const { return (exact[i].b - exact[i].a).norm(); }
  /// The size by which the errors of impacts are bounded.
  Real sizeIn1NormOf(std::size_t i, std::size_t j) const {
    const ExactCapsule &p = exact[i], &q = exact[j];
    return (p.a - q.a).template lpNorm<1>() + (p.b - p.a).template lpNorm<1>() +
           (q.b - q.a).template lpNorm<1>() + reach(i, j);
  }
  /// Distance of the axes, lengths and radii, by which the errors of contacts are bounded.
  Real sizeOf(std::size_t i, std::size_t j) const {
    return axisDistance(i, j) + lengthOf(i) + lengthOf(j) + reach(i, j);
  }
  Real errorOf(std::size_t i, std::size_t j) const { return 32 * kEps * sizeOf(i, j) + least; }

  const std::vector<NumberPair>& touching() const { return touching_; }

  /// Missed, repeated or unpromised pairs fail.
  void check(const FiberTreeOptions& options, const std::vector<SegmentPair>& found,
             const char* query) const {
    std::vector<NumberPair> pairs;
    for (const SegmentPair& pair : found) {
      pairs.push_back({static_cast<std::int32_t>(numberOf(pair.a)),
                       static_cast<std::int32_t>(numberOf(pair.b))});
    }
    const Findings findings = examine(truth, touching(), options, std::move(pairs));
    EXPECT_EQ(findings.missed + findings.repeated, 0u) << query << ": " << findings.first_wrong;
    if (!vanishes()) {
      EXPECT_EQ(findings.unpromised, 0u) << query << ": " << findings.first_wrong;
    }
  }
  /// Whether contacts and meshes are refused.
  bool isTooLarge() const { return half.maxCoeff() > 0x1p1000L; }
  /// Whether nothing is left to tell the parts of the scene by.
  bool vanishes() const {
    return row.environment.flushes_to_zero && row.name != "NormalFlushedToZero";
  }

  const ExtremeRow<S>& row;
  const Assembly<S>& fibers;
  const TouchOracle truth;
  std::vector<std::int32_t> points;  ///< the name of each segment
  std::vector<ExactCapsule> exact;   ///< each segment
  Point middle, half;                ///< of the box around them
  Real least;                        ///< beyond which there is no precision

 private:
  std::vector<Real> distances_;
  std::vector<NumberPair> touching_;
};

}  // namespace fcl_fibers::test
