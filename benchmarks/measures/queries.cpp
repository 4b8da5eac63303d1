// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/distance.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/scenes/helix.h>

#include "parts.h"
#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 5;
constexpr std::size_t kProbes = 100;
constexpr std::size_t kObjects = 10000;
constexpr int kFrames = 4;  // fewer than would slow FCL's trees

/// One way to make a manager.
struct Kind {
  std::string name;
  bool ours;
  Boxes boxes;
  std::function<std::unique_ptr<Manager>()> make;
};

template <typename FclTree>
std::unique_ptr<Manager> makeFclTree(int level) {
  auto tree = std::make_unique<FclTree>();
  tree->tree_init_level = level;
  return tree;
}

/// Ours, and FCL's two trees with each tree_init_level.
std::vector<Kind> makeKinds(Boxes fcl_boxes) {
  std::vector<Kind> kinds = {{"LayeredAABBTree/boxes", true, Boxes::kNone,
                              [] { return std::make_unique<LayeredAABBTreeCollisionManagerd>(); }}};
  constexpr int kLevels = 4;
  for (int level = 0; level < kLevels; ++level) {
    const std::string variant = std::string(fcl_boxes == Boxes::kTight ? "/tight" : "/stock") +
                                "_level_" + std::to_string(level);
    kinds.push_back({"DynamicAABBTree" + variant, false, fcl_boxes, [level] {
                       return makeFclTree<fcl::DynamicAABBTreeCollisionManagerd>(level);
                     }});
    kinds.push_back({"DynamicAABBTree_Array" + variant, false, fcl_boxes, [level] {
                       return makeFclTree<fcl::DynamicAABBTreeCollisionManager_Arrayd>(level);
                     }});
  }
  return kinds;
}

std::unique_ptr<Manager> setUp(const Kind& kind, const std::vector<Object*>& objects) {
  std::unique_ptr<Manager> manager = kind.make();
  manager->registerObjects(objects);
  manager->setup();
  return manager;
}

bool countPair(Object*, Object*, void* count) {
  ++*static_cast<std::size_t*>(count);
  return false;
}

/// The nearest pair so far. Adjacent segments, which always touch, are left out.
struct Nearest {
  std::size_t segments_per_fiber;  ///< 0: no pair is left out
  double distance = std::numeric_limits<double>::infinity();

  bool isAdjacent(const Object* a, const Object* b) const {
    if (segments_per_fiber == 0) return false;
    const std::size_t i = std::min(MovingFibers::index(a), MovingFibers::index(b));
    const std::size_t j = std::max(MovingFibers::index(a), MovingFibers::index(b));
    return j - i == 1 && j % segments_per_fiber != 0;
  }

  static bool callback(Object* a, Object* b, void* data, double& distance) {
    auto& nearest = *static_cast<Nearest*>(data);
    if (!nearest.isAdjacent(a, b)) {
      fcl::DistanceResultd result;
      nearest.distance =
          std::min(nearest.distance, fcl::distance(a, b, fcl::DistanceRequestd(), result));
    }
    distance = nearest.distance;
    return distance <= 0;
  }
};

scenes::FiberScene strand(const PartRequest& request, unsigned long long seed, double radius,
                          double shift) {
  scenes::HelixParameters parameters;
  if (request.fibers > 0) parameters.fibers = request.fibers;
  if (request.segments > 0) parameters.segments = request.segments;
  parameters.seed = seed;
  parameters.radius = radius;
  scenes::FiberScene scene = scenes::makeHelix(parameters);
  for (scenes::Point& point : scene.points) point[0] += shift;
  return scene;
}

/// The strand and others beside it. `thin` ones do not touch - the nearest are 2e-7 apart -, so
/// that distances have to be searched for: a search that may end at the first pair that touches is
/// a matter of luck.
struct Strands {
  static constexpr double kHair = scenes::HelixParameters().radius;
  static constexpr double kThin = 1e-8;
  static constexpr double kApart = 20;  ///< cm

  explicit Strands(const PartRequest& request)
      : hair(make(strand(request, request.seed, kHair, 0))),
        other(make(strand(request, request.seed + 1, kHair, 0))),
        thin(make(strand(request, request.seed, kThin, 0))),
        thin_other(make(strand(request, request.seed + 1, kThin, 0))),
        thin_apart(make(strand(request, request.seed + 1, kThin, kApart))) {}

  static MovingFibers make(const scenes::FiberScene& scene) {
    return MovingFibers("strand", scene, scene);
  }

  MovingFibers hair, other, thin, thin_other, thin_apart;
};

/// Every so-manieth object: one-object queries are made with these.
std::vector<Object*> probes(const MovingFibers& fibers) {
  std::vector<Object*> chosen;
  const std::size_t stride = std::max<std::size_t>(1, fibers.segmentCount() / kProbes);
  for (std::size_t i = stride / 2; i < fibers.segmentCount(); i += stride) {
    chosen.push_back(fibers.objects()[i]);
  }
  return chosen;
}

double collideEach(const Manager& manager, const std::vector<Object*>& objects) {
  std::size_t count = 0;
  for (Object* const object : objects) manager.collide(object, &count, countPair);
  return static_cast<double>(count);
}

/// The sum of the distances.
double distanceOfEach(const Manager& manager, const std::vector<Object*>& objects) {
  double sum = 0;
  for (Object* const object : objects) {
    Nearest nearest{0};
    manager.distance(object, &nearest, Nearest::callback);
    sum += nearest.distance;
  }
  return sum;
}

/// One query: its answer, of a manager over `first` and, where it needs them, `second`.
struct Query {
  std::string name;
  MovingFibers& first;
  MovingFibers& second;
  bool needs_second_manager;
  double times;  ///< that a run makes it
  std::function<double(Manager&, Manager*)> run;
};

std::vector<Query> makeQueries(Strands& strands) {
  const auto per_fiber = strands.thin.segmentCount() / strands.thin.fiberCount();
  const std::vector<Object*> hairs = probes(strands.other);
  const std::vector<Object*> thin = probes(strands.thin_other);
  const std::vector<Object*> apart = probes(strands.thin_apart);
  const auto distanceOf = [](Manager& manager, Manager* other) {
    Nearest nearest{0};
    manager.distance(other, &nearest, Nearest::callback);
    return nearest.distance;
  };
  return {
      {"distance, self", strands.thin, strands.thin, false, 1,
       [per_fiber](Manager& manager, Manager*) {
         Nearest nearest{per_fiber};
         manager.distance(&nearest, Nearest::callback);
         return nearest.distance;
       }},
      {"distance, one object inside", strands.thin, strands.thin_other, false,
       static_cast<double>(thin.size()),
       [thin](Manager& manager, Manager*) { return distanceOfEach(manager, thin); }},
      {"distance, one object 20 cm away", strands.thin, strands.thin_apart, false,
       static_cast<double>(apart.size()),
       [apart](Manager& manager, Manager*) { return distanceOfEach(manager, apart); }},
      {"distance, two managers in one place", strands.thin, strands.thin_other, true, 1,
       distanceOf},
      {"distance, two managers 20 cm apart", strands.thin, strands.thin_apart, true, 1, distanceOf},
      {"collide, one object", strands.hair, strands.other, false, static_cast<double>(hairs.size()),
       [hairs](Manager& manager, Manager*) { return collideEach(manager, hairs); }},
      {"collide, two managers", strands.hair, strands.other, true, 1,
       [](Manager& manager, Manager* other) {
         std::size_t count = 0;
         manager.collide(other, &count, countPair);
         return static_cast<double>(count);
       }},
      {"unregister one, query, register it, query", strands.hair, strands.other, false, 1,
       [hairs, &objects = strands.hair.objects()](Manager& manager, Manager*) {
         Object* const one = objects[objects.size() / 2];
         const std::vector<Object*> probe = {hairs[hairs.size() / 2]};
         manager.unregisterObject(one);
         manager.setup();
         double count = collideEach(manager, probe);
         manager.registerObject(one);
         manager.setup();
         count += collideEach(manager, probe);
         return count;
       }},
  };
}

void registerQuery(const Query& query, const Kind& kind) {
  const std::string name = "Query/" + query.name + "/" + kind.name;
  benchmark::RegisterBenchmark(
      name.c_str(),
      [&query, &kind, name](benchmark::State& state) {
        showProgress("time " + name);
        // The boxes of a queried object are what FCL reads, as the managers' are.
        query.first.bringTo(0, kind.boxes);
        query.second.bringTo(0, kind.boxes);
        const auto manager = setUp(kind, query.first.objects());
        const auto other =
            query.needs_second_manager ? setUp(kind, query.second.objects()) : nullptr;
        for ([[maybe_unused]] auto _ : state) {
          double answer = 0;
          const double taken = seconds([&] { answer = query.run(*manager, other.get()); });
          state.SetIterationTime(taken / query.times);
          state.counters["answer"] = answer;
        }
      })
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->Repetitions(kRuns);
}

using Geometry = std::shared_ptr<fcl::CollisionGeometryd>;

Geometry tetrahedron(double edge) {
  auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  const std::vector<fcl::Vector3d> corners = {{0, 0, 0}, {edge, 0, 0}, {0, edge, 0}, {0, 0, edge}};
  const std::vector<fcl::Triangle> faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  mesh->beginModel();
  mesh->addSubModel(corners, faces);
  mesh->endModel();
  return mesh;
}

/// Objects without any fiber, in a cube of edge 1, and two frames of their poses.
class LooseObjects {
 public:
  /// Ours takes bounds of spheres from their poses; other shapes count by their boxes.
  LooseObjects(std::string name, bool ours_reads_boxes, const Geometry& geometry)
      : name_(std::move(name)), ours_reads_boxes_(ours_reads_boxes) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(0, 1);
    std::uniform_real_distribution<double> step(-0.005, 0.005);
    const bool turned = ours_reads_boxes;  // a sphere stays as it is
    for (std::size_t i = 0; i < kObjects; ++i) {
      fcl::Transform3d pose = fcl::Transform3d::Identity();
      pose.translation() = fcl::Vector3d(place(random), place(random), place(random));
      if (turned) {
        const fcl::Vector3d axis(step(random), step(random), step(random));
        pose.linear() = fcl::AngleAxisd(6 * place(random), axis.normalized()).toRotationMatrix();
      }
      poses_[0].push_back(pose);
      pose.translation() += fcl::Vector3d(step(random), step(random), step(random));
      poses_[1].push_back(pose);
      objects_.push_back(std::make_unique<Object>(geometry, poses_[0].back()));
      pointers_.push_back(objects_.back().get());
    }
  }

  const std::string& name() const { return name_; }
  const std::vector<Object*>& objects() const { return pointers_; }

  void setPoses(std::size_t frame) {
    for (std::size_t i = 0; i < kObjects; ++i) pointers_[i]->setTransform(poses_[frame][i]);
  }

  void computeBoxes(const Kind& kind) {
    if (kind.ours && !ours_reads_boxes_) return;
    for (Object* const object : pointers_) object->computeAABB();
  }

 private:
  std::string name_;
  bool ours_reads_boxes_;
  std::array<std::vector<fcl::Transform3d>, 2> poses_;
  std::vector<std::unique_ptr<Object>> objects_;
  std::vector<Object*> pointers_;
};

void runFrames(benchmark::State& state, LooseObjects& objects, const Kind& kind) {
  objects.setPoses(0);
  objects.computeBoxes(kind);
  std::unique_ptr<Manager> manager;
  const double set_up = seconds([&] { manager = setUp(kind, objects.objects()); });
  double update = 0;
  double detection = 0;
  std::size_t pairs = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    objects.setPoses(frame % 2 == 0 ? 1 : 0);
    update += seconds([&] {
      objects.computeBoxes(kind);
      manager->update();
    });
    detection += seconds([&] { manager->collide(&pairs, countPair); });
  }
  state.SetIterationTime((update + detection) / kFrames);
  state.counters["set_up"] = set_up;
  state.counters["update"] = update / kFrames;
  state.counters["detection"] = detection / kFrames;
  state.counters["answer"] = static_cast<double>(pairs);
}

void registerObjects(LooseObjects& objects, const Kind& kind) {
  const std::string name = "Objects/" + objects.name() + "/" + kind.name;
  benchmark::RegisterBenchmark(name.c_str(),
                               [&objects, &kind, name](benchmark::State& state) {
                                 showProgress("time " + name);
                                 for ([[maybe_unused]] auto _ : state) {
                                   runFrames(state, objects, kind);
                                 }
                               })
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->Repetitions(2 * kRuns - 1);
}

}  // namespace

bool timeQueries(const PartRequest& request) {
  showProgress("queries: make the scenes");
  Strands strands(request);
  // With tight boxes, which leave less to FCL's queries than its own.
  const std::vector<Kind> kinds = makeKinds(Boxes::kTight);
  const std::vector<Query> queries = makeQueries(strands);
  for (const Query& query : queries) {
    for (const Kind& kind : kinds) registerQuery(query, kind);
  }

  std::vector<LooseObjects> loose;
  loose.emplace_back("spheres", false, std::make_shared<fcl::Sphered>(0.02));
  loose.emplace_back("boxes", true, std::make_shared<fcl::Boxd>(0.02, 0.03, 0.04));
  loose.emplace_back("meshes", true, tetrahedron(0.04));
  // Boxes of such objects are FCL's own, whoever reads them.
  const std::vector<Kind> loose_kinds = makeKinds(Boxes::kStock);
  for (LooseObjects& objects : loose) {
    for (const Kind& kind : loose_kinds) registerObjects(objects, kind);
  }
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
