// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "tools/mesh_file.h"

namespace fcl_fibers::tools::trade {

/// @file
/// What touches, found by the distances of all segments from all others. It shares no code with the
/// library, which it judges.

/// What fibers are asked about. There are fibers at rest, fibers and meshes, and fibers in a step.
struct Scene {
  FiberPolylines fibers;
  FiberPolylines before;              ///< where they were in another frame, so that updates move
  std::vector<MeshFile> meshes{};     ///< if there are any, segments are asked about these
  std::vector<FiberPolylines> end{};  ///< one element if there is a step

  bool isStep() const { return !end.empty(); }
};

constexpr std::int32_t kAMesh = -1;  ///< the partner of a segment that touches a mesh

/// Two segments, or a segment and kAMesh, and how they touch.
struct Touch {
  std::int32_t a, b;    ///< by first points, a < b
  double distance = 0;  ///< from surface to surface; in a step, at `time`
  Point normal{};       ///< from a to b; 0 where the axes meet, so that none is the right one
  Point place{};        ///< in the middle between the surfaces
  bool is_at_one_place = true;  ///< false for axes that are so parallel that many places are right
  double time = 1;              ///< of the first touch in a step
};

bool operator<(const Touch& a, const Touch& b);

/// What is true of a scene, or of a sample of it. The sample is of pieces: runs of segments of one
/// fiber.
struct Verdict {
  /// Pairs that touch, ascending, of which one at least is of the sample. Pairs that a fiber has
  /// with itself, or with one that it is joined to, because it is thick are no contacts: those
  /// whose part between them cannot turn back, see PairsAlong.
  std::vector<Touch> contacts;
  std::vector<Touch> open;  ///< pairs whose touch rounding decides, ascending
  /// By first point: the number of its piece, from 1, or 0 if it is outside of the sample.
  std::vector<std::size_t> sample;
  std::size_t pieces = 0, judged_pieces = 0;
  bool has_pairs_along = false;  ///< other than adjacent segments

  bool isWhole() const { return judged_pieces == pieces; }

  /// A pair of two pieces comes into the sample by either of them, so it counts half as much as one
  /// that can come by one piece alone: 1, 1/2, or 0 for a pair that is not judged.
  double weightOf(std::int32_t a, std::int32_t b) const {
    const auto has = [this](std::int32_t i) { return sample[static_cast<std::size_t>(i)] != 0; };
    if (b == kAMesh) return has(a) ? 1 : 0;
    return (has(a) ? 0.5 : 0) + (has(b) ? 0.5 : 0);
  }
};

/// How many pairs tell as much as those of a sample. The pairs of a piece are alike, so they tell
/// less than as many from anywhere: as much as the squared sum of all over the sum of the squares
/// of each piece's (Kish, Survey Sampling, 1965).
class EffectiveCount {
 public:
  void add(std::size_t piece, double weight) {
    if (piece >= of_piece_.size()) of_piece_.resize(piece + 1);
    of_piece_[piece] += weight;
  }
  double get() const {
    double sum = 0, squares = 0;
    for (const double weight : of_piece_) {
      sum += weight;
      squares += weight * weight;
    }
    return squares > 0 ? sum * sum / squares : 0;
  }

 private:
  std::vector<double> of_piece_;
};

/// Judges pieces in a random order, which is always the same, until that has taken `most_tests` of
/// two segments or boxes.
/// @param tell  is told the share that is done, from 0 to 1
Verdict judge(const Scene& scene, double most_tests, const std::function<void(double)>& tell);

}  // namespace fcl_fibers::tools::trade
