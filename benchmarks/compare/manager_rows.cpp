// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "rows.h"

namespace compare {

using namespace fcl_fibers;
using Call = Row::Call;
using Object = fcl::CollisionObject<double>;

namespace {

/// Lets the search go on for what is nearer than two centers have been.
bool nearer(Object* a, Object* b, void* found, double& least) {
  const double distance = (a->getTranslation() - b->getTranslation()).norm();
  if (distance < least) static_cast<Hash*>(found)->add(least = distance);
  return false;
}
bool touching(Object* a, Object*, void* found) {
  static_cast<Hash*>(found)->add(a->getTranslation()[0]);
  return false;
}

/// A manager, and another one beside it.
template <class Manager>
struct ManagerScene : Scene {
  using Query = void (*)(const ManagerScene& scene, Hash& found);

  ManagerScene(const FiberManagerOptions& options, int fibers, Query ask)
      : manager(options), other(options), ask_(ask) {
    for (const double swing : {0., 1., 1.3, 2.5}) states_.push_back(makeHair(fibers, 30, swing));
    objects_ = makeObjects<double>(states_[0]);
    others = makeObjects<double>(states_[3]);
    add(states_[3], others, other);
  }

  void build() override {
    moveObjects(states_[0], objects_);
    manager.clear();
    add(states_[0], objects_, manager);
  }
  void update() override {
    state_ = 3 - state_;
    moveObjects(states_[state_], objects_);
    manager.update();
  }
  void query(Hash& found) override { ask_(*this, found); }

  Manager manager;
  mutable Manager other;
  std::vector<std::unique_ptr<Object>> others;

 private:
  static void add(const FiberPolylines& hair, const std::vector<std::unique_ptr<Object>>& objects,
                  Manager& to) {
    for (const auto& fiber : objectsByFiber(hair, objects)) to.registerFiber(fiber.objects);
    to.setup();
  }

  Query ask_;
  std::vector<FiberPolylines> states_;
  std::vector<std::unique_ptr<Object>> objects_;
  std::size_t state_ = 1;
};

template <class Manager>
void addRowsOf(const std::string& name, Topology topology, int fibers, std::vector<Row>& rows) {
  using Managed = ManagerScene<Manager>;
  const auto add = [&](const std::string& what, const std::vector<Call>& calls, Report report,
                       typename Managed::Query query) {
    FiberManagerOptions options;
    options.topology = topology;
    options.report = report;
    options.ignored_neighbors = 1;
    addRows(
        name + what, calls, [=] { return std::make_unique<Managed>(options, fibers, query); },
        rows);
  };
  add(" collide:", {Call::kBuild, Call::kUpdate, Call::kQuery}, Report::kVolumes,
      [](const Managed& s, Hash& found) { s.manager.collide(&found, touching); });
  add(" distance:", {Call::kQuery}, Report::kCapsules,
      [](const Managed& s, Hash& found) { s.manager.distance(&found, nearer); });
  add(" distance of two:", {Call::kQuery}, Report::kCapsules,
      [](const Managed& s, Hash& found) { s.manager.distance(&s.other, &found, nearer); });
  add(" distance of objects:", {Call::kQuery}, Report::kVolumes, [](const Managed& s, Hash& found) {
    for (const auto& one : s.others) s.manager.distance(one.get(), &found, nearer);
  });
}

}  // namespace

void addManagerRows(std::vector<Row>& rows) {
  using Boxes = LayeredAABBTreeCollisionManagerd;
  using Spheres = WrappedSphereTreeCollisionManagerd;
  addRowsOf<Boxes>("bundle boxes, manager,", Topology::kBundle, 100, rows);
  addRowsOf<Boxes>("published boxes, manager,", Topology::kSuperThread, 50, rows);
  addRowsOf<Spheres>("bundle spheres, manager,", Topology::kBundle, 50, rows);
  addRowsOf<Spheres>("published spheres, manager,", Topology::kSuperThread, 50, rows);
}

}  // namespace compare
