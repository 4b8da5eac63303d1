// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "contenders/narrow_phase.h"
#include "harness/runs.h"
#include "measures.h"
#include "measures/loose_objects.h"
#include "measures/meshes.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 15;
constexpr int kTurns = 4;  // of two managers in one run

using FiberManager = LayeredAABBTreeCollisionManagerd;
using Fibers = std::vector<FiberObjects<Object>>;

std::unique_ptr<FiberManager> setUp(const Fibers& fibers, const FiberManagerOptions& options,
                                    Object* beside = nullptr) {
  auto manager = std::make_unique<FiberManager>(options);
  for (const auto& fiber : fibers) manager->registerFiber(fiber.objects, fiber.ends);
  if (beside != nullptr) manager->registerObject(beside);
  manager->setup();
  return manager;
}

void expectSame(double answer, double expected) {
  if (answer == expected) return;
  throw std::runtime_error("answers " + std::to_string(answer) + " instead of " +
                           std::to_string(expected));
}

double pairsOf(const Manager& manager) { return static_cast<double>(countPairs(manager).pairs); }

/// The objects of a scene with other shapes, and two frames of their poses.
struct ShapedFibers {
  ShapedFibers(const std::array<FiberPolylines, 2>& scenes, Geometry (*make)(const fcl::Capsuled&))
      : poses{segmentPoses<double>(scenes[0]), segmentPoses<double>(scenes[1])} {
    for (const auto& capsule : makeObjects<double>(scenes[0])) {
      const Geometry shape = make(static_cast<const fcl::Capsuled&>(*capsule->collisionGeometry()));
      objects.push_back(std::make_unique<Object>(shape, capsule->getTransform()));
    }
    fibers = objectsByFiber(scenes[0], objects);
  }

  void setPoses(std::size_t frame) {
    for (std::size_t i = 0; i < objects.size(); ++i) objects[i]->setTransform(poses[frame][i]);
  }

  std::array<std::vector<fcl::Transform3d>, 2> poses;
  std::vector<std::unique_ptr<Object>> objects;
  Fibers fibers;
};

Geometry capsuleOf(const fcl::Capsuled& of) { return std::make_shared<fcl::Capsuled>(of); }
Geometry cylinderOf(const fcl::Capsuled& of) {
  return std::make_shared<fcl::Cylinderd>(of.radius, of.lz);
}
Geometry boxOf(const fcl::Capsuled& of) {
  return std::make_shared<fcl::Boxd>(2 * of.radius, 2 * of.radius, of.lz);
}

/// Objects that are as large as space or small, and 5 cm below all points.
std::vector<std::pair<std::string, std::shared_ptr<Object>>> objectsBelow(
    const FiberPolylines& scene) {
  const auto below = [&](const fcl::Vector3d& normal) {
    double least = std::numeric_limits<double>::infinity();
    for (const Point& point : scene.points) least = std::min(least, normal.dot(toVector(point)));
    return least - 5;
  };
  const fcl::Vector3d up(0, 0, 1), tilted = fcl::Vector3d(0.1, 0.05, 1).normalized();
  const auto made = [&](const Geometry& shape, double z = 0) {
    return std::make_shared<Object>(shape, fcl::Transform3d(fcl::Translation3d(0, 0, z)));
  };
  return {{"half-space", made(std::make_shared<fcl::Halfspaced>(up, below(up)))},
          {"tilted half-space", made(std::make_shared<fcl::Halfspaced>(tilted, below(tilted)))},
          {"tilted plane", made(std::make_shared<fcl::Planed>(tilted, below(tilted)))},
          {"box", made(std::make_shared<fcl::Boxd>(1e-3, 1e-3, 1e-3), below(up))},
          {"ball", made(std::make_shared<fcl::Sphered>(1e-3), below(up))}};
}

/// Pairs of a self-collision query with an object, and of the others.
struct PairsBeside {
  const Object* object;
  std::size_t with = 0, without = 0;

  static bool callback(Object* a, Object* b, void* data) {
    auto& self = *static_cast<PairsBeside*>(data);
    ++(a == self.object || b == self.object ? self.with : self.without);
    return false;
  }
};

/// Both managers are new in each run, so that neither has the better memory.
void registerBeside(const std::string& what, const Fibers& fibers,
                    const FiberManagerOptions& options, const std::shared_ptr<Object>& object) {
  registerRuns("Beside/" + what, kRuns, [=, &fibers](Numbers& numbers) {
    const auto alone = setUp(fibers, options), beside = setUp(fibers, options, object.get());
    PairsBeside pairs{object.get()};
    beside->collide(&pairs, PairsBeside::callback);
    expectSame(static_cast<double>(pairs.without), pairsOf(*alone));
    numbers["with"] = static_cast<double>(pairs.with);
    double taken = 0;
    for (int turn = 0; turn < kTurns; ++turn) {
      numbers["reference"] += seconds([&] { countPairs(*alone); }) / kTurns;
      taken += seconds([&] { countPairs(*beside); }) / kTurns;
    }
    return taken;
  });
}

/// "capsules_" are of the same scene as capsules, by turns.
void registerFibersOf(const std::string& shape, ShapedFibers& shaped, ShapedFibers& capsules) {
  const FiberManagerOptions options = {touchingOptions(1)};
  registerRuns("FibersOf/" + shape, kRuns, [=, &shaped, &capsules](Numbers& numbers) {
    const auto manager = setUp(shaped.fibers, options), other = setUp(capsules.fibers, options);
    const auto move = [&](ShapedFibers& fibers, FiberManager& of, const std::string& prefix) {
      for (const std::size_t frame : {1u, 0u}) {
        fibers.setPoses(frame);
        numbers[prefix + "update"] += seconds([&] { of.update(); }) / 2 / kTurns;
        numbers[prefix + "detection"] += seconds([&] { countPairs(of); }) / 2 / kTurns;
      }
    };
    for (int turn = 0; turn < kTurns; ++turn) {
      move(capsules, *other, "capsules_");
      move(shaped, *manager, "");
    }
    numbers["pairs"] = pairsOf(*manager);
    expectSame(numbers["pairs"], pairsOf(*setUp(shaped.fibers, options)));
    numbers["bytes"] = static_cast<double>(manager->memoryUsage());
    numbers["segments"] = static_cast<double>(shaped.objects.size());
    return numbers["update"] + numbers["detection"];
  });
}

// Each makes a manager of such objects, changes it, and returns the seconds of that and an answer:
// pairs that touch, the same for all contenders.

/// Of all pairs in one order, because fcl::collide may change its mind if the two change places.
double touching(const Manager& manager) {
  PairSample<double> sample = samplePairs(manager, 0, 0);
  for (auto& [a, b] : sample.pairs) {
    if (std::less<>()(b, a)) std::swap(a, b);
  }
  return collide(manager, sample).touching;
}

template <bool kWritesBoxes>
double registerEach(const Contender& contender, LooseObjects& loose, double& answer) {
  const auto manager = contender.make(loose.objects);
  const double taken = seconds([&] {
    for (const auto& object : loose.owned) {
      if (kWritesBoxes) object->computeBox(contender);
      manager->registerObject(object.get());
      manager->update();
    }
  });
  answer = touching(*manager);
  return taken;
}

double unregisterEach(const Contender& contender, LooseObjects& loose, double& answer) {
  const auto manager = contender.setUp(loose.objects);
  answer = touching(*manager);
  std::size_t pairs = 0;
  // The query is for a manager that only notes what it has to do.
  const double taken = seconds([&] {
    for (Object* const object : loose.objects) manager->unregisterObject(object);
    manager->collide(&pairs, countPair);
  });
  expectSame(static_cast<double>(manager->size() + pairs), 0);
  return taken;
}

/// Of a capsule among the others, where one of them is.
struct WithCapsule {
  WithCapsule(const Contender& contender, const LooseObjects& loose)
      : capsule(std::make_shared<fcl::Capsuled>(0.01, 0.1), loose.poses[0].back()),
        manager(contender.setUp(loose.objects)) {
    capsule.computeAABB();
    capsule.computeBox(contender);
    manager->registerObject(&capsule);
    manager->setup();
  }
  BoxedObject capsule;
  std::unique_ptr<Manager> manager;
};

/// All move to the other frame and back.
double updateAll(const Contender& contender, LooseObjects& loose, double& answer) {
  constexpr int kMoves = 100;
  auto manager = contender.setUp(loose.objects);
  double taken = 0;
  for (int move = 1; move <= kMoves; ++move) {
    if (contender.is_renewed) manager = contender.setUp(loose.objects);
    taken += seconds([&] {
      loose.setPoses(static_cast<std::size_t>(move % 2));
      loose.computeBoxes(contender);
      manager->update();
    });
  }
  answer = touching(*manager);
  return taken / kMoves;
}

double collideAll(const Contender& contender, LooseObjects& loose, double& answer) {
  const auto manager = contender.setUp(loose.objects);
  const double taken = secondsOfCall([&] { countPairs(*manager); });
  answer = touching(*manager);
  return taken;
}

/// The capsule, or the first of the others, moves to the other frame and back.
template <bool kCapsule>
double updateOne(const Contender& contender, LooseObjects& loose, double& answer) {
  WithCapsule all(contender, loose);
  BoxedObject& object = kCapsule ? all.capsule : *loose.owned.front();
  const std::size_t pose = kCapsule ? loose.objects.size() - 1 : 0;
  const double taken = secondsOfCall([&] {
    for (const std::size_t frame : {1u, 0u}) {
      object.setTransform(loose.poses[frame][pose]);
      object.computeBox(contender);
      all.manager->update(&object);
    }
  });
  answer = touching(*all.manager);
  return taken / 2;
}

double registerAndAsk(const Contender& contender, LooseObjects& loose, double& answer) {
  WithCapsule all(contender, loose);
  Object* const one = loose.objects.back();  // which the capsule touches
  std::size_t pairs = 0;
  const double taken = secondsOfCall([&] {
    all.manager->unregisterObject(one);
    all.manager->registerObject(one);
    all.manager->collide(&all.capsule, &pairs, countPair);
  });
  answer = touching(*all.manager);
  return taken;
}

using Changes = double (*)(const Contender&, LooseObjects&, double& answer);

void registerChanges(const std::string& what, const std::shared_ptr<LooseObjects>& loose,
                     Changes change) {
  const auto agreed = std::make_shared<std::optional<double>>();
  for (const Contender& contender :
       {ourContender("LayeredAABBTree/boxes"), ourContender("LayeredAABBTree/capsules"),
        allOf({Group::kFclTrees}, Boxes::kStock).front(),
        allOf({Group::kFclTrees}, Boxes::kTight).front()}) {
    const std::string name = "OneByOne/" + std::to_string(loose->objects.size()) + " " +
                             loose->name + ", " + what + "/" + contender.name();
    registerRuns(name, runsOf(contender.ours, kRuns), [=](Numbers& numbers) {
      loose->reset();
      loose->computeBoxes(contender);
      const double taken = change(contender, *loose, numbers["answer"]);
      expectSame(numbers["answer"], agreed->value_or(numbers["answer"]));
      *agreed = numbers["answer"];
      return taken;
    });
  }
}

void registerAllChanges() {
  const Geometry cylinder = std::make_shared<fcl::Cylinderd>(0.01, 0.1);
  const Geometry ellipsoid = std::make_shared<fcl::Ellipsoidd>(0.01, 0.05, 0.01);
  const Geometry mesh = tetrahedron(0.04), box = std::make_shared<fcl::Boxd>(0.02, 0.03, 0.04);
  const auto make = [](const char* name, const Geometry& shape, std::size_t count) {
    return std::make_shared<LooseObjects>(name, true, shape, count);
  };
  for (const std::size_t count : {5000u, 10000u, 20000u}) {
    registerChanges("unregister each", make("cylinders", cylinder, count), unregisterEach);
    registerChanges("unregister each", make("ellipsoids", ellipsoid, count), unregisterEach);
    registerChanges("unregister each", make("meshes", mesh, count), unregisterEach);
  }
  for (const std::size_t count : {500u, 2000u, 10000u}) {
    const auto meshes = make("meshes", mesh, count);
    registerChanges("update a capsule", meshes, updateOne<true>);
    registerChanges("update a mesh", meshes, updateOne<false>);
    registerChanges("unregister and register a mesh, ask", meshes, registerAndAsk);
  }
  const auto boxes = make("boxes", box, 300);
  registerChanges("self-collision", boxes, collideAll);
  registerChanges("move all and update", boxes, updateAll);
  for (const std::size_t count : {10u, 30u, 100u, 300u, 1000u}) {
    const auto some = make("boxes", box, count);
    registerChanges("register and update after each, box written before", some,
                    registerEach<false>);
    registerChanges("register with its box and update after each", some, registerEach<true>);
  }
}

bool measureShapes(const Request& request) {
  tools::progress("shapes: make the scenes");
  const std::array<FiberPolylines, 2> scenes = twoFrames(request.scene);
  ShapedFibers capsules(scenes, capsuleOf), cylinders(scenes, cylinderOf), boxes(scenes, boxOf);
  const auto below = objectsBelow(scenes[0]);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const int ignored : {0, 1}) {
      FiberManagerOptions options;
      options.report = report;
      options.ignored_neighbors = ignored;
      const std::string name = std::string(report == Report::kVolumes ? "kVolumes" : "kCapsules") +
                               (ignored == 0 ? "/" : ", no neighbours/");
      for (const auto& [what, object] : below) {
        registerBeside(name + what, capsules.fibers, options, object);
      }
    }
  }
  registerFibersOf("capsules", capsules, capsules);
  registerFibersOf("cylinders", cylinders, capsules);
  registerFibersOf("boxes", boxes, capsules);
  registerAllChanges();
  return runRegistered();
}

const AddMeasure kMeasure("shapes", measureShapes);

}  // namespace

}  // namespace fcl_fibers::benchmarks
