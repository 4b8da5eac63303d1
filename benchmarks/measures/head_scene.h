// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contenders/moving_fibers.h"
#include "measures.h"
#include "measures/meshes.h"
#include "scenes/ball.h"
#include "scenes/cap.h"

namespace fcl_fibers::benchmarks {

inline FiberPolylines hairOf(const SceneRequest& request) {
  const tools::SceneSource source = openScene(request.text, request.radius);
  if (source.name != "cap" && source.name != "combed") {
    throw std::invalid_argument("obstacles: '" + request.text +
                                "' has no head; give --scene=cap or --scene=combed");
  }
  return source.scene();
}

/// Where the head is at rest, where it comes from, and a rotation that nothing is aligned with.
inline fcl::Transform3d rest() { return fcl::Transform3d::Identity(); }
inline fcl::Transform3d before() { return fcl::Transform3d(fcl::Translation3d(0.1, 0.05, 0.02)); }
inline fcl::Transform3d rotation() {
  const fcl::Vector3d axis(0.48, -0.64, 0.6);
  return fcl::Transform3d(fcl::AngleAxisd(1.1, axis).toRotationMatrix());
}

inline scenes::Triangles moved(scenes::Triangles mesh, const fcl::Transform3d& pose) {
  for (Point& point : mesh.points) {
    const fcl::Vector3d p = pose * toVector(point);
    point = {p.x(), p.y(), p.z()};
  }
  return mesh;
}

/// Hair and its head, as arrays and as objects. Nothing but the pose of the head ever changes.
struct HeadScene {
  static constexpr int kRuns = 9;  ///< of what is measured here

  explicit HeadScene(const Request& request)
      : hair(hairOf(request.scene)),
        objects("obstacles", hair, hair),
        head(scenes::makeBall({scenes::kHeadRadius, scenes::kHeadRadius, scenes::kHeadRadius},
                              request.triangles)),
        corners(cornersOf(head, rest())),
        mesh(head.arrays()),
        turned(moved(head, rotation().inverse()).arrays()),
        object(modelOf<fcl::OBBd>(head), rest()) {}

  /// @param roots  whether the first segment of each fiber meets the head
  FiberArrays<double> arrays(bool roots) const {
    FiberArrays<double> result = fiberArrays(hair);
    if (!roots) result.root_segments = one_each.data();
    return result;
  }

  FiberPolylines hair;
  MovingFibers objects;
  std::vector<std::int32_t> one_each = std::vector<std::int32_t>(hair.fiberCount(), 1);
  scenes::Triangles head;
  std::vector<Corners> corners;
  TriangleMesh mesh;
  TriangleMesh turned;  ///< the same triangles if its pose is rotation()
  Object object;
};

// What needs no query of hair, in head_boxes.cpp.

/// Pairs of overlapping boxes of segments and triangles, by ours and by Embree.
void registerBoxes(const HeadScene& scene);
/// The update of the head's points.
void registerRefit(const HeadScene& scene);

}  // namespace fcl_fibers::benchmarks
