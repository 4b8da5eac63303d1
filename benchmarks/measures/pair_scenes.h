// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "contenders/narrow_solvers.h"
#include "judge/exact_contact.h"

namespace fcl_fibers::benchmarks {

/// Fibers, and pairs of their segments that a broad phase hands on.
struct PairScene {
  std::string name;
  FiberPolylines fibers;
  bool paired;  ///< each two fibers of one segment are a pair; else all whose boxes overlap
};

/// The pairs, in order; neighbours in a fiber, which always touch, are none.
/// @param capsules  of all segments
IndexPairs pairsOf(const PairScene& scene, const std::vector<PosedCapsule>& capsules);

/// In another unit, and moved along all axes.
FiberPolylines scaled(FiberPolylines fibers, double scale, double offset);

/// Random pairs of a kind that is hard to decide, `crossing`, `parallel` and so on.
PairScene extreme(const std::string& kind, int pairs);

}  // namespace fcl_fibers::benchmarks
