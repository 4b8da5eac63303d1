// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::tools {

/// Returns the two segments whose surfaces are nearest to each other, or overlap deepest; nothing
/// if no pair counts. Segments of one fiber, or of fibers that branch from each other, count only
/// if what is between them along the fibers is longer than a half circle whose diameter is the
/// distance of their axes, so that the fiber turns back to itself.
///
/// @param other  a second scene; then one segment is of each. Null for none
/// @param neighbors  which segments of one fiber count for none besides
std::optional<Contact> findNearest(const FiberPolylines& scene, const FiberPolylines* other,
                                   const FiberOptions& neighbors);

}  // namespace fcl_fibers::tools
