// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include <fcl_fibers/contact.h>

#include "found_pairs.h"
#include "step_impacts.h"

namespace fcl_fibers::tools {

/// A contact that the page marks.
struct Marker {
  FoundContact contact;
  /// 0 if the two just touch. Relative to the sum of both radii, so at most 1; in a mesh a length.
  double depth = 0;
  double time = 0;  ///< of an impact
};

/// The contacts of a frame, as far as a page has room for them.
struct PageContacts {
  std::size_t count = 0;                ///< pairs of two segments that were found
  std::size_t mesh_count = 0;           ///< pairs of a segment and a mesh
  bool stopped = false;                 ///< there are more pairs than these
  std::vector<unsigned char> touching;  ///< by first point: 1 if it is in a pair
  std::vector<Marker> markers;          ///< the deepest of two segments, the deepest last
  std::vector<Marker> mesh_markers;     ///< the deepest of a segment and a mesh, the deepest last
};

/// Finds the pairs of a scene with itself and with meshes.
PageContacts findPageContacts(const PairSearch& search, std::size_t most_markers);

/// The impacts of a step after one time and up to another, as contacts that have no depth.
/// @param first  the first of them among those of the step; then that behind them
PageContacts takeImpacts(const StepScene& step, const StepImpacts& all, double until,
                         std::size_t most_markers, std::size_t& first);

}  // namespace fcl_fibers::tools
