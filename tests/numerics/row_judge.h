// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
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

/// Of capsules the distance of the axes; of cones that of the surfaces, and the larger radii.
inline Real axisDistance(const ExactCapsule& p, const ExactCapsule& q) {
  if (p.taper == 0 && q.taper == 0) return segmentDistance(p.a, p.b, q.a, q.b);
  return surfaceDistance(p, q) + p.radius + q.radius;
}

/// A row, and what is true of it.
template <typename S>
class Judge {
 public:
  explicit Judge(const ExtremeRow<S>& of_row) : Judge(of_row, of_row.fibers) {}
  Judge(const ExtremeRow<S>& of_row, const Assembly<S>& of_fibers)
      : Judge(of_row, of_fibers, of_fibers.capsules()) {}
  /// Of the capsules that stand for these fibers, such as those of objects.
  Judge(const ExtremeRow<S>& of_row, const Assembly<S>& of_fibers,
        const std::vector<GivenCapsule>& capsules)
      : row(of_row), fibers(of_fibers), truth(capsules) {
    fibers.visitCapsules([&](std::size_t, std::size_t point) {
      points.push_back(static_cast<std::int32_t>(point));
    });
    for (const GivenCapsule& capsule : capsules) exact.push_back(roundedCapsule(capsule));
    const ExactBox box = boxAround(fibers);
    touching_ = touchingPairs(truth, row.margin);
    middle = (box.min + box.max) / 2;
    half = (box.max - box.min) / 2;
    // What is flushed to zero is off by as much as that may be.
    least = row.environment.flushes_to_zero ? 16 * Real(std::numeric_limits<S>::min())
                                            : 16 * Real(std::numeric_limits<double>::denorm_min());
    // The ends of what has a length are rounded here.
    const Real largest = (middle.cwiseAbs() + half).maxCoeff();
    if (std::any_of(capsules.begin(), capsules.end(),
                    [](const GivenCapsule& capsule) { return capsule.length > 0; })) {
      least += 4 * std::numeric_limits<Real>::epsilon() * largest;
    }
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
    return distances_.empty() ? test::axisDistance(exact[i], exact[j])
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
    check(options, std::move(pairs), touching(), query);
  }
  /// The same by numbers, of which those have to be found that are `expected`.
  void check(const FiberTreeOptions& options, std::vector<NumberPair> pairs,
             const std::vector<NumberPair>& expected, const char* query) const {
    const Findings findings = examine(truth, expected, options, std::move(pairs));
    EXPECT_EQ(findings.missed + findings.repeated, 0u) << query << ": " << findings.first_wrong;
    if (!vanishes()) {
      EXPECT_EQ(findings.unpromised, 0u) << query << ": " << findings.first_wrong;
    }
  }
  /// Whether contacts and meshes are refused.
  bool isTooLarge() const { return half.maxCoeff() > 0x1p1000L; }
  /// Whether a number that is not negative is zero where the row is answered.
  template <typename T>
  bool isZero(T x) const {
    return x == 0 || (row.environment.flushes_to_zero && x < std::numeric_limits<T>::min());
  }
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

/// The median radius, or a part of a length where there is no thickness.
template <typename S>
double usualSize(const Judge<S>& judge) {
  std::vector<Real> sizes;
  for (const ExactCapsule& capsule : judge.exact) {
    sizes.push_back(capsule.radius > 0 ? capsule.radius : (capsule.b - capsule.a).norm() / 8);
  }
  std::nth_element(sizes.begin(), sizes.begin() + sizes.size() / 2, sizes.end());
  // FiberTree takes coordinates up to 5e306, which such rows all but reach.
  return static_cast<double>(sizes[sizes.size() / 2]) / (judge.isTooLarge() ? 128 : 1);
}

/// That the contact is that of two segments of a row.
/// @param errors  how large its error may be, as a multiple of that which a tree promises
template <typename S>
void expectContact(const Judge<S>& judge, std::size_t i, std::size_t j, const Contact& contact,
                   Real errors = 1) {
  const auto isFinite = [](const std::array<double, 3>& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
  };
  const Real distance = judge.distance(i, j);
  ASSERT_LE(std::fabs(contact.distance - distance), errors * judge.errorOf(i, j)) << i << ", " << j;
  ASSERT_TRUE(contact.s >= 0 && contact.s <= 1 && contact.t >= 0 && contact.t <= 1);
  ASSERT_TRUE(isFinite(contact.point_a) && isFinite(contact.point_b));
  const Point normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  ASSERT_LE(std::fabs(normal.norm() - 1), 4 * kEps) << i << ", " << j;
}

/// That the pairs of a step without motion, whose time is 0, are those that touch.
template <typename S>
void expectAtRest(const Judge<S>& judge, const FiberTreeOptions& options,
                  const std::vector<NumberPair>& pairs, const std::vector<NumberPair>& expected) {
  const Real extent = 2 * judge.half.norm();
  for (const NumberPair& pair : pairs) {
    if (judge.vanishes()) break;
    const auto i = static_cast<std::size_t>(pair.a), j = static_cast<std::size_t>(pair.b);
    const Real error = 0x1p-36L * judge.sizeIn1NormOf(i, j) + 0x1p-48L * extent + judge.least;
    EXPECT_LE(judge.distance(i, j), judge.row.margin + error) << i << ", " << j;
  }
  const Findings findings = examine(judge.truth, expected, options, pairs);
  EXPECT_EQ(findings.missed + findings.repeated, 0u) << findings.first_wrong;
}

/// Of each pair, the smaller number first, its time in a step.
using PairTimes = std::map<std::pair<std::size_t, std::size_t>, double>;

/// That what certainly touches in the middle of a step was found, and not later.
/// @param start, end  of the step, in which the ends of segments move linearly
/// @param isAsked     whether a pair of numbers is one that was asked for
template <typename S, class IsAsked>
void expectTimes(const Judge<S>& judge, const std::vector<GivenCapsule>& start,
                 const std::vector<GivenCapsule>& end, const PairTimes& times, IsAsked&& isAsked) {
  std::vector<ExactCapsule> between;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const ExactCapsule p = roundedCapsule(start[i]), q = roundedCapsule(end[i]);
    between.push_back({(p.a + q.a) / 2, (p.b + q.b) / 2, p.radius, p.taper});
  }
  for (std::size_t i = 0; i < between.size(); ++i) {
    for (std::size_t j = i + 1; j < between.size(); ++j) {
      if (!isAsked(i, j)) continue;
      const ExactCapsule &p = between[i], &q = between[j];
      const Real distance = axisDistance(p, q);
      // This is far more than the rounding of long double, and than what half a time rounds to.
      const Real error = 1e-14L * (distance + judge.lengthOf(i) + judge.lengthOf(j));
      if (distance + error + judge.least > judge.reach(i, j) + judge.row.margin) continue;
      const auto found = times.find({i, j});
      ASSERT_TRUE(found != times.end()) << "missed " << i << ", " << j;
      ASSERT_LE(found->second, 0.5) << i << ", " << j;
    }
  }
}

}  // namespace fcl_fibers::test
