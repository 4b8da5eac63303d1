// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>

#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "contenders/moving_fibers.h"
#include "harness/runs.h"
#include "measures.h"
#include "measures/live_steps.h"

namespace fcl_fibers::benchmarks {
namespace {

/// FCL's objects, and a manager that searches in every step or keeps a list.
class Managed {
 public:
  Managed(const FiberPolylines& fibers, double skin)
      : objects_("live", fibers, fibers), manager_(optionsOf(skin)) {
    for (const MovingFibers::Fiber& fiber : objects_.fibers()) {
      manager_.registerFiber(fiber.objects, fiber.ends);
    }
    manager_.setup();
  }
  /// Capsules keep their lengths of the start.
  void moveTo(const FiberPolylines& fibers) {
    const auto poses = segmentPoses<double>(fibers);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      objects_.objects()[i]->setTransform(poses[i]);
      objects_.objects()[i]->computeAABB();
    }
  }
  void update() { manager_.update(); }
  template <class Visitor>
  void visit(Visitor&& visit) const {
    const auto call = [](Object* a, Object* b, void* data) {
      (*static_cast<std::remove_reference_t<Visitor>*>(data))(
          {static_cast<std::int32_t>(MovingFibers::index(a)),
           static_cast<std::int32_t>(MovingFibers::index(b))});
      return false;
    };
    manager_.collide(&visit, call);
  }

 private:
  static FiberManagerOptions optionsOf(double skin) {
    FiberManagerOptions options;
    options.report = Report::kCapsules;
    options.ignored_neighbors = 1;
    options.bounds = Bounds::kShapes;
    options.skin = skin;
    return options;
  }

  MovingFibers objects_;
  LayeredAABBTreeCollisionManagerd manager_;
};

bool measureObjects(const Request& request) {
  registerMotions("LiveObjects", request, [&request](const std::string& motion, Numbers& numbers) {
    const auto makeWith = [](double skin) {
      return
          [skin](const FiberPolylines& fibers) { return std::make_unique<Managed>(fibers, skin); };
    };
    runSteps(motion, request.scene, numbers, makeWith(/*skin=*/0), makeWith(/*skin=*/-1));
    return numbers["with_total"];
  });
  return runRegistered();
}

const AddMeasure kMeasure("live-objects", measureObjects);

}  // namespace

}  // namespace fcl_fibers::benchmarks
