// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cfenv>
#include <cstddef>
#include <cstdint>
#include <string>

namespace fcl_fibers::test {

/// How much farther than reach a pair may be and be taken for within, in parts of the distance and
/// lengths of the two. Of triangles needles alone may need the last.
constexpr double kExcessOfCapsules = 0x1.4p-49, kUsualExcess = 1e-14, kMostExcess = 1e-11;

/// Of many pairs of a segment and the hull of two or three corners.
struct TouchTally {
  std::uint64_t decisions = 0;
  std::uint64_t within = 0;
  std::uint64_t at_contact = 0;    ///< distance and reach differ by at most 1e-12 of all lengths
  std::uint64_t exact = 0;         ///< decided in integers
  std::uint64_t missed = 0;        ///< within reach, and taken for apart
  std::uint64_t beyond_usual = 0;  ///< farther than reach and the usual excess, taken for within
  std::uint64_t unpromised = 0;    ///< and kMostExcess; of capsules the same
  std::uint64_t in_float = 0;      ///< decided by CapsulePairs or TrianglePairs
  std::uint64_t wrong_in_float = 0;
  std::string first_wrong;
};

/// Asks axesWithin() and CapsulePairs, or axisWithin() and TrianglePairs, about random pairs of the
/// kinds of impact_kinds.h at rest. Most are near contact; some triangles are needles; one pair in
/// four is scaled by a power of two from 2^-1000 to 2^960.
/// @param corners  2 for two capsules, 3 for a capsule and a triangle
/// @param rounding  the mode of rounding in which they are asked, as in <cfenv>
TouchTally decideTouches(std::size_t corners, std::uint64_t decisions, std::uint64_t seed,
                         int rounding = FE_TONEAREST);

/// Asks touch() and CapsulePairs about the same kinds of pairs as rounded cones, which TouchOracle
/// judges. Lengths count with the radii.
TouchTally decideConeTouches(std::uint64_t decisions, std::uint64_t seed,
                             int rounding = FE_TONEAREST);

}  // namespace fcl_fibers::test
