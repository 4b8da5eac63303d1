// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "live/anchors.h"
#include "live/segment_flags.h"
#include "tree/topology.h"

namespace fcl_fibers::live {

class Pairing;

/// Which segments are wholly inside a solid, so that they touch none of its triangles.
///
/// A segment without a listed triangle stays on its side of the surface as long as it is covered:
/// on a path between two updates, along which each displacement changes linearly, it touches
/// nothing. So its side is found when all is listed. Segments that have listed triangles and touch
/// none of them are asked about at each update. Those that share an end and touch nothing are on
/// one side, so one of them is asked.
class Inside {
 public:
  /// Takes over what a listing has found.
  /// @param deep  the segments inside that have no listed triangle
  void set(const Pairing& pairing, const std::vector<tree::SegmentId>& deep);
  void clear() { deep_ = SegmentFlags(); }

  /// Returns the segments that are inside now. They ascend.
  /// @param near, touching  those that have listed triangles, and those that touch some of them
  std::vector<tree::SegmentId> find(const Pairing& pairing, const SegmentFlags& near,
                                    const SegmentFlags& touching) const;

  std::size_t memoryUsage() const { return deep_.memoryUsage(); }

 private:
  SegmentFlags deep_;  ///< of those that had no listed triangles when all was listed
};

}  // namespace fcl_fibers::live
