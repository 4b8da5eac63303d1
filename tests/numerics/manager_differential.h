// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "support/random.h"

namespace fcl_fibers::test {

/// What is crossed at random in the scenes. Each is of a query, and of the managers that it asks.
enum class Feature {
  kMotion,          ///< the asked manager has it
  kNoMotion,        ///< a manager has none
  kSolid,           ///< a solid mesh touches
  kOpen,            ///< the surface of a mesh touches
  kDeforming,       ///< a mesh touches that was refitted
  kUnequalMargins,  ///< of two managers
  kInBoth,          ///< an object that is in both managers touches
  kRoots,           ///< they leave out a pair that touches
  kGroups,          ///< as for roots
  kCategories,      ///< as for roots
  kClone,           ///< a manager is one
  kFailedUpdate,    ///< a manager has had one
  kComingAndGoing,  ///< objects came to a manager, or left it
  kSelf,            ///< asked about itself
  kTwoManagers,     ///< asked about another manager
  kOneObject,       ///< asked about one object
  kDistance,        ///< asked for distances
  kFindImpact,      ///< asked when the pairs touch
  kOtherReport,     ///< of two managers one reports volumes and one capsules
};
constexpr std::size_t kFeatures = 19;
constexpr std::size_t kTriples = kFeatures * (kFeatures - 1) * (kFeatures - 2) / 6;
using Features = std::bitset<kFeatures>;
using Triple = std::array<Feature, 3>;

const std::vector<Triple>& allTriples();
std::string nameOf(const Triple& triple);
/// Whether no query has all three.
bool isImpossible(const Triple& triple);

/// Of many scenes.
struct ManagerTally {
  std::uint64_t scenes = 0;
  std::uint64_t queries = 0;
  std::uint64_t touching = 0;   ///< decided pairs that have to be reported
  std::uint64_t forbidden = 0;  ///< pairs that touch and that a rule leaves out
  std::uint64_t apart = 0;      ///< decided pairs that must not be reported
  std::uint64_t open = 0;       ///< pairs that are too near to contact to be decided
  std::uint64_t distances = 0;  ///< distance queries that were judged
  std::uint64_t impacts = 0;    ///< times of impact that were judged

  /// By what is wrong: "missed", "beyond", "twice", "rule", "late", "early", "no time", "too far"
  /// (of distances), "refused" (or taken, and should not have been).
  std::map<std::string, std::uint64_t> wrong;
  std::uint64_t wrongs() const;

  /// By allTriples(): the scenes in which some query had the three, and a decided pair that
  /// touches. In a distance query that is one near enough to be handed to the callback.
  std::vector<std::uint64_t> covered = std::vector<std::uint64_t>(kTriples);
  /// Of those that are possible, the one in the fewest scenes.
  std::size_t leastCovered() const;
};

/// Runs a scene that is random, and judges all answers by brute force. Returns what is wrong first,
/// or nothing.
std::string differManagers(Random random, int threads, ManagerTally& tally);
/// Does the same for the scene of a seed and a number, on one thread.
std::string differManagers(std::uint64_t seed, std::uint64_t number, ManagerTally& tally);

}  // namespace fcl_fibers::test
