// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcl/narrowphase/collision.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "harness/runs.h"
#include "measures.h"
#include "measures/head_scene.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = HeadScene::kRuns, kSlowRuns = 5;
constexpr double kSlow = 1;  // seconds

/// Numbers of segments in the scene.
using Segments = std::vector<std::size_t>;

/// Who finds the segments that touch the head: seconds of its pose's update and of the query.
struct Finder {
  std::string name;
  bool ours;
  std::function<double(Segments& found, Numbers& numbers)> find;
};

/// Of TouchingSegments, the numbers of segments.
void toNumbers(const FiberTree& tree, const std::vector<std::int32_t>& first_points,
               Segments& numbers) {
  numbers.clear();
  for (const std::int32_t point : first_points) {
    numbers.push_back(static_cast<std::size_t>(point) - tree.fiberSegment(point).fiber);
  }
}

Finder byArrays(const std::string& name, const std::shared_ptr<FiberTree>& tree, TriangleMesh& mesh,
                const fcl::Transform3d& pose) {
  const auto segments = std::make_shared<std::vector<std::int32_t>>();
  return {name, true, [=, &mesh](Segments& found, Numbers&) {
            mesh.setPose(toMeshPose(pose * before()));
            const double taken = seconds([&] {
              mesh.setPose(toMeshPose(pose));
              tree->find(TouchingSegments{}, mesh, *segments);
            });
            toNumbers(*tree, *segments, found);
            return taken;
          }};
}

/// A callback that notes the objects which it meets beside the head.
struct Noted {
  const Object* head;
  Segments& found;
  std::size_t pairs = 0;

  void note(const Object* a, const Object* b) {
    found.push_back(MovingFibers::index(a == head ? b : a));
  }
  static bool all(Object* a, Object* b, void* data) {
    static_cast<Noted*>(data)->note(a, b);
    return false;
  }
  static bool colliding(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Noted*>(data);
    ++self.pairs;
    fcl::CollisionResultd result;
    fcl::collide(a, b, fcl::CollisionRequestd(), result);
    if (result.isCollision()) self.note(a, b);
    return false;
  }
};

/// Hair of one group, which is not searched for pairs within, and the head as an obstacle.
Finder byManager(HeadScene& scene, bool roots) {
  const auto manager =
      std::make_shared<LayeredAABBTreeCollisionManagerd>(FiberManagerOptions{touchingOptions()});
  FiberObstacles obstacles;
  obstacles.root_segments = roots ? 0 : 1;
  for (const MovingFibers::Fiber& fiber : scene.objects.fibers()) {
    manager->registerFiber(fiber.objects, fiber.ends, FiberGroup{1}, obstacles);
  }
  manager->registerObstacle(&scene.object);
  manager->setup();
  return {"manager", true, [=, &scene](Segments& found, Numbers&) {
            scene.object.setTransform(before());
            manager->update(&scene.object);
            found.clear();
            Noted noted{&scene.object, found};
            const double taken = seconds([&] {
              scene.object.setTransform(rest());
              manager->update(&scene.object);
              manager->collide(&noted, Noted::all);
            });
            return taken;
          }};
}

std::vector<Object*> objectsOf(const HeadScene& scene, bool roots) {
  std::vector<Object*> objects;
  for (const MovingFibers::Fiber& fiber : scene.objects.fibers()) {
    objects.insert(objects.end(), fiber.objects.begin() + (roots ? 0 : 1), fiber.objects.end());
  }
  return objects;
}

/// FCL's tree whose query with the head is the fastest, of every fourth fiber.
Contender fastestTree(HeadScene& scene) {
  std::vector<Object*> some = scene.objects.objects();
  some.resize((some.size() + 3) / 4);
  Contender fastest;
  double least = 0;
  for (const Contender& contender : allOf({Group::kFclTuned}, Boxes::kTight)) {
    const auto manager = contender.setUp(some);
    std::size_t pairs = 0;
    const auto query = [&] { manager->collide(&scene.object, &pairs, countPair); };
    query();
    const double taken = std::min(seconds(query), seconds(query));
    if (!fastest.make || taken < least) {
      fastest = contender;
      least = taken;
    }
  }
  return fastest;
}

/// The query of the head, which meets no hair twice, and fcl::collide on each of its pairs.
/// @pre all objects have tight boxes
Finder byFcl(const Contender& tree, HeadScene& scene, bool roots) {
  const std::shared_ptr<Manager> manager = tree.setUp(objectsOf(scene, roots));
  return {tree.name(), false, [=, &scene](Segments& found, Numbers& numbers) {
            found.clear();
            scene.object.setTransform(before());
            scene.object.computeAABB();
            Noted noted{&scene.object, found};
            const double taken = seconds([&] {
              scene.object.setTransform(rest());
              scene.object.computeAABB();
              manager->collide(&scene.object, &noted, Noted::colliding);
            });
            numbers["pairs"] = static_cast<double>(noted.pairs);
            return taken;
          }};
}

/// Compares sets of segments, both in ascending order. The judge decides where they differ, for
/// which it takes all triangles.
class Judge {
 public:
  explicit Judge(const HeadScene& scene)
      : corners_(scene.corners), capsules_(scene.objects.capsules()) {}

  struct Found {
    std::size_t missed = 0, extra = 0, undecided = 0;
  };
  Found compare(const Segments& truth, const Segments& found) const {
    Found result;
    Segments differing;
    std::set_symmetric_difference(truth.begin(), truth.end(), found.begin(), found.end(),
                                  std::back_inserter(differing));
    for (const std::size_t segment : differing) {
      const bool is_found = std::binary_search(found.begin(), found.end(), segment);
      const Contact judged = contact(capsules_[segment], corners_);
      result.undecided += judged == Contact::kBoundary ? 1 : 0;
      result.missed += judged == Contact::kTouching && !is_found ? 1 : 0;
      result.extra += judged == Contact::kApart && is_found ? 1 : 0;
    }
    return result;
  }

 private:
  const std::vector<Corners>& corners_;
  std::vector<Capsule> capsules_;
};

/// Checks that all of ours find the same, and that FCL finds nothing else but what the judge lays
/// to its charge. Registers what the check has found, and the runs.
bool registerTouching(const HeadScene& scene, const std::string& set,
                      const std::vector<Finder>& finders) {
  const Judge judge(scene);
  Segments truth;
  bool right = true;
  Numbers checked;
  for (const Finder& finder : finders) {
    tools::progress("obstacles: check " + finder.name + ", " + set);
    Segments found;
    Numbers numbers;
    const double taken = finder.find(found, numbers);
    std::sort(found.begin(), found.end());
    if (&finder == &finders.front()) truth = found;
    const Judge::Found judged = judge.compare(truth, found);
    // Where FCL finds one that ours does not, both are judged: none of ours may be missing.
    const Judge::Found first = judge.compare(found, truth);
    if (first.missed + first.extra > 0 ||
        (finder.ours && judged.missed + judged.extra + judged.undecided > 0)) {
      right = tellWrong(set + ", " + finder.name + ": ours misses " +
                        std::to_string(first.missed + judged.missed) + " and has " +
                        std::to_string(first.extra + judged.extra) + " that do not touch");
    }
    if (!finder.ours) {
      checked["missed"] = static_cast<double>(judged.missed);
      checked["extra"] = static_cast<double>(judged.extra);
      checked["undecided"] = static_cast<double>(judged.undecided);
    }
    const auto run = [find = finder.find, count = found.size()](Numbers& run_numbers) {
      Segments again;
      const double run_taken = find(again, run_numbers);
      if (again.size() != count) throw std::runtime_error("finds other segments than at first");
      return run_taken;
    };
    const int runs = runsOf(finder.ours, taken > kSlow ? kSlowRuns : kRuns);
    registerRuns("Touching/" + set + "/" + finder.name, runs, run, finder.ours);
  }
  checked["touching"] = static_cast<double>(truth.size());
  checked["segments"] = static_cast<double>(scene.hair.segmentCount());
  checked["fibers"] = static_cast<double>(scene.hair.fiberCount());
  checked["triangles"] = static_cast<double>(scene.mesh.triangleCount());
  registerNumbers("Judged/" + set, checked);
  return right;
}

/// Contacts with points and normals of all segments and triangles that touch.
void registerContacts(const HeadScene& scene, const std::string& set, bool roots,
                      const std::shared_ptr<FiberTree>& tree) {
  const auto contacts = std::make_shared<std::vector<MeshContact>>();
  registerRuns("Contacts/" + set, kRuns, [=, &scene](Numbers& numbers) {
    const FiberArrays<double> arrays = scene.arrays(roots);
    const double taken = seconds([&] { tree->find(Contacts{arrays}, scene.mesh, *contacts); });
    numbers["contacts"] = static_cast<double>(contacts->size());
    return taken;
  });
}

bool measureObstacles(const Request& request) {
  tools::progress(request.scene.text + ": make the scene");
  HeadScene scene(request);
  scene.objects.bringTo(0, Boxes::kTight);
  scene.object.computeAABB();
  const Contender fcl = fastestTree(scene);
  std::vector<Finder> peers;
  for (const bool roots : {true, false}) peers.push_back(byFcl(fcl, scene, roots));

  // Ours would take the tight boxes for what a program has made of FCL's.
  scene.objects.bringTo(0, Boxes::kNone);
  bool right = true;
  for (const bool roots : {true, false}) {
    const std::string set = roots ? "all segments" : "without roots";
    const auto tree = makeTree(scene.arrays(roots), {touchingOptions()});
    const std::vector<Finder> finders = {byArrays("arrays", tree, scene.mesh, rest()),
                                         byArrays("turned", tree, scene.turned, rotation()),
                                         byManager(scene, roots), peers[roots ? 0 : 1]};
    right = registerTouching(scene, set, finders) && right;
    registerContacts(scene, set, roots, tree);
  }
  registerBoxes(scene);
  registerRefit(scene);
  return runRegistered() && right;
}

const AddMeasure kMeasure("obstacles", measureObstacles);

}  // namespace

}  // namespace fcl_fibers::benchmarks
