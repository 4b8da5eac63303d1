// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "support/impact_oracle.h"
#include "support/random.h"

namespace fcl_fibers::test {

struct Meeting;

/// A kind of pairs, most of which meet.
struct ImpactKind {
  const char* name;
  const char* what;  ///< for docs/numerics/impacts.csv
  void (*change)(Random&, Meeting&);
};

const std::vector<ImpactKind>& allImpactKinds();

/// @param corners  2 for two capsules, 3 for a capsule and a triangle
/// @param rests    as they are when they meet, nearer, some as needles, some a bit tilted
GivenMotion someMotion(Random& random, const ImpactKind& kind, std::size_t corners,
                       bool rests = false);

template <class Change>
void changePoints(GivenMotion& motion, Change&& change) {
  for (GivenInstant* i : {&motion.start, &motion.end}) {
    for (auto& p : i->axis) std::for_each(p.begin(), p.end(), change);
    for (auto& p : i->corner) std::for_each(p.begin(), p.end(), change);
  }
}
template <class Change>
void changeRadii(GivenMotion& motion, Change&& change) {
  for (GivenInstant* i : {&motion.start, &motion.end}) {
    std::for_each(i->radii.begin(), i->radii.end(), change);
  }
}

}  // namespace fcl_fibers::test
