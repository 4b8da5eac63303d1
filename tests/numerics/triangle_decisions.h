// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace fcl_fibers::test {

/// How much farther than reach a pair may be and be taken for within, in parts of the distance and
/// lengths of the two. Needles alone may need the second.
constexpr double kUsualExcess = 1e-14, kMostExcess = 1e-11;

/// Of many pairs of a segment and a triangle.
struct TriangleTally {
  std::uint64_t decisions = 0;
  std::uint64_t within = 0;
  std::uint64_t at_contact = 0;    ///< distance and reach differ by at most 1e-12 of all lengths
  std::uint64_t exact = 0;         ///< decided in integers
  std::uint64_t missed = 0;        ///< within reach, and taken for apart
  std::uint64_t beyond_usual = 0;  ///< farther than reach and kUsualExcess, taken for within
  std::uint64_t unpromised = 0;    ///< and kMostExcess
  std::uint64_t in_float = 0;      ///< decided by TrianglePairs
  std::uint64_t wrong_in_float = 0;
  std::string first_wrong;
};

/// Asks axisWithin() and TrianglePairs about random pairs of all kinds: of general position, on a
/// grid where corners, edges and planes meet exactly, nearly parallel, needles, points, of unlike
/// sizes, far from the origin, and scaled by powers of two from 2^-1000 to 2^960. Most are near
/// contact.
TriangleTally decideTriangles(std::uint64_t decisions, std::uint64_t seed);

}  // namespace fcl_fibers::test
