// SPDX-License-Identifier: BSD-3-Clause
#include "tree_scene.h"

#include <cstddef>

namespace fcl_fibers::benchmarks {
namespace {

geometry::Vec3d vec3(const scenes::Point& point) { return {point[0], point[1], point[2]}; }

}  // namespace

std::vector<geometry::Segment> treeSegments(const scenes::FiberScene& scene) {
  std::vector<geometry::Segment> segments;
  segments.reserve(scene.segmentCount());
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      segments.push_back({vec3(scene.points[i - 1]), vec3(scene.points[i]), scene.radiusAt(i - 1)});
    }
  }
  return segments;
}

tree::Fibers treeFibers(const scenes::FiberScene& scene) {
  tree::Fibers fibers;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      fibers.ids.push_back(static_cast<tree::SegmentId>(fibers.ids.size()));
    }
    fibers.endFiber();
  }
  return fibers;
}

}  // namespace fcl_fibers::benchmarks
