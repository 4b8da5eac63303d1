// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "harness/runs.h"
#include "measures.h"
#include "measures/boxed_object.h"
#include "measures/meshes.h"
#include "scenes/ball.h"
#include "scenes/random.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

using Geometry = std::shared_ptr<fcl::CollisionGeometryd>;
using Poses = std::vector<fcl::Transform3d>;

constexpr int kRuns = 25;
constexpr std::size_t kPoses = 1000, kLinks = 7, kCable = 300;
constexpr int kHullTriangles = 400, kMeshTriangles = 1344;  // 202 and 650 points

fcl::Vector3d anywhere(scenes::Random& random) {
  const double x = random.uniform() - 0.5, y = random.uniform() - 0.5;
  return {x, y, random.uniform() - 0.5};
}

fcl::Matrix3d turned(scenes::Random& random) {
  const fcl::Vector3d axis = anywhere(random).normalized();
  return fcl::AngleAxisd(6.283 * random.uniform(), axis).toRotationMatrix();
}

Geometry hullOf(const Point& radii) {
  const scenes::Triangles ball = scenes::makeBall(radii, kHullTriangles);
  auto points = std::make_shared<std::vector<fcl::Vector3d>>();
  for (const Point& point : ball.points) points->push_back(toVector(point));
  auto faces = std::make_shared<std::vector<int>>();
  for (std::size_t i = 0; i < ball.corners.size(); i += 3) {
    faces->insert(faces->end(), {3, ball.corners[i], ball.corners[i + 1], ball.corners[i + 2]});
  }
  return std::make_shared<fcl::Convexd>(points, static_cast<int>(ball.corners.size() / 3), faces);
}

Geometry meshOf(const Point& radii) { return modelOf(scenes::makeBall(radii, kMeshTriangles)); }

/// Objects in two groups, as a program for robots has them: those that rest, and those of which
/// each pose moves all. A pose is asked for the first hit that is allowed.
struct Cell {
  std::string name;
  double margin = 0;             ///< of the boxes of all objects, and within which a pair is a hit
  std::vector<Geometry> shapes;  ///< of the resting ones, then of the others
  Poses resting;
  std::vector<Poses> moving;  ///< by pose
  /// Of two that move, by their places, whether they may touch.
  std::function<bool(std::size_t, std::size_t)> is_ignored;
};

/// Seven joints, each of which turns about another axis than the one before. Angles are random, as
/// a planner tries them, or those of one motion.
std::vector<Poses> posesOfArm(scenes::Random& random, bool is_motion) {
  std::vector<Poses> poses(kPoses);
  for (std::size_t i = 0; i < kPoses; ++i) {
    fcl::Transform3d joint = fcl::Transform3d::Identity();
    for (std::size_t link = 0; link < kLinks; ++link) {
      const fcl::Vector3d axis = link % 2 == 0 ? fcl::Vector3d::UnitZ() : fcl::Vector3d::UnitX();
      const double phase = 0.01 * static_cast<double>((link + 1) * i);
      const double angle = is_motion ? std::sin(phase) : 3 * random.uniform() - 1.5;
      joint.rotate(fcl::AngleAxisd(angle, axis));
      joint.translate(fcl::Vector3d(0, 0, 0.12));
      poses[i].push_back(joint);
      joint.translate(fcl::Vector3d(0, 0, 0.12));
    }
  }
  return poses;
}

/// An arm among boxes, balls, cylinders and convex hulls.
Cell makeArm(const std::string& name, Geometry (*link)(const Point&), std::size_t obstacles) {
  constexpr double kReach = 3, kFree = 0.5;
  Cell cell;
  cell.name = name + " among " + std::to_string(obstacles);
  scenes::Random random(7);
  const std::array<Geometry, 4> kinds = {
      std::make_shared<fcl::Boxd>(0.1, 0.15, 0.2), std::make_shared<fcl::Sphered>(0.08),
      std::make_shared<fcl::Cylinderd>(0.06, 0.2), hullOf({0.1, 0.07, 0.05})};
  while (cell.resting.size() < obstacles) {
    fcl::Transform3d pose(fcl::Translation3d(kReach * anywhere(random)));
    pose.linear() = turned(random);
    if (pose.translation().norm() < kFree) continue;
    cell.shapes.push_back(kinds[cell.resting.size() % kinds.size()]);
    cell.resting.push_back(pose);
  }
  const Geometry shape = link({0.06, 0.06, 0.14});
  cell.shapes.insert(cell.shapes.end(), kLinks, shape);
  cell.moving = posesOfArm(random, /*is_motion=*/false);
  cell.is_ignored = [](std::size_t a, std::size_t b) { return (a < b ? b - a : a - b) <= 2; };
  return cell;
}

/// A cable that hangs about an arm. Capsules that follow each other along it may touch.
Cell makeCable(const std::string& name, Geometry (*link)(const Point&), double margin) {
  constexpr double kLength = 0.01;
  Cell cell;
  cell.name = "cable beside " + name;
  cell.margin = margin;
  scenes::Random random(11);
  cell.shapes.assign(kLinks, link({0.06, 0.06, 0.14}));
  cell.shapes.insert(cell.shapes.end(), kCable, std::make_shared<fcl::Capsuled>(0.005, kLength));
  cell.moving = posesOfArm(random, /*is_motion=*/true);
  for (std::size_t pose = 0; pose < kPoses; ++pose) {
    const double time = 0.02 * static_cast<double>(pose);
    fcl::Vector3d tip(0.3 * std::sin(0.7 * time), 0.3 * std::cos(0.9 * time), 0), way(0, 0, 1);
    for (std::size_t i = 0; i < kCable; ++i) {
      const double s = 0.05 * static_cast<double>(i);
      const fcl::Vector3d turn(std::sin(s + time), std::cos(1.3 * s - time), std::sin(0.6 * s));
      way = (way + 0.1 * turn).normalized();
      fcl::Transform3d capsule(fcl::Translation3d(tip + kLength / 2 * way));
      capsule.linear() =
          fcl::Quaterniond::FromTwoVectors(fcl::Vector3d::UnitZ(), way).toRotationMatrix();
      cell.moving[pose].push_back(capsule);
      tip += kLength * way;
    }
  }
  cell.is_ignored = [](std::size_t a, std::size_t b) {
    const std::size_t apart = a < b ? b - a : a - b;
    return std::max(a, b) < kLinks ? apart <= 2 : std::min(a, b) >= kLinks && apart <= 6;
  };
  return cell;
}

/// Which call tells a manager that the objects of one group have moved.
enum class Update { kListed, kAll };

/// The objects of a cell in a contender's managers.
class Program {
 public:
  Program(const Cell& cell, const Contender& contender, Update update)
      : cell_(cell), contender_(contender), update_(update) {
    const std::size_t resting = cell.resting.size();
    for (std::size_t i = 0; i < cell.shapes.size(); ++i) {
      const fcl::Transform3d& pose = i < resting ? cell.resting[i] : cell.moving[0][i - resting];
      owned_.push_back(std::make_unique<BoxedObject>(cell.shapes[i], pose));
      writeBox(*owned_.back());
      const std::uintptr_t place = i < resting ? 0 : i - resting + 1;
      owned_.back()->setUserData(reinterpret_cast<void*>(place));
      (i < resting ? rests_ : moves_).push_back(owned_.back().get());
      if (i >= resting) moving_objects_.push_back(owned_.back().get());
    }
    resting_ = contender.setUp(rests_);
    moving_ = contender.setUp(moves_);
  }

  void setPose(std::size_t pose) {
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      moves_[i]->setTransform(cell_.moving[pose][i]);
      writeBox(*moving_objects_[i]);
    }
    if (update_ == Update::kAll) {
      moving_->update();
    } else {
      moving_->update(moves_);
    }
  }

  /// Whether there is a hit.
  bool isHit() {
    is_hit_ = false;
    if (!rests_.empty()) resting_->collide(moving_.get(), this, callback);
    if (!is_hit_) moving_->collide(this, callback);
    return is_hit_;
  }

  std::size_t takePairs() { return std::exchange(pairs_, 0); }

 private:
  /// FCL's box of an object, or a tight one for FCL, widened as programs do that ask for a margin.
  void writeBox(BoxedObject& object) const {
    if (contender_.boxes == Boxes::kTight) {
      object.computeTightAABB();
    } else {
      object.computeAABB();
    }
    if (cell_.margin == 0) return;
    auto& box = const_cast<fcl::AABBd&>(object.getAABB());
    box.expand(fcl::Vector3d::Constant(cell_.margin / 2));
  }

  static bool callback(Object* a, Object* b, void* data) {
    return static_cast<Program*>(data)->test(*a, *b);
  }
  bool test(const Object& a, const Object& b) {
    ++pairs_;
    const auto i = reinterpret_cast<std::uintptr_t>(a.getUserData()),
               j = reinterpret_cast<std::uintptr_t>(b.getUserData());
    if (i != 0 && j != 0 && cell_.is_ignored(i - 1, j - 1)) return false;
    if (cell_.margin == 0) {
      fcl::CollisionResultd result;
      is_hit_ = fcl::collide(&a, &b, fcl::CollisionRequestd(), result) > 0;
    } else {
      fcl::DistanceResultd result;
      is_hit_ = fcl::distance(&a, &b, fcl::DistanceRequestd(), result) <= cell_.margin;
    }
    return is_hit_;
  }

  const Cell& cell_;
  const Contender& contender_;
  Update update_;
  std::vector<std::unique_ptr<BoxedObject>> owned_;
  std::vector<Object*> rests_, moves_;
  std::vector<BoxedObject*> moving_objects_;  ///< moves_
  std::unique_ptr<Manager> resting_, moving_;
  bool is_hit_ = false;
  std::size_t pairs_ = 0;
};

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A run is the median of its poses with a hit, and of those without. Whether there is one is the
/// same for all contenders, except where FCL's narrow phase depends on the order of a pair.
void registerCell(const std::shared_ptr<Cell>& cell,
                  const std::vector<std::pair<Contender, Update>>& contenders) {
  const auto expected = std::make_shared<std::vector<bool>>();
  for (const auto& [who, update] : contenders) {
    const Contender contender = who;
    const Update how = update;
    const std::string name =
        "Arms/" + cell->name + "/" + contender.name() + (how == Update::kAll ? "_update_all" : "");
    registerRuns(name, runsOf(contender.ours, kRuns), [=](Numbers& numbers) {
      Program program(*cell, contender, how);
      std::array<std::vector<double>, 2> times;  // without a hit, and with one
      std::vector<double> updates;
      std::vector<bool> hits;
      std::array<std::size_t, 2> pairs = {};
      for (std::size_t pose = 0; pose < kPoses; ++pose) {
        bool is_hit = false;
        double update = 0;
        const double taken = seconds([&] {
          update = seconds([&] { program.setPose(pose); });
          is_hit = program.isHit();
        });
        updates.push_back(update);
        times[is_hit ? 1 : 0].push_back(taken);
        pairs[is_hit ? 1 : 0] += program.takePairs();
        hits.push_back(is_hit);
      }
      if (expected->empty()) *expected = hits;
      std::size_t others = 0;
      for (std::size_t pose = 0; pose < kPoses; ++pose) others += hits[pose] != (*expected)[pose];
      if (others > kPoses / 100) {
        throw std::runtime_error(std::to_string(others) + " poses have another answer");
      }
      numbers["update"] = median(updates);
      numbers["hits"] = static_cast<double>(times[1].size());
      numbers["hit"] = median(times[1]);
      numbers["pairs_of_hit"] = static_cast<double>(pairs[1]) /
                                static_cast<double>(std::max<std::size_t>(times[1].size(), 1));
      numbers["pairs"] = static_cast<double>(pairs[0]) /
                         static_cast<double>(std::max<std::size_t>(times[0].size(), 1));
      return median(times[0]);
    });
  }
}

bool measureArms(const Request&) {
  tools::progress("arms: make the scenes");
  // Without the array form, which answers otherwise in a tenth of the poses of a cable.
  std::vector<Contender> managers = {allOf({Group::kFclTrees}, Boxes::kStock).front(),
                                     allOf({Group::kFclTrees}, Boxes::kTight).front()};
  managers.push_back(ourContender("LayeredAABBTree/boxes"));
  managers.push_back(ourContender("LayeredAABBTree/capsules"));
  // After update(list) FCL's tree takes objects out and inserts them again, after update() it
  // refits.
  std::vector<std::pair<Contender, Update>> contenders;
  for (const Contender& manager : managers) {
    contenders.emplace_back(manager, Update::kListed);
    contenders.emplace_back(manager, Update::kAll);
  }
  for (const Cell& cell :
       {makeArm("arm of hulls", hullOf, 30), makeArm("arm of hulls", hullOf, 100),
        makeArm("arm of meshes", meshOf, 30), makeCable("hulls, margin", hullOf, 0.02),
        makeCable("meshes, margin", meshOf, 0.02)}) {
    registerCell(std::make_shared<Cell>(cell), contenders);
  }
  return runRegistered();
}

const AddMeasure kMeasure("arms", measureArms);

}  // namespace

}  // namespace fcl_fibers::benchmarks
