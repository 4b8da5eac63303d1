// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

#include "scene_source.h"

namespace fcl_fibers::tools {

/// A step: the same fibers at its start and at its end.
struct StepScene {
  std::string start_title, end_title;
  FiberPolylines start, end;

  /// Where the fibers are at a time from 0 to 1.
  FiberPolylines at(double time) const;
};

/// Branches and samples that one source does not tell are those of the other one. Throws
/// std::invalid_argument if a source has several frames, or if the fibers differ in their numbers
/// of points, in what their radii are of, or in where they branch.
StepScene readStep(const SceneSource& start, const SceneSource& end);

struct StepImpacts {
  std::vector<Impact> impacts;  ///< the first come first
  std::size_t count = 0;     ///< of all that were found, those that the limit left out among them
  std::size_t at_start = 0;  ///< of these
  bool ended = false;        ///< the search ended before it had found all
  double safe_step = 1;
  double seconds = 0;  ///< that build, update and search took

  /// Whether all impacts of the step up to this time are among `impacts`.
  bool isComplete(double until = 1) const;
};

/// Finds the impacts of a step, and tells on stderr if that are not all.
/// @param limit  keeps so many, the first
/// @param options  with Report::kCapsules and boxes; else it throws std::invalid_argument
StepImpacts findImpacts(const StepScene& step, const FiberTreeOptions& options, std::size_t limit);

/// The two segments and their contact at the time of the impact.
Contact contactOf(const StepScene& step, const Impact& impact);

}  // namespace fcl_fibers::tools
