// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/contact.h>

#include "arrays/fiber_index.h"

namespace fcl_fibers::arrays {

/// See FiberTree::accumulate().
/// @param call         the function that was called, for errors
/// @param other, mesh  the partner; both are null for the index itself, and for shapes
void accumulate(const std::string& call, const ContactForces& forces, const FiberIndex& index,
                const FiberIndex* other, const TriangleMesh* mesh, const PointSums& sums,
                const PointSums& partner_sums);

}  // namespace fcl_fibers::arrays
