// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::tools {

/// The two segments whose surfaces are nearest to each other, or overlap deepest. Segments of one
/// fiber count only if the part of the fiber between them is longer than a half circle whose
/// diameter is the distance of their axes, so that the fiber turns back to itself.
///
/// @param other  a second scene; then one segment is of each. Null for none
/// @param most_pairs  gives up, and returns nothing, after looking at so many pairs
/// Returns nothing if there is no such pair.
std::optional<Contact> findNearest(const FiberPolylines& scene, const FiberPolylines* other,
                                   const FiberOptions& neighbors, std::size_t most_pairs);

}  // namespace fcl_fibers::tools
