// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "support/scene.h"

namespace fcl_fibers::test {

/// Where a scene stands and how large it is: positions are origin + scale x (about -1 ... 1).
struct Placement {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double scale = 1;
};

/// Helices side by side and twisted together, like a strand of hair: most segments touch others.
template <typename S>
Scene<S> strandScene(std::size_t fibers, std::size_t segments, std::uint64_t seed,
                     const Placement& placement = {});

/// Capsules of random length and radius, unconnected; `size` is that of one, relative to the scene.
template <typename S>
Scene<S> soupScene(std::size_t capsules, double size, std::uint64_t seed,
                   const Placement& placement = {});

/// One fiber, curled up so that it meets itself again and again.
template <typename S>
Scene<S> curledScene(std::size_t segments, std::uint64_t seed, const Placement& placement = {});

/// Fibers of 1, 2, 3, ... and of many segments, short ones between long ones.
template <typename S>
Scene<S> unequalScene(std::uint64_t seed, const Placement& placement = {});

/// Closed fibers that pass through each other, as links of a chain.
template <typename S>
Scene<S> ringScene(std::size_t rings, std::size_t segments, std::uint64_t seed);

/// Zero length, zero radius, coincident, collinear, parallel, antiparallel, crossing, exactly
/// touching and almost parallel capsules. Apart from the last, all numbers are exact in float.
template <typename S>
Scene<S> degenerateScene();

/// A scene, and a margin that matters in it.
template <typename S>
struct NamedScene {
  std::string name;
  Scene<S> scene;
  double margin;
};

/// One of each of the above, and some of them far from the origin.
template <typename S>
std::vector<NamedScene<S>> standardScenes();

/// Adds `count` spheres, boxes, turned boxes, meshes, convex solids and octrees in turn, all over
/// the placement.
template <typename S>
void addShapes(Scene<S>& scene, std::size_t count, double size, std::uint64_t seed,
               const Placement& placement = {});

}  // namespace fcl_fibers::test
