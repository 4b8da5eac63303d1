// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "io/orientation.h"

namespace fcl_fibers::io {

/// Cuts polygons into triangles by taking off ears. All decisions are about the polygon as it
/// projects along one axis, the one nearest to its normal, and are exact there. If that fails,
/// files may have rounded its corners, so it is done again as if narrow triangles were lines.
///
/// Triangles of which none is clockwise cover each place as many times as the polygon runs around
/// it. So whichever ears are taken off, the cut is right if no two triangles overlap, which is
/// tested in the end. A polygon may touch itself, and pass an edge to and fro: so a face has holes.
class PolygonCutter {
 public:
  /// Appends n - 2 triangles to `triangles`, of three corners each in the order of the polygon,
  /// where n is the number of corners. Triangles have no area where corners are at one place, and
  /// where the polygon goes back on its own line. A polygon that goes round several times counts
  /// as one that goes round once.
  ///
  /// Takes a time of O(n^2) at most. Returns false and appends nothing if the polygon crosses
  /// itself.
  ///
  /// @param corners  at least 3, indices of points, whose coordinates are finite; those of one
  ///     round remain
  bool cut(const std::vector<Point>& points, std::vector<std::int32_t>& corners,
           std::vector<std::int32_t>& triangles);

 private:
  /// What the triangle of a corner and its neighbors is, in the order in which it is taken off.
  enum class Ear {
    kSpur,      ///< no area; the polygon goes back on its own line
    kFree,      ///< nothing touches the new edge
    kTouched,   ///< another corner is on the new edge
    kDoubtful,  ///< both edges are passed backward, too, so it may be outside of the polygon
    kStraight,  ///< no area; the corner is on the line of its neighbors
    kNone
  };

  struct Corner {
    std::int32_t point;
    PlanePoint place;  ///< so projected that the polygon runs counterclockwise
    std::size_t last = 0, next = 0;
    int turn = 0;  ///< 1 to the left, 0 straight on or back, -1 to the right
    bool is_blocker = false;
    Ear ear = Ear::kNone;
    double length = 0;  ///< of the new edge
  };

  void project(const std::vector<Point>& points, const std::vector<std::int32_t>& corners,
               const std::vector<Point>& seen);
  bool takeOffEars(double tolerance);
  void readTurn(std::size_t corner);
  void readEar(std::size_t corner);
  Ear earAt(std::size_t corner);
  bool isTwoWay(const Corner& from, const Corner& to) const;
  bool isDoubtful(std::size_t corner) const;
  bool overlap() const;

  const std::vector<Point>* points_ = nullptr;
  std::vector<Corner> corners_;
  Sides side_;
  double tolerance_ = 0;  ///< of corners that are rounded, but less than the size of the polygon
  /// The corners that do not turn left. An edge that enters the triangle of another corner begins
  /// or ends at one of them.
  std::vector<std::size_t> blockers_;
  std::multiset<std::pair<PlanePoint, PlanePoint>> edges_;  ///< from, to
  std::set<std::tuple<Ear, double, std::size_t>> ears_;     ///< and `length`, corner
  std::vector<std::array<std::size_t, 3>> triangles_;       ///< of corners
};

}  // namespace fcl_fibers::io
