// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>

#include "contenders/narrow_phase.h"
#include "harness/runs.h"
#include "measures.h"
#include "measures/loose_objects.h"
#include "measures/nearest.h"
#include "scenes/helix.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 15;
constexpr std::size_t kProbes = 100;
constexpr int kFrames = 4;

/// Ours, and FCL's two trees with each tree_init_level, on such boxes or on both kinds.
std::vector<Contender> contendersWith(std::optional<Boxes> fcl_boxes = {}) {
  std::vector<Contender> contenders = allOf({Group::kFclTuned}, fcl_boxes);
  contenders.push_back(ourContender("LayeredAABBTree/boxes"));
  return contenders;
}

MovingFibers helix(unsigned long long seed, double radius, double shift = 0) {
  scenes::HelixParameters parameters;
  parameters.seed = seed;
  parameters.radius = radius;
  FiberPolylines scene = scenes::makeHelix(parameters);
  for (Point& point : scene.points) point[0] += shift;
  return MovingFibers("helix", scene, scene);
}

/// The helix scene and others beside it. `thin` ones do not touch - the nearest are 2e-7 apart -,
/// so that distances have to be searched for: a search that may end at the first pair that touches
/// is a matter of luck.
struct Helices {
  static constexpr double kHair = scenes::HelixParameters().radius, kThin = 1e-8;
  MovingFibers hair = helix(1, kHair), other = helix(2, kHair);
  MovingFibers thin = helix(1, kThin), thin_other = helix(2, kThin);
  MovingFibers thin_apart = helix(2, kThin, 20);  // cm
};

/// Evenly spread objects: one-object queries are made with these.
std::vector<Object*> probesOf(const MovingFibers& fibers) {
  std::vector<Object*> chosen;
  const std::size_t stride = std::max<std::size_t>(1, fibers.segmentCount() / kProbes);
  for (std::size_t i = stride / 2; i < fibers.segmentCount(); i += stride) {
    chosen.push_back(fibers.objects()[i]);
  }
  return chosen;
}

/// A manager, its objects and, as the query needs them, objects or a manager of another scene.
struct Asked {
  Manager& manager;
  const std::vector<Object*>& objects;
  const std::vector<Object*>& probes;
  Manager* other;
};

// Each query returns its answer: a number of pairs, or a distance or a sum of these.

double distanceSelf(const Asked& asked) {
  Nearest nearest{scenes::HelixParameters().segments};
  asked.manager.distance(&nearest, Nearest::callback);
  return nearest.distance();
}

double distanceOfEach(const Asked& asked) {
  double sum = 0;
  for (Object* const object : asked.probes) {
    Nearest nearest;
    asked.manager.distance(object, &nearest, Nearest::callback);
    sum += nearest.distance();
  }
  return sum;
}

double distanceOfManagers(const Asked& asked) {
  Nearest nearest;
  asked.manager.distance(asked.other, &nearest, Nearest::callback);
  return nearest.distance();
}

double collideEach(const Asked& asked) {
  std::size_t count = 0;
  for (Object* const object : asked.probes) asked.manager.collide(object, &count, countPair);
  return static_cast<double>(count);
}

double collideManagers(const Asked& asked) {
  std::size_t count = 0;
  asked.manager.collide(asked.other, &count, countPair);
  return static_cast<double>(count);
}

double changeAndCollide(const Asked& asked) {
  Object* const one = asked.objects[asked.objects.size() / 2];
  asked.manager.unregisterObject(one);
  asked.manager.setup();
  const double without = collideEach(asked);
  asked.manager.registerObject(one);
  asked.manager.setup();
  return without + collideEach(asked);
}

enum class Needs { kNothing, kProbes, kOneProbe, kManager };

struct Query {
  std::string name;
  MovingFibers& first;
  MovingFibers& second;
  Needs needs;  ///< of the second
  double (*run)(const Asked&);
};

std::vector<Query> makeQueries(Helices& all) {
  return {
      {"distance, self", all.thin, all.thin, Needs::kNothing, distanceSelf},
      {"distance, one object inside", all.thin, all.thin_other, Needs::kProbes, distanceOfEach},
      {"distance, one object 20 cm away", all.thin, all.thin_apart, Needs::kProbes, distanceOfEach},
      {"distance, two managers in one place", all.thin, all.thin_other, Needs::kManager,
       distanceOfManagers},
      {"distance, two managers 20 cm apart", all.thin, all.thin_apart, Needs::kManager,
       distanceOfManagers},
      {"collide, one object", all.hair, all.other, Needs::kProbes, collideEach},
      {"collide, two managers", all.hair, all.other, Needs::kManager, collideManagers},
      {"unregister one, query, register it, query", all.hair, all.other, Needs::kOneProbe,
       changeAndCollide}};
}

/// Seconds of writing the box of a queried object, which FCL reads where ours reads the pose.
double writeBoxes(const Contender& contender, const std::vector<Object*>& probes) {
  if (contender.ours) return 0;
  const double taken = seconds([&] {
    for (Object* const object : probes) static_cast<CapsuleObject*>(object)->computeTightAABB();
  });
  return taken / static_cast<double>(probes.size());
}

void registerQuery(const Query& query, const Contender& contender) {
  const std::string name = "Query/" + query.name + "/" + contender.name();
  registerRuns(name, runsOf(contender.ours, kRuns), [&](Numbers& numbers) {
    // The boxes of a queried object are what FCL reads, as the managers' are.
    query.first.bringTo(0, contender.boxes);
    query.second.bringTo(0, contender.boxes);
    const auto manager = contender.setUp(query.first.objects());
    std::unique_ptr<Manager> other;
    if (query.needs == Needs::kManager) other = contender.setUp(query.second.objects());
    std::vector<Object*> probes = probesOf(query.second);
    if (query.needs == Needs::kOneProbe) probes = {probes[probes.size() / 2]};
    if (query.needs == Needs::kProbes) numbers["boxes"] = writeBoxes(contender, probes);
    const Asked asked = {*manager, query.first.objects(), probes, other.get()};
    double answer = 0;
    // Repeated, because the first lookup of an object in our manager fills a table of all.
    const double taken = secondsOfCall([&] { answer = query.run(asked); });
    numbers["answer"] = answer;
    return query.needs == Needs::kProbes ? taken / static_cast<double>(probes.size()) : taken;
  });
}

void registerObjects(LooseObjects& loose, const Contender& contender) {
  const std::string name = "Objects/" + loose.name + "/" + contender.name();
  registerRuns(name, runsOf(contender.ours, kRuns), [&](Numbers& numbers) {
    loose.reset();
    numbers["boxes"] = seconds([&] { loose.computeBoxes(contender); });
    std::unique_ptr<Manager> manager;
    numbers["set_up"] = seconds([&] { manager = contender.setUp(loose.objects); });
    double update = 0, detection = 0;
    std::size_t pairs = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      if (contender.is_renewed && frame > 0) manager = contender.setUp(loose.objects);
      loose.setPoses(frame % 2 == 0 ? 1 : 0);
      update += seconds([&] {
        loose.computeBoxes(contender);
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

/// How many pairs the callback gets, and how many of them touch. Whoever reports fewer has the
/// tighter bounds, if as many touch.
void registerCandidates(LooseObjects& loose) {
  const auto count = [&](const Contender& contender, const std::string& name) {
    // Of all pairs.
    const auto manager = contender.setUp(loose.objects);
    const auto pairs = samplePairs(*manager, 0, 0);
    registerNumbers("Candidates/" + loose.name + "/" + name,
                    {{"pairs", static_cast<double>(pairs.of)},
                     {"touching", collide(*manager, pairs).touching}});
  };
  const Contender ours = ourContender("LayeredAABBTree/boxes");
  const Contender fcl = allOf({Group::kFclTuned}, Boxes::kStock).front();
  loose.reset();
  loose.setPoses(1);
  count(ours, "poses");
  loose.computeBoxes(fcl);
  count(ours, "boxes");
  count(fcl, "fcl");
}

bool measureQueries(const Request&) {
  tools::progress("queries: make the scenes");
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
  loose.emplace_back("rods", true, std::make_shared<fcl::Cylinderd>(0.01, 0.1));
  loose.emplace_back("long boxes", true, std::make_shared<fcl::Boxd>(0.02, 0.03, 0.1));
  loose.emplace_back("capsules", true, std::make_shared<fcl::Capsuled>(0.01, 0.1));
  const std::vector<Contender> loose_contenders = contendersWith();
  for (LooseObjects& objects : loose) {
    registerCandidates(objects);
    for (const Contender& contender : loose_contenders) registerObjects(objects, contender);
  }
  return runRegistered();
}

const AddMeasure kMeasure("queries", measureQueries);

}  // namespace

}  // namespace fcl_fibers::benchmarks
