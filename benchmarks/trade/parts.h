// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/scenes/fiber_polylines.h>

#include "geometry/segment.h"
#include "moving_fibers.h"
#include "tree/topology.h"

namespace fcl_fibers::benchmarks {

/// What a part is told.
struct PartRequest {
  std::string scene = "static";  ///< static, strand, half_scalp or dynamic
  unsigned long long seed = 1;
  HairRequest hair;  ///< instead of the scene
};

/// Two frames of a scene as polylines, which take turns.
struct Frames {
  std::string name;
  scenes::FiberScene frame[2];
};

/// static 1,000 x 100; strand 1,000 x 2,000; half_scalp a tenth of the fibers, as dense; dynamic,
/// in two states of the middle; or the file. Throws std::invalid_argument where there is no such
/// scene.
Frames makeFrames(const PartRequest& request);

// A scene as the trees take it.
std::vector<geometry::Segment> segmentsOf(const scenes::FiberScene& scene);
tree::Fibers fibersOf(const scenes::FiberScene& scene);

/// Bytes and times a segment of what a tree or a manager is told to keep: `Costs/arrays/...` and
/// `Costs/objects/...`.
void registerCosts();

// One dial each, on one scene: `Leaves/<segments to a leaf>`, `Sampling/<segments>`,
// `Bound/<kind>:<value>`, `Lazy/<fatness>`, `Spheres/<kind>`, `KDops/<k>`. Each registers its runs.
// Throws std::runtime_error where two ways do not find the same.
void registerLeaves(const Frames& frames);
void registerSampling();
void registerBounds(const Frames& frames);
void registerLazy(const PartRequest& request);
void registerSpheres(const Frames& frames);
void registerKDops(const Frames& frames);

using Numbers = std::map<std::string, double>;

/// Runs of which each says how many seconds it took, and what is to be told besides. A run that
/// throws std::runtime_error is an error of the benchmark.
void registerRuns(const std::string& name, int runs, std::function<double(Numbers&)> run);

}  // namespace fcl_fibers::benchmarks
