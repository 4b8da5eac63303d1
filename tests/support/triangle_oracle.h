// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

namespace fcl_fibers::test {

/// A segment from a to b, by numbers that are taken as exact. Both ends may be one point.
struct GivenSegment {
  std::array<double, 3> a, b;
};

/// Three corners, likewise. They may be on one line or at one point.
struct GivenTriangle {
  std::array<double, 3> a, b, c;
};

/// Whether a segment and a triangle are at most `reach` apart, without error: their squared
/// distance is rational in the coordinates. Most pairs are decided in double, by two points that
/// are certainly near enough or a plane that certainly parts them, the others in integers of any
/// size. Shares nothing with the library.
class TriangleOracle {
 public:
  struct Verdict {
    bool within;
    bool exact;  ///< decided in integers
  };
  static Verdict judge(const GivenSegment& segment, const GivenTriangle& triangle, double reach);

  /// What judge() falls back on.
  static bool withinExactly(const GivenSegment& segment, const GivenTriangle& triangle,
                            double reach);
};

}  // namespace fcl_fibers::test
