// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contenders/narrow_phase.h"
#include "harness/runs.h"
#include "judge/preflight.h"
#include "measures.h"
#include "measures/nearest.h"
#include "scenes/cap.h"
#include "scenes/helix.h"
#include "scenes/random.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 25;
constexpr std::size_t kLinksOfRod = 100;
constexpr double kLinkPerRadius = 10, kThinLinkPerRadius = 1e8;  // thin rods do not touch

fcl::Vector3d deviate(scenes::Random& random) {
  const double x = random.normal(), y = random.normal();
  return {x, y, random.normal()};
}

Point toPoint(const fcl::Vector3d& x) { return {x.x(), x.y(), x.z()}; }

/// Rods of at most 100 links that wander through the unit cube, and where they are after a small
/// motion. A link is of 0.5 / cbrt(links): at any number of links a few percent of them touch one
/// that is no neighbour.
MovingFibers makeRods(std::size_t links, std::uint64_t seed, double link_per_radius) {
  const double link = 0.5 / std::cbrt(static_cast<double>(links));
  std::array<FiberPolylines, 2> frames;
  frames[0].radius = frames[1].radius = link / link_per_radius;
  scenes::Random random(seed);
  for (std::size_t first = 0; first < links; first += kLinksOfRod) {
    fcl::Vector3d direction = deviate(random).normalized();
    const double x = random.uniform(), y = random.uniform();
    const fcl::Vector3d root(x, y, random.uniform());
    std::array<fcl::Vector3d, 2> tips = {root, root + 0.1 * link * deviate(random)};
    for (std::size_t i = first; i < std::min(first + kLinksOfRod, links); ++i) {
      direction = (direction + 0.4 * deviate(random)).normalized();
      for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(tips[0][axis] + link * direction[axis] - 0.5) > 0.5) direction[axis] *= -1;
      }
      for (std::size_t f = 0; f < 2; ++f) frames[f].points.push_back(toPoint(tips[f]));
      tips[0] += link * direction;
      tips[1] += link * (direction + 0.02 * deviate(random)).normalized();
    }
    for (std::size_t f = 0; f < 2; ++f) {
      frames[f].points.push_back(toPoint(tips[f]));
      frames[f].point_begin.push_back(frames[f].points.size());
    }
  }
  return MovingFibers("rods", frames[0], frames[1]);
}

struct Rods {
  explicit Rods(std::size_t links)
      : first(makeRods(links, 1, kLinkPerRadius)),
        second(makeRods(links, 3, kLinkPerRadius)),
        thin(makeRods(links, 1, kThinLinkPerRadius)) {}
  MovingFibers first, second, thin;
};

std::unique_ptr<Manager> setUpAtStart(const Contender& contender, MovingFibers& fibers) {
  contender.bringTo(fibers, 0);
  return contender.setUp(fibers.objects());
}

// Each measures the seconds of a call, and an answer that has to be the same for all contenders.

template <bool kCollides>
double updateRods(const Contender& contender, Rods& rods, double& answer) {
  auto manager = setUpAtStart(contender, rods.first);
  double sum = 0;
  int motions = 0;
  for (; sum < kSecondsOfRun || motions % 2 != 0; ++motions) {
    if (contender.is_renewed) manager = contender.setUp(rods.first.objects());
    rods.first.setPoses(1 - motions % 2);
    sum += seconds([&] {
      update(contender, rods.first, *manager);
      if (kCollides) countPairs(*manager);
    });
  }
  answer = collide(*manager, samplePairs(*manager, 0, 0)).touching;  // of all pairs
  return sum / motions;
}

double collideSelf(const Contender& contender, Rods& rods, double& answer) {
  const auto manager = setUpAtStart(contender, rods.first);
  std::size_t pairs = 0;
  const double taken = secondsOfCall([&] { pairs = countPairs(*manager).pairs; });
  answer = static_cast<double>(pairs);
  return taken;
}

double distanceSelf(const Contender& contender, Rods& rods, double& answer) {
  const auto manager = setUpAtStart(contender, rods.thin);
  return secondsOfCall([&] {
    Nearest nearest{kLinksOfRod};
    manager->distance(&nearest, Nearest::callback);
    answer = nearest.distance();
  });
}

double collideOther(const Contender& contender, Rods& rods, double& answer) {
  const auto manager = setUpAtStart(contender, rods.first);
  const auto other = setUpAtStart(contender, rods.second);
  std::size_t pairs = 0;
  const double taken = secondsOfCall([&] {
    pairs = 0;
    manager->collide(other.get(), &pairs, countPair);
  });
  answer = static_cast<double>(pairs);
  return taken;
}

/// Bounds are rounded outward, so that ours may report a few more pairs.
bool isSame(double answer, double expected) {
  const double more = expected < 1 ? 0 : 0.01 * expected + 1;  // less is a distance
  return answer >= (1 - 1e-6) * expected && answer <= (1 + 1e-6) * expected + more;
}

void expectSame(double answer, double expected) {
  if (isSame(answer, expected)) return;
  throw std::runtime_error("answers " + std::to_string(answer) + " instead of " +
                           std::to_string(expected));
}

using Call = double (*)(const Contender&, Rods&, double& answer);

void leaveOut(const std::string& what, const Contender& contender, const std::string& why) {
  registerNumbers("LeftOut/" + what + "/" + contender.name(), {}, why);
}

void registerCall(const std::string& what, Call call, Rods& rods,
                  const std::vector<Contender>& contenders) {
  double expected = 0;
  call(contenders.front(), rods, expected);
  for (const Contender& contender : contenders) {
    double checked = 0;
    call(contender, rods, checked);
    if (!contender.ours && !isSame(checked, expected)) {
      leaveOut(what, contender, "another answer");
      continue;
    }
    const auto run = [=, &rods](Numbers& numbers) {
      const double taken = call(contender, rods, numbers["answer"]);
      expectSame(numbers["answer"], expected);
      return taken;
    };
    registerRuns("Clients/" + what + "/" + contender.name(), runsOf(contender.ours, kRuns), run,
                 contender.ours);
  }
}

/// FCL's trees at each level, its other managers and ours, without those that crash, never end or
/// miss a pair.
std::vector<Contender> checkedContenders(Boxes boxes, Rods& rods, const std::string& size) {
  std::vector<Contender> right, all = allOf({Group::kFclTuned, Group::kFclOthers}, boxes);
  all.push_back(ourContender("LayeredAABBTree/boxes"));
  PreflightLimits limits;
  limits.phase_seconds = 1;
  const std::vector<Preflight> checked = preflightAll(all, rods.first, limits);
  if (!oursAreRight(all, checked)) throw std::logic_error("clients: ours is wrong");
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (checked[i].right()) {
      right.push_back(all[i]);
    } else {
      leaveOut(size, all[i], checked[i].note);
    }
  }
  return right;
}

/// Beside each contender that is renewed one that lives on: some of FCL's trees become slower with
/// every update, others are faster after the first.
void addLiving(std::vector<Contender>& contenders) {
  std::vector<Contender> living;
  for (const Contender& contender : contenders) {
    if (!contender.is_renewed) continue;
    living.push_back(contender);
    living.back().is_renewed = false;
    living.back().variant += "_living";
  }
  contenders.insert(contenders.end(), living.begin(), living.end());
}

void registerCalls(Rods& rods) {
  const std::string size = std::to_string(rods.first.segmentCount()) + " capsules";
  std::vector<Contender> tight = checkedContenders(Boxes::kTight, rods, size);
  registerCall(size + ", self-collision", collideSelf, rods, tight);
  registerCall(size + ", self-distance", distanceSelf, rods, tight);
  registerCall(size + ", collide another manager", collideOther, rods, tight);
  std::vector<Contender> stock = checkedContenders(Boxes::kStock, rods, size);
  stock.pop_back();  // ours, which has no such boxes, is among the others
  tight.insert(tight.end(), stock.begin(), stock.end());
  addLiving(tight);
  registerCall(size + ", update", updateRods<false>, rods, tight);
  registerCall(size + ", update + self-collision", updateRods<true>, rods, tight);
}

double countAll(const Manager& manager, std::size_t& pairs) {
  return seconds([&] { pairs = countPairs(manager).pairs; });
}

/// What a self-collision query takes that follows `registering` the others, "without" and then.
void registerYoung(const std::string& how, MovingFibers& fibers, std::vector<Object*> others,
                   void (*registering)(Manager&, const std::vector<Object*>&)) {
  const Contender ours = ourContender("LayeredAABBTree/boxes");
  const auto run = [=, &fibers](Numbers& numbers) {
    const auto manager = ours.setUp(fibers.objects());
    std::size_t pairs = 0, expected = 0;
    countAll(*manager, pairs);  // takes the memory of a query
    numbers["reference"] = countAll(*manager, pairs);
    registering(*manager, others);
    const double taken = countAll(*manager, pairs);
    std::vector<Object*> all = fibers.objects();
    all.insert(all.end(), others.begin(), others.end());
    countAll(*ours.setUp(all), expected);
    expectSame(static_cast<double>(pairs), static_cast<double>(expected));
    return taken;
  };
  registerRuns("Changes/" + std::to_string(others.size()) + " objects registered beside " +
                   std::to_string(fibers.segmentCount()) + ", " + how,
               kRuns, run);
}

/// What a self-collision query takes in the last frames of many in each of which some fibers change
/// places, beside that of a new manager of the same objects.
void registerSwapped(MovingFibers& fibers, std::size_t swapped) {
  constexpr int kFrames = 1000, kLast = 100;
  Contender ours = ourContender("LayeredAABBTree/boxes");
  ours.leaves_out_adjacent = true;  // registers fibers as fibers; by its options it leaves none out
  const auto run = [=, &fibers](Numbers& numbers) {
    fibers.setPoses(0);
    const auto manager = ours.setUp(fibers);
    std::vector<MovingFibers::Fiber> order = fibers.fibers();
    std::mt19937 random(1);
    double last = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      std::shuffle(order.begin(), order.end(), random);
      std::vector<Object*> moved;
      for (std::size_t f = 0; f < swapped; f += 2) {
        for (std::size_t i = 0; i < order[f].objects.size(); ++i) {
          Object *const a = order[f].objects[i], *const b = order[f + 1].objects[i];
          const fcl::Transform3d pose = a->getTransform();
          a->setTransform(b->getTransform());
          b->setTransform(pose);
          moved.insert(moved.end(), {a, b});
        }
      }
      manager->update(moved);
      std::size_t pairs = 0, expected = 0;
      const double taken = countAll(*manager, pairs);
      if (frame < kFrames - kLast) continue;
      const auto fresh = ours.setUp(fibers);
      countAll(*fresh, expected);  // takes the memory of a query
      numbers["reference"] += countAll(*fresh, expected) / kLast;
      expectSame(static_cast<double>(pairs), static_cast<double>(expected));
      last += taken / kLast;
    }
    return last;
  };
  registerRuns("Changes/" + std::to_string(swapped) + " of " + std::to_string(fibers.fiberCount()) +
                   " fibers change places, " + std::to_string(kFrames) + " times",
               kRuns, run);
}

MovingFibers standing(const FiberPolylines& scene) {
  return MovingFibers("standing", scene, scene);
}

bool measureClients(const Request&) {
  tools::progress("clients: make the scenes");
  std::vector<std::unique_ptr<Rods>> rods;
  for (const std::size_t links : {9u, 40u, 200u, 1000u}) {
    rods.push_back(std::make_unique<Rods>(links));
    registerCalls(*rods.back());
  }

  scenes::HelixParameters other;
  other.seed = 2;
  MovingFibers helix = standing(scenes::makeHelix({})), beside = standing(scenes::makeHelix(other));
  constexpr std::size_t kOthers = 400;
  std::vector<Object*> others;  // from everywhere
  for (std::size_t i = 0; i < kOthers; ++i) {
    others.push_back(beside.objects()[i * beside.segmentCount() / kOthers]);
  }
  registerYoung("one by one", helix, others, [](Manager& manager, const auto& objects) {
    for (Object* const object : objects) manager.registerObject(object);
  });
  registerYoung("in one call", helix, others,
                [](Manager& manager, const auto& objects) { manager.registerObjects(objects); });
  scenes::CapParameters few;  // far from each other, unlike those of a helix
  few.fibers = 100;
  MovingFibers cap = standing(scenes::makeCap(few));
  for (const std::size_t swapped : {2u, 20u}) registerSwapped(cap, swapped);
  return runRegistered();
}

const AddMeasure kMeasure("clients", measureClients);

}  // namespace

}  // namespace fcl_fibers::benchmarks
