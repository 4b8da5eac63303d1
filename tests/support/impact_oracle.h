// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

namespace fcl_fibers::test {

/// A segment and the hull of two or three corners, at one time. The ends of the segment may be one
/// point, and the corners be on one line or at one point.
struct GivenInstant {
  std::array<std::array<double, 3>, 2> axis;
  std::array<std::array<double, 3>, 3> corner;
  std::array<double, 2> radii = {0, 0};
};

/// What moves from one instant to another within a unit of time. All numbers change linearly, and
/// each is taken as exact.
struct GivenMotion {
  GivenInstant start, end;
  std::size_t corners = 2;
  double margin = 0;  ///< may be negative

  /// The largest sum of the 1-norms of the differences of the points, and of the radii.
  double size() const;
};

/// What touches and when, without error. Shares nothing with the library.
class ImpactOracle {
 public:
  struct Verdict {
    bool certain;  ///< what was asked is certainly so
    bool exact;    ///< decided in integers
  };

  /// Whether the two are farther apart than radii and margin all the time from `from` to `to`. A
  /// step is halved until a direction that turns linearly parts all points of each part. A distance
  /// is the largest gap along a direction, so some direction does, if they are farther apart by
  /// more than the rounding of a direction to 2^-50. The gap is quadratic in time. Its Bernstein
  /// coefficients are computed in double with a bound on their error, and where that does not
  /// decide, in integers.
  /// @param always_exact  leaves nothing to double
  static Verdict apartDuring(const GivenMotion& motion, double from, double to,
                             bool always_exact = false);

  /// Whether the two are no farther apart than radii and margin at a time. Most pairs are decided
  /// in double, by two points that are certainly near enough or a direction that certainly parts
  /// them.
  static Verdict withinAt(const GivenMotion& motion, double time, bool always_exact = false);

  /// The same of a pair that rests.
  static Verdict within(const GivenInstant& pair, std::size_t corners, double margin,
                        bool always_exact = false) {
    return withinAt({pair, pair, corners, margin}, 0, always_exact);
  }

  /// Their distance at a time less radii and margin, rounded.
  static double excessAt(const GivenMotion& motion, double time);
};

}  // namespace fcl_fibers::test
