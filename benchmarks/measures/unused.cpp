// SPDX-License-Identifier: BSD-3-Clause
//
// What a scene pays for features that it does not use.
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/live_pairs.h>

#include "harness/runs.h"
#include "measures.h"
#include "measures/meshes.h"
#include "scenes/ball.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 15, kTurns = 4;

/// Fibers that are updated and asked what touches.
struct Way {
  std::function<double()> frame;  ///< seconds of a frame after a motion
  std::function<std::size_t()> bytes;
};

void registerBoth(const std::string& name, const Way& with, const Way& without) {
  registerRuns("Unused/" + name, kRuns, [=, turn = 0](Numbers& numbers) mutable {
    for (int i = 0; i < kTurns; ++i) {
      const bool first = turn++ % 2 == 0;
      if (first) numbers["with"] += with.frame() / kTurns;
      numbers["without"] += without.frame() / kTurns;
      if (!first) numbers["with"] += with.frame() / kTurns;
    }
    numbers["bytes_with"] = static_cast<double>(with.bytes());
    numbers["bytes_without"] = static_cast<double>(without.bytes());
    return numbers["with"];
  });
}

/// The two frames as arrays, to which a feature is added.
struct Fibers {
  explicit Fibers(const std::array<FiberPolylines, 2>& frames) : scenes(frames) {
    const std::size_t fibers = scenes[0].fiberCount(), points = scenes[0].points.size();
    none.assign(fibers, 0);
    zeros.assign(fibers, 0);
    all.assign(fibers, ~std::uint32_t{0});
    radii.assign(points, scenes[0].radius);
    ends.assign(scenes[0].point_begin.begin() + 1, scenes[0].point_begin.end());
    for (std::size_t i = 0; i < 2; ++i) arrays[i] = fiberArrays(scenes[i]);
  }

  std::array<FiberPolylines, 2> scenes;
  std::vector<std::uint8_t> none;
  std::vector<std::int32_t> zeros;
  std::vector<std::uint32_t> all;
  std::vector<double> radii;
  std::vector<std::size_t> ends;
  std::array<FiberArrays<double>, 2> arrays;
};
using Fill = std::function<void(Fibers&)>;
using Use = std::function<void(FiberTree&, const Fibers&)>;

Way treeWay(const std::array<FiberPolylines, 2>& frames, const Fill& fill, const Use& use) {
  const auto fibers = std::make_shared<Fibers>(frames);
  fill(*fibers);
  const auto tree = makeTree(fibers->arrays[0], {touchingOptions(1)});
  use(*tree, *fibers);
  const auto frame = [=] {
    tree->update(fibers->arrays[1]);
    double count = 0;
    const double update = seconds([&] { tree->update(fibers->arrays[0]); });
    return update + secondsOfCount(*tree, Pairs{}, count);
  };
  return {frame, [=] { return tree->memoryUsage(); }};
}

void registerTrees(const std::array<FiberPolylines, 2>& frames) {
  const Fill plain = [](Fibers&) {};
  const Use never = [](FiberTree&, const Fibers&) {};
  const Way without = treeWay(frames, plain, never);
  const auto add = [&](const std::string& name, const Fill& fill, const Use& use) {
    registerBoth("arrays/" + name, treeWay(frames, fill, use), without);
  };
  const auto addArrays = [&](const std::string& name, void (*set)(Fibers&, FiberArrays<double>&)) {
    add(
        name,
        [set](Fibers& fibers) {
          for (auto& a : fibers.arrays) set(fibers, a);
        },
        never);
  };
  using Arrays = FiberArrays<double>;
  addArrays("flags of closed fibers, none closed",
            [](Fibers& f, Arrays& a) { a.closed = f.none.data(); });
  addArrays("groups, all 0", [](Fibers& f, Arrays& a) { a.groups = f.zeros.data(); });
  addArrays("roots, none", [](Fibers& f, Arrays& a) { a.root_segments = f.zeros.data(); });
  addArrays("categories, all", [](Fibers& f, Arrays& a) {
    a.categories = f.all.data();
    a.meets = f.all.data();
  });
  addArrays("radii of segments, all equal", [](Fibers& f, Arrays& a) {
    a.radii = f.radii.data();
    a.radii_are = Arrays::Radii::kPerFirstPoint;
  });
  addArrays("points between fibers, none",
            [](Fibers& f, Arrays& a) { a.point_end = f.ends.data(); });
  add("a step that is over", plain, [](FiberTree& tree, const Fibers& fibers) {
    tree.update(fibers.arrays[0], fibers.arrays[1]);
    double count = 0;
    secondsOfCount(tree, Impacts{}, count);
  });
  add("live pairs that are gone", plain, [](FiberTree& tree, const Fibers& fibers) {
    LivePairs pairs(tree);
    pairs.update();
    tree.update(fibers.arrays[1]);
    pairs.update();
  });
}

/// Objects and a manager that has them, and others that touch nothing.
struct Managed {
  Managed(const std::array<FiberPolylines, 2>& frames, const FiberManagerOptions& options,
          const std::shared_ptr<fcl::CollisionGeometryd>& beside)
      : fibers("fibers", frames[0], frames[1]), manager(options) {
    for (const auto& fiber : fibers.fibers()) manager.registerFiber(fiber.objects, fiber.ends);
    if (beside) {
      fcl::Transform3d pose = fcl::Transform3d::Identity();
      pose.translation() = fcl::Vector3d(0, 0, -1000);
      object = std::make_unique<fcl::CollisionObjectd>(beside, pose);
      manager.registerObject(object.get());
    }
    manager.setup();
  }

  MovingFibers fibers;
  std::unique_ptr<fcl::CollisionObjectd> object;
  LayeredAABBTreeCollisionManagerd manager;
};

Way managerWay(const std::array<FiberPolylines, 2>& frames, const FiberManagerOptions& options,
               const std::shared_ptr<fcl::CollisionGeometryd>& beside = nullptr) {
  const auto managed = std::make_shared<Managed>(frames, options, beside);
  const auto frame = [managed] {
    managed->fibers.setPoses(1);
    managed->manager.update();
    managed->fibers.setPoses(0);
    return seconds([&] {
      managed->manager.update();
      countPairs(managed->manager);
    });
  };
  return {frame, [managed] { return managed->manager.memoryUsage(); }};
}

void registerManagers(const std::array<FiberPolylines, 2>& frames) {
  FiberManagerOptions plain{touchingOptions(1)};
  const Way without = managerWay(frames, plain);
  const auto add = [&](const std::string& name, const Way& with) {
    registerBoth("objects/" + name, with, without);
  };
  FiberManagerOptions motion = plain, shapes = plain;
  motion.motion = true;
  shapes.bounds = Bounds::kShapes;
  add("motion that is allowed, without a step", managerWay(frames, motion));
  // The other way around: what is left out here is what the default looks at.
  registerBoth("objects/margins in boxes, none", without, managerWay(frames, shapes));
  add("a half-space below",
      managerWay(frames, plain, std::make_shared<fcl::Halfspaced>(fcl::Vector3d(0, 0, 1), -1e4)));
  add("a sphere far away", managerWay(frames, plain, std::make_shared<fcl::Sphered>(1.0)));
  add("a cylinder far away", managerWay(frames, plain, std::make_shared<fcl::Cylinderd>(1.0, 1.0)));
  for (const int triangles : {1000, 100000}) {
    add("a mesh of " + tools::countText(static_cast<std::size_t>(triangles)) +
            " triangles far away, at rest",
        managerWay(frames, plain, modelOf(scenes::makeBall({1, 1, 1}, triangles))));
  }
}

bool measureUnused(const Request& request) {
  tools::progress("unused: make the scene");
  const auto frames = twoFrames(request.scene);
  registerTrees(frames);
  registerManagers(frames);
  return runRegistered();
}

const AddMeasure kMeasure("unused", measureUnused);

}  // namespace
}  // namespace fcl_fibers::benchmarks
