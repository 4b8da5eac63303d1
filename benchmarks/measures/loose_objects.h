// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "contenders/contender.h"
#include "measures/boxed_object.h"
#include "measures/meshes.h"

namespace fcl_fibers::benchmarks {

using Geometry = std::shared_ptr<fcl::CollisionGeometryd>;

inline Geometry tetrahedron(double edge) {
  return modelOf({{{0, 0, 0}, {edge, 0, 0}, {0, edge, 0}, {0, 0, edge}},
                  {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}});
}

/// Objects without any fiber, 10,000 in a cube of edge 1 or others at that density, and two frames
/// of their poses.
struct LooseObjects {
  static constexpr std::size_t kCount = 10000;

  LooseObjects(std::string name, bool turned, const Geometry& geometry, std::size_t count = kCount)
      : name(std::move(name)) {
    const double edge = std::cbrt(static_cast<double>(count) / kCount);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(0, 1);
    std::uniform_real_distribution<double> step(-0.005, 0.005);
    for (std::size_t i = 0; i < count; ++i) {
      fcl::Transform3d pose = fcl::Transform3d::Identity();
      pose.translation() = edge * fcl::Vector3d(place(random), place(random), place(random));
      if (turned) {
        const fcl::Vector3d axis(step(random), step(random), step(random));
        pose.linear() = fcl::AngleAxisd(6 * place(random), axis.normalized()).toRotationMatrix();
      }
      poses[0].push_back(pose);
      pose.translation() += fcl::Vector3d(step(random), step(random), step(random));
      poses[1].push_back(pose);
      owned.push_back(std::make_unique<BoxedObject>(geometry, poses[0].back()));
      objects.push_back(owned.back().get());
    }
  }

  void setPoses(std::size_t frame) {
    for (std::size_t i = 0; i < objects.size(); ++i) objects[i]->setTransform(poses[frame][i]);
  }

  void computeBoxes(const Contender& contender) {
    for (const auto& object : owned) object->computeBox(contender);
  }

  /// The first frame, with FCL's boxes: ours would take others for what a program has made of them.
  void reset() {
    setPoses(0);
    for (const auto& object : owned) object->computeAABB();
  }

  std::string name;
  std::array<std::vector<fcl::Transform3d>, 2> poses;
  std::vector<std::unique_ptr<BoxedObject>> owned;
  std::vector<Object*> objects;
};

}  // namespace fcl_fibers::benchmarks
