// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace fcl_fibers::test {

/// Of many pairs that move.
struct ImpactTally {
  std::uint64_t decisions = 0;
  std::uint64_t impacts = 0;     ///< reported
  std::uint64_t at_start = 0;    ///< of these, at time 0
  std::uint64_t approaches = 0;  ///< decisions about pairs that touch at the start
  std::uint64_t exact = 0;       ///< decided in integers
  std::uint64_t late = 0;        ///< within reach before the impact that is reported, or if none is
  std::uint64_t early = 0;       ///< farther than reach and tolerance at the impact
  double earliest = 0;           ///< at most so many tolerances farther than reach
  std::uint64_t misplaced = 0;   ///< closest points farther apart than the two and the tolerance
  std::string first_wrong;

  std::uint64_t wrong() const { return late + early + misplaced; }
};

/// Names of kinds of pairs, most of which meet. docs/numerics/impacts.csv tells what each is.
std::vector<std::string> impactKinds();

/// That table.
std::string impactsTable();

enum class ImpactShape { kCapsules, kTriangle };

/// Asks findImpact() and findApproach() about random pairs of a kind; each is scaled by a power of
/// two from 2^-900 to 2^900 as often as not.
/// @param kind   an index of impactKinds(), or -1 for all in turn
/// @param exact  judges in integers only
ImpactTally decideImpacts(ImpactShape shape, int kind, std::uint64_t decisions, std::uint64_t seed,
                          bool exact = false);

}  // namespace fcl_fibers::test
