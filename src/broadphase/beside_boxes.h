// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "geometry/moving_segment.h"
#include "index/segment_index.h"

namespace fcl_fibers::broadphase {

/// Finds which of the boxes of objects beside the tree are near. An id is the place of an object.
/// The boxes are in two indexes: that of the last build, and that of the places added since, which
/// is small and is built whenever it grows.
class BesideBoxes {
 public:
  using Place = index::SegmentId;
  /// Returns the box of a place at the start and at the end of the step, in the frame.
  using BoxOf = std::function<geometry::MovingSegment(Place)>;

  explicit BesideBoxes(double margin);

  void clear();
  /// Takes the boxes of all places [0, count).
  void readAll(const geometry::Frame& frame, Place count, const BoxOf& boxOf);
  /// Takes those of places that are new, up to count.
  void readNew(Place count, const BoxOf& boxOf);
  /// Takes those of some places that were there before, which ascend.
  void readSome(const std::vector<Place>& places, const BoxOf& boxOf);
  /// Begins a step at the boxes as they are now, or ends it.
  void setStep(bool has_step);

  /// @name Searches
  /// See Generations.
  ///@{
  tree::Visit search(index::PairSink& sink) const;
  tree::Visit search(index::NearestSink& sink) const;
  tree::Visit search(const geometry::MovingSegment& segment, double error,
                     index::PairSink& sink) const;
  tree::Visit search(const geometry::MovingSegment& segment, double error,
                     index::NearestSink& sink) const;
  ///@}

  std::size_t memoryUsage() const { return main_.memoryUsage() + young_.memoryUsage(); }

 private:
  template <class Search>
  tree::Visit within(const Search& search) const;
  void build(index::SegmentIndex& part, Place begin, Place end, const BoxOf& boxOf);
  void fitStart(index::SegmentIndex& part, const BoxOf& boxOf);
  bool hasYoung() const { return young_.end() > young_.begin(); }

  bool has_step_ = false;
  geometry::Frame frame_;
  index::SegmentIndex main_, young_;
};

}  // namespace fcl_fibers::broadphase
