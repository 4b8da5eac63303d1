// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "numerics/random_scenes.h"
#include "numerics/specimen.h"

namespace fcl_fibers::test {

/// Of many scenes.
struct Tally {
  std::uint64_t scenes = 0;
  std::uint64_t decisions = 0;      ///< pairs that brute force has decided
  std::uint64_t within_radius = 0;  ///< within half the sum of their radii of contact
  std::uint64_t at_contact = 0;     ///< within 1e-12 of the sum of their radii
  std::uint64_t exact = 0;          ///< decided in integers
  std::uint64_t touching = 0;
  std::uint64_t reported = 0;  ///< by all kinds of trees together
  std::uint64_t wrong = 0;     ///< missed, repeated or unpromised, by all kinds of trees
  std::string first_wrong;
};

/// Answers a random scene by every kind of tree, once as arrays or as objects, and counts what
/// brute force says otherwise.
template <typename S>
void differ(RandomKind kind, std::size_t capsules, std::uint64_t seed, Form form,
            const HairFiles& hair, Tally& tally);

extern template void differ<float>(RandomKind, std::size_t, std::uint64_t, Form, const HairFiles&,
                                   Tally&);
extern template void differ<double>(RandomKind, std::size_t, std::uint64_t, Form, const HairFiles&,
                                    Tally&);

/// Scenes of all kinds in turn, float and double, arrays and objects, from consecutive seeds, as
/// long as goOn(tally) holds.
template <class GoOn>
Tally differWhile(GoOn&& goOn, std::size_t capsules, std::uint64_t seed, const HairFiles& hair) {
  Tally tally;
  constexpr std::size_t kKinds = sizeof(kRandomKinds) / sizeof(*kRandomKinds);
  for (; goOn(tally); ++seed) {
    const RandomKind kind = kRandomKinds[seed % kKinds];
    // FCL has no shape that tapers.
    const bool are_arrays = kind == RandomKind::kTapered || seed / kKinds % 4 < 2;
    const Form form = are_arrays ? Form::kArrays : Form::kObjects;
    if (seed / kKinds % 2 == 0) {
      differ<float>(kind, capsules, seed, form, hair, tally);
    } else {
      differ<double>(kind, capsules, seed, form, hair, tally);
    }
  }
  return tally;
}

}  // namespace fcl_fibers::test
