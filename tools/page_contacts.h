// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers::tools {

/// A contact that the page marks.
struct Marker {
  Contact contact;
  double depth = 0;  ///< relative to the sum of both radii: 0 if they just touch, at most 1
};

/// The contacts of a frame, as far as a page has room for them.
struct PageContacts {
  std::size_t count = 0;                ///< pairs that were found
  bool stopped = false;                 ///< there are more pairs than `count`
  std::vector<unsigned char> touching;  ///< by segment, fiber after fiber: 1 if it is in a pair
  std::vector<Marker> markers;          ///< the deepest of the found, the deepest last
};

/// Finds the pairs of a scene in bounded memory.
/// @param tree  built from the scene, with Report::kCapsules
/// @param most_pairs  the search stops after so many pairs, because a radius far too large makes
///   all segments touch
PageContacts findPageContacts(const FiberTree& tree, const FiberPolylines& scene,
                              std::size_t most_pairs, std::size_t most_markers);

}  // namespace fcl_fibers::tools
