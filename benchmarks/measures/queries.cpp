// SPDX-License-Identifier: BSD-3-Clause
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

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/distance.h>
#include <fcl_fibers/scenes/helix.h>

#include "harness/progress.h"
#include "harness/runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 5;
constexpr std::size_t kProbes = 100;
constexpr std::size_t kObjects = 10000;
constexpr int kFrames = 4;  // fewer than would slow FCL's trees

/// Ours, and FCL's two trees with each tree_init_level.
std::vector<Contender> contendersWith(Boxes fcl_boxes) {
  std::vector<Contender> contenders = fclTrees(fcl_boxes);
  contenders.push_back(ourContenders().front());
  return contenders;
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

scenes::FiberScene helix(unsigned long long seed, double radius, double shift) {
  scenes::HelixParameters parameters;
  parameters.seed = seed;
  parameters.radius = radius;
  scenes::FiberScene scene = scenes::makeHelix(parameters);
  for (scenes::Point& point : scene.points) point[0] += shift;
  return scene;
}

/// The helix scene and others beside it. `thin` ones do not touch - the nearest are 2e-7 apart -,
/// so that distances have to be searched for: a search that may end at the first pair that touches
/// is a matter of luck.
struct Helices {
  static constexpr double kHair = scenes::HelixParameters().radius;
  static constexpr double kThin = 1e-8;
  static constexpr double kApart = 20;  ///< cm

  Helices()
      : hair(make(helix(1, kHair, 0))),
        other(make(helix(2, kHair, 0))),
        thin(make(helix(1, kThin, 0))),
        thin_other(make(helix(2, kThin, 0))),
        thin_apart(make(helix(2, kThin, kApart))) {}

  static MovingFibers make(const scenes::FiberScene& scene) {
    return MovingFibers("helix", scene, scene);
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

std::vector<Query> makeQueries(Helices& helices) {
  const auto per_fiber = helices.thin.segmentCount() / helices.thin.fiberCount();
  const std::vector<Object*> hairs = probes(helices.other);
  const std::vector<Object*> thin = probes(helices.thin_other);
  const std::vector<Object*> apart = probes(helices.thin_apart);
  const auto distanceOf = [](Manager& manager, Manager* other) {
    Nearest nearest{0};
    manager.distance(other, &nearest, Nearest::callback);
    return nearest.distance;
  };
  return {
      {"distance, self", helices.thin, helices.thin, false, 1,
       [per_fiber](Manager& manager, Manager*) {
         Nearest nearest{per_fiber};
         manager.distance(&nearest, Nearest::callback);
         return nearest.distance;
       }},
      {"distance, one object inside", helices.thin, helices.thin_other, false,
       static_cast<double>(thin.size()),
       [thin](Manager& manager, Manager*) { return distanceOfEach(manager, thin); }},
      {"distance, one object 20 cm away", helices.thin, helices.thin_apart, false,
       static_cast<double>(apart.size()),
       [apart](Manager& manager, Manager*) { return distanceOfEach(manager, apart); }},
      {"distance, two managers in one place", helices.thin, helices.thin_other, true, 1,
       distanceOf},
      {"distance, two managers 20 cm apart", helices.thin, helices.thin_apart, true, 1, distanceOf},
      {"collide, one object", helices.hair, helices.other, false, static_cast<double>(hairs.size()),
       [hairs](Manager& manager, Manager*) { return collideEach(manager, hairs); }},
      {"collide, two managers", helices.hair, helices.other, true, 1,
       [](Manager& manager, Manager* other) {
         std::size_t count = 0;
         manager.collide(other, &count, countPair);
         return static_cast<double>(count);
       }},
      {"unregister one, query, register it, query", helices.hair, helices.other, false, 1,
       [hairs, &objects = helices.hair.objects()](Manager& manager, Manager*) {
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

void registerQuery(const Query& query, const Contender& contender) {
  registerRuns("Query/" + query.name + "/" + contender.name(), kRuns, [&](Numbers& numbers) {
    // The boxes of a queried object are what FCL reads, as the managers' are.
    query.first.bringTo(0, contender.boxes);
    query.second.bringTo(0, contender.boxes);
    const auto manager = contender.setUp(query.first.objects());
    const auto other =
        query.needs_second_manager ? contender.setUp(query.second.objects()) : nullptr;
    double answer = 0;
    const double taken = seconds([&] { answer = query.run(*manager, other.get()); });
    numbers["answer"] = answer;
    return taken / query.times;
  });
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

  void computeBoxes(const Contender& contender) {
    if (contender.ours && !ours_reads_boxes_) return;
    for (Object* const object : pointers_) object->computeAABB();
  }

 private:
  std::string name_;
  bool ours_reads_boxes_;
  std::array<std::vector<fcl::Transform3d>, 2> poses_;
  std::vector<std::unique_ptr<Object>> objects_;
  std::vector<Object*> pointers_;
};

void registerObjects(LooseObjects& objects, const Contender& contender) {
  const std::string name = "Objects/" + objects.name() + "/" + contender.name();
  registerRuns(name, 2 * kRuns - 1, [&](Numbers& numbers) {
    objects.setPoses(0);
    objects.computeBoxes(contender);
    std::unique_ptr<Manager> manager;
    numbers["set_up"] = seconds([&] { manager = contender.setUp(objects.objects()); });
    double update = 0;
    double detection = 0;
    std::size_t pairs = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      objects.setPoses(frame % 2 == 0 ? 1 : 0);
      update += seconds([&] {
        objects.computeBoxes(contender);
        manager->update();
      });
      detection += seconds([&] { manager->collide(&pairs, countPair); });
    }
    numbers["update"] = update / kFrames;
    numbers["detection"] = detection / kFrames;
    numbers["answer"] = static_cast<double>(pairs);
    return (update + detection) / kFrames;
  });
}

}  // namespace

bool measureQueries(const Request&) {
  showProgress("queries: make the scenes");
  Helices helices;
  // With tight boxes, which leave less to FCL's queries than its own.
  const std::vector<Contender> contenders = contendersWith(Boxes::kTight);
  const std::vector<Query> queries = makeQueries(helices);
  for (const Query& query : queries) {
    for (const Contender& contender : contenders) registerQuery(query, contender);
  }

  std::vector<LooseObjects> loose;
  loose.emplace_back("spheres", false, std::make_shared<fcl::Sphered>(0.02));
  loose.emplace_back("boxes", true, std::make_shared<fcl::Boxd>(0.02, 0.03, 0.04));
  loose.emplace_back("meshes", true, tetrahedron(0.04));
  // Boxes of such objects are FCL's own, whoever reads them.
  const std::vector<Contender> loose_contenders = contendersWith(Boxes::kStock);
  for (LooseObjects& objects : loose) {
    for (const Contender& contender : loose_contenders) registerObjects(objects, contender);
  }
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
