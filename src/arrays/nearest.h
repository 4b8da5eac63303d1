// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "arrays/fiber_index.h"
#include "index/posed_mesh.h"
#include "parallel/unwritten.h"

namespace fcl_fibers::arrays {

// These measure distances from the segments that an index keeps, with a bound on the error of each.
// If rounding leaves open which of several pairs is the nearest, all of them are candidates.

/// Replaces the content of `pairs` by the candidates for the least distance of two trees, or of the
/// pairs of one tree, which is both.
/// @param call  that is refused, by std::invalid_argument, if coordinates overflow
/// @pre no pair touches, or all have to be looked at
void findClosest(const std::string& call, const FiberIndex& own, const FiberIndex& other,
                 parallel::UnwrittenVector<SegmentPair>& pairs);
/// Replaces the content of `pairs` by the candidates for the least distance of a tree and a mesh.
void findClosest(const FiberIndex& own, const index::PosedMesh& mesh,
                 parallel::UnwrittenVector<TrianglePair>& pairs);

/// Finds each segment of a tree that is at most `distance` from another tree, or from the rest of
/// its own, and the candidate of least id.
tree::Visit findNearest(const std::string& call, const FiberIndex& own, const FiberIndex& other,
                        double distance, index::PairSink& sink);

}  // namespace fcl_fibers::arrays
