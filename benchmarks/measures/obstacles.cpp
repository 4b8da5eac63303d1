// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
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

constexpr int kRuns = HeadScene::kRuns, kSlowRuns = 5, kTries = 2;
constexpr double kSlow = 1;  // seconds

/// Cubes of the head's pieces along its radius, of which the fastest go on.
constexpr std::array<double, 4> kPiecesOfRadius = {8, 16, 32, 64};
/// Ways of FCL are tried with every so many fibers.
constexpr std::size_t kTryPart = 4;

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

/// A callback that notes the objects which it meets beside the head, or beside a piece of it.
struct Noted {
  Segments& found;
  std::vector<bool> is_found = {};  ///< by segment, if there are several pieces
  std::size_t pairs = 0;

  static std::size_t hair(const Object* a, const Object* b) {
    return MovingFibers::index(a->getObjectType() == fcl::OT_BVH ? b : a);
  }
  static bool all(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Noted*>(data);
    self.found.push_back(hair(a, b));
    return false;
  }
  static bool colliding(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Noted*>(data);
    const std::size_t segment = hair(a, b);
    if (!self.is_found.empty() && self.is_found[segment]) return false;
    ++self.pairs;
    fcl::CollisionResultd result;
    fcl::collide(a, b, fcl::CollisionRequestd(), result);
    if (!result.isCollision()) return false;
    self.found.push_back(segment);
    if (!self.is_found.empty()) self.is_found[segment] = true;
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
            Noted noted{found};
            const double taken = seconds([&] {
              scene.object.setTransform(rest());
              manager->update(&scene.object);
              manager->collide(&noted, Noted::all);
            });
            return taken;
          }};
}

/// Of every `part`th fiber.
std::vector<Object*> objectsOf(const HeadScene& scene, bool roots, std::size_t part = 1) {
  std::vector<Object*> objects;
  const std::vector<MovingFibers::Fiber> fibers = scene.objects.fibers();
  for (std::size_t f = 0; f < fibers.size(); f += part) {
    const std::vector<Object*>& own = fibers[f].objects;
    objects.insert(objects.end(), own.begin() + (roots ? 0 : 1), own.end());
  }
  return objects;
}

/// How FCL gets the head, at rest at first.
struct HeadOfFcl {
  std::vector<std::shared_ptr<Object>> pieces;
  bool is_managed = false;  ///< Pieces are in a manager, and two managers are asked.

  std::string suffix() const {
    if (pieces.size() == 1) return "";
    return "_" + std::to_string(pieces.size()) + "_pieces" + (is_managed ? "_in_a_manager" : "");
  }
};

/// In pieces of each size, asked for one by one and as a manager. The box of the whole head meets
/// hair that is nowhere near its surface.
std::vector<HeadOfFcl> headsInPieces(const HeadScene& scene) {
  std::vector<HeadOfFcl> heads;
  for (const double of_radius : kPiecesOfRadius) {
    HeadOfFcl head;
    for (const scenes::Triangles& piece : piecesOf(scene.head, scenes::kHeadRadius / of_radius)) {
      head.pieces.push_back(std::make_shared<Object>(modelOf<fcl::OBBd>(piece), rest()));
    }
    heads.push_back(head);
    head.is_managed = true;
    heads.push_back(std::move(head));
  }
  return heads;
}

/// The queries of the head's pieces, and fcl::collide on each of their pairs with hair that touches
/// no piece before.
/// @pre all objects have tight boxes
Finder byFcl(const Contender& tree, const HeadScene& scene, const std::vector<Object*>& hair,
             const HeadOfFcl& head) {
  std::vector<Object*> pieces;
  for (const auto& piece : head.pieces) pieces.push_back(piece.get());
  const std::shared_ptr<Manager> manager = tree.setUp(hair);
  const std::shared_ptr<Manager> others = head.is_managed ? tree.setUp(pieces) : nullptr;
  const std::size_t flags = pieces.size() == 1 ? 0 : scene.hair.segmentCount();
  const auto place = [=](const fcl::Transform3d& pose) {
    for (Object* const piece : pieces) {
      piece->setTransform(pose);
      piece->computeAABB();
    }
    if (others) others->update();
  };
  return {tree.name() + head.suffix(), false,
          [=, owned = head.pieces](Segments& found, Numbers& numbers) {
            found.clear();
            place(before());
            Noted noted{found, std::vector<bool>(flags)};
            const double taken = seconds([&] {
              place(rest());
              if (others) {
                manager->collide(others.get(), &noted, Noted::colliding);
                return;
              }
              for (Object* const piece : pieces) {
                manager->collide(piece, &noted, Noted::colliding);
              }
            });
            numbers["pairs"] = static_cast<double>(noted.pairs);
            return taken;
          }};
}

/// A tree of FCL's, and how it gets the head.
struct WayOfFcl {
  Contender tree;
  HeadOfFcl head;
};

/// Who is the fastest with a part of the hair.
WayOfFcl fastest(const HeadScene& scene, bool roots, const std::vector<WayOfFcl>& ways) {
  const std::vector<Object*> some = objectsOf(scene, roots, kTryPart);
  const WayOfFcl* fastest = nullptr;
  double least = 0;
  for (const WayOfFcl& way : ways) {
    const Finder finder = byFcl(way.tree, scene, some, way.head);
    tools::progress("obstacles: try " + finder.name);
    Segments found;
    Numbers numbers;
    double taken = finder.find(found, numbers);
    for (int tries = 1; tries < kTries; ++tries) {
      taken = std::min(taken, finder.find(found, numbers));
    }
    if (fastest == nullptr || taken < least) {
      fastest = &way;
      least = taken;
    }
  }
  return *fastest;
}

/// The head as one object, and in pieces: with all trees, the pieces those that one tree finds
/// best.
std::vector<Finder> findersOfFcl(const HeadScene& scene, bool roots,
                                 const std::vector<HeadOfFcl>& in_pieces, const HeadOfFcl& whole) {
  const std::vector<Contender> trees = allOf({Group::kFclTuned}, Boxes::kTight);
  const auto withAllTrees = [&](const HeadOfFcl& head) {
    std::vector<WayOfFcl> ways;
    for (const Contender& tree : trees) ways.push_back({tree, head});
    return fastest(scene, roots, ways);
  };
  std::vector<WayOfFcl> ways;
  for (const HeadOfFcl& head : in_pieces) ways.push_back({trees.front(), head});
  std::vector<Finder> found;
  for (const WayOfFcl& way :
       {withAllTrees(whole), withAllTrees(fastest(scene, roots, ways).head)}) {
    found.push_back(byFcl(way.tree, scene, objectsOf(scene, roots), way.head));
  }
  return found;
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
    if (!finder.ours && checked.empty()) {
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
  const std::vector<HeadOfFcl> in_pieces = headsInPieces(scene);
  const HeadOfFcl whole = {{std::shared_ptr<Object>(&scene.object, [](Object*) {})}};
  std::array<std::vector<Finder>, 2> peers;
  for (const bool roots : {true, false}) {
    peers[roots ? 0 : 1] = findersOfFcl(scene, roots, in_pieces, whole);
  }

  // Ours would take the tight boxes for what a program has made of FCL's.
  scene.objects.bringTo(0, Boxes::kNone);
  bool right = true;
  for (const bool roots : {true, false}) {
    const std::string set = roots ? "all segments" : "without roots";
    const auto tree = makeTree(scene.arrays(roots), {touchingOptions()});
    std::vector<Finder> finders = {byArrays("arrays", tree, scene.mesh, rest()),
                                   byArrays("turned", tree, scene.turned, rotation()),
                                   byManager(scene, roots)};
    const std::vector<Finder>& others = peers[roots ? 0 : 1];
    finders.insert(finders.end(), others.begin(), others.end());
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
