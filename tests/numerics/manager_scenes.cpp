// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/manager_scenes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/mesh_models.h"

namespace fcl_fibers::test {
namespace {

std::shared_ptr<fcl::CollisionGeometryd> geometryOf(const ThingShape& shape,
                                                    const std::vector<Eigen::Vector3d>& points,
                                                    double radius) {
  switch (shape.kind) {
    case ThingKind::kCapsule: {
      const double length = (points[1] - points[0]).norm();
      if (length > 0) return std::make_shared<fcl::Capsuled>(radius, length);
      return std::make_shared<fcl::Sphered>(radius);
    }
    case ThingKind::kMesh:
      return makeModel<double>(fcl::BV_OBBRSS, {points, shape.triangles});
    case ThingKind::kBox:
      return std::make_shared<fcl::Boxd>(2 * shape.half);
    default:
      return std::make_shared<fcl::Halfspaced>(fcl::Vector3d::UnitZ(), 0);
  }
}

template <class T>
std::vector<fcl::CollisionObjectd*> objects(const std::vector<T*>& things) {
  return {things.begin(), things.end()};
}

bool isWatertight(const ThingShape& shape) { return shape.triangles.size() >= 4; }

}  // namespace

// --- Objects ---

Thing::Thing(std::size_t number, ThingShape shape, std::vector<Eigen::Vector3d> points,
             double radius, double margin)
    : fcl::CollisionObjectd(geometryOf(shape, points, radius)),
      number_(number),
      shape_(std::move(shape)),
      points_(std::move(points)),
      radius_(radius),
      margin_(margin) {
  readBox();
}

void Thing::readBox() {
  computeAABB();
  aabb.min_.array() -= margin_;
  aabb.max_.array() += margin_;
}

void Thing::place(const Eigen::Isometry3d& pose) {
  setTransform(pose);
  readBox();
}

void Thing::deform(const Eigen::Matrix3d& by) {
  for (Eigen::Vector3d& p : points_) p = by * p;
  movePoints<double>(*cgeom, [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return by * p; });
  is_deformed_ = true;
  readBox();
}

void Thing::setRadius(double radius) {
  radius_ = radius;
  if (isSegment()) {
    static_cast<fcl::Capsuled&>(*cgeom).radius = radius;
  } else {
    static_cast<fcl::Sphered&>(*cgeom).radius = radius;
  }
  cgeom->computeLocalAABB();
  readBox();
}

std::unique_ptr<Thing> Thing::copy(std::size_t number) const {
  auto made = std::make_unique<Thing>(number, shape_, points_, radius_, margin_);
  made->place(Eigen::Isometry3d(getTransform().matrix()));
  made->is_rigid_ = is_rigid_;  // a clone has the promises of its original
  return made;
}

Instant Thing::now() const {
  Instant now;
  now.axes = getTransform().linear();
  now.radius = radius_;
  now.margin = margin_;
  for (const Eigen::Vector3d& p : points_) {
    now.points.push_back(getTransform() * p);
    now.around.extend(now.points.back());
  }
  return now;
}

// --- Managers ---

ModelledManager::ModelledManager(const FiberManagerOptions& options, bool of_spheres)
    : options_(options), of_spheres_(of_spheres) {
  if (of_spheres) {
    manager_ = std::make_unique<WrappedSphereTreeCollisionManagerd>(options);
  } else {
    manager_ = std::make_unique<LayeredAABBTreeCollisionManagerd>(options);
  }
}

const Member* ModelledManager::find(const Thing* thing) const {
  const auto is = [thing](const Member& member) { return member.thing == thing; };
  const auto found = std::find_if(members_.begin(), members_.end(), is);
  return found == members_.end() ? nullptr : &*found;
}

void ModelledManager::add(Thing* thing, Member member) {
  member.thing = thing;
  member.start = member.end = thing->now();
  members_.push_back(std::move(member));
}

void ModelledManager::registerFiber(const std::vector<Thing*>& things, FiberEnds ends, int group,
                                    const FiberObstacles& obstacles) {
  manager_->registerFiber(objects(things), ends, FiberGroup{group}, obstacles);
  Member member{};
  member.fiber = fibers_++;
  member.fiber_size = static_cast<int>(things.size());
  member.group = group;
  member.is_closed = ends == FiberEnds::kClosed;
  double length = 0;
  for (Thing* thing : things) {
    member.party = {false,
                    member.segment < obstacles.root_segments || length < obstacles.root_length,
                    obstacles.meets};
    length += static_cast<const fcl::Capsuled&>(*thing->collisionGeometry()).lz;
    add(thing, member);
    ++member.segment;
  }
}

void ModelledManager::registerObstacle(Thing* thing, const ObstacleOptions& options) {
  manager_->registerObstacle(thing, options);
  Member member{};
  member.party.bits = options.categories;
  member.is_solid = options.solid;
  add(thing, member);
}

void ModelledManager::registerObjects(const std::vector<Thing*>& things) {
  if (things.size() == 1) {
    manager_->registerObject(things[0]);
  } else {
    manager_->registerObjects(objects(things));
  }
  for (Thing* thing : things) add(thing, {});
}

void ModelledManager::unregister(const Thing* thing) {
  const Member* member = find(thing);
  manager_->unregisterObject(member->thing);
  members_.erase(members_.begin() + (member - members_.data()));
}

void ModelledManager::becomeClone(const std::vector<Thing*>& things) {
  if (of_spheres_) {
    manager_ =
        static_cast<const WrappedSphereTreeCollisionManagerd&>(*manager_).clone(objects(things));
  } else {
    manager_ =
        static_cast<const LayeredAABBTreeCollisionManagerd&>(*manager_).clone(objects(things));
  }
  has_step_ = step_is_seen_ = false;
  for (std::size_t i = 0; i < things.size(); ++i) {
    members_[i].thing = things[i];
    members_[i].start = members_[i].end = things[i]->now();
  }
  was_cloned = true;
}

std::vector<Thing*> ModelledManager::membersOf(const std::vector<Thing*>& things) const {
  std::vector<Thing*> members;
  for (Thing* thing : things) {
    if (find(thing) != nullptr) members.push_back(thing);
  }
  return members;
}

void ModelledManager::beginStep() {
  if (!std::exchange(step_is_seen_, false) || !options_.motion) return;
  manager_->beginStep();
  has_step_ = true;
  for (Member& member : members_) member.start = member.end;
}

void ModelledManager::readEnds() {
  for (Member& member : members_) member.end = member.thing->now();
}

void ModelledManager::update(const std::vector<Thing*>& moved, Random& random) {
  std::vector<Thing*> list = membersOf(moved);
  const std::size_t form = random.below(3);
  if (form == 0) {
    manager_->update();
  } else if (!list.empty()) {
    if (form == 1) {
      // Objects that are repeated or are not managed do no harm.
      list.push_back(list.front());
      list.push_back(moved.front());
      manager_->update(objects(list));
    } else {
      for (Thing* thing : list) manager_->update(thing);
    }
  }
  readEnds();
}

void ModelledManager::failToUpdate(const std::vector<Thing*>& moved, Random& random) {
  const auto isRefused = [](const auto& call) {
    try {
      call();
    } catch (const std::invalid_argument&) {
      return true;
    }
    return false;
  };
  has_failed = true;
  const bool all = random.below(2) == 0;
  if (!isRefused([&] { all ? manager_->update() : manager_->update(objects(membersOf(moved))); })) {
    throw std::logic_error("an update takes a pose that is not finite");
  }
  const auto ignore = [](fcl::CollisionObjectd*, fcl::CollisionObjectd*, void*) { return true; };
  if (!isRefused([&] { manager_->collide(nullptr, ignore); })) {
    throw std::logic_error("a query answers after an update that failed");
  }
}

bool ModelledManager::tellsMargins() const {
  return std::all_of(members_.begin(), members_.end(), [&](const Member& member) {
    const double size = member.end.points[0].norm() + member.end.radius + member.end.margin;
    return std::fabs(manager_->margin(member.thing) - member.end.margin) <= 1e-9 * size;
  });
}

void ModelledManager::repair(bool by_setup) {
  by_setup ? manager_->setup() : manager_->update();
  readEnds();
}

// --- Scenes ---

ManagerScene::ManagerScene(Random random, int threads) : random_(std::move(random)) {
  if (chance(0.2)) size_ = std::pow(10.0, static_cast<double>(random_.below(17)) - 8);
  spread_ = size_ * random_.between(0.25, 0.8);
  mobility_ = random_.between(0.2, 1);
  deforming_ = chance(0.7) ? 0.8 : 0;
  widened_ = chance(0.3) ? 0.3 : 0;

  const auto margin = [&] { return chance(0.3) ? 0 : size_ * random_.between(0, 0.3); };
  double margins[2] = {margin(), margin()};
  const std::size_t kind = random_.below(16);
  if (kind < 3) margins[0] = margins[1] = kind == 0 ? margins[1] : 0;
  if (kind == 3) {
    const double exponent = chance(0.5) ? 294 : 3 + static_cast<double>(random_.below(20));
    margins[random_.below(2)] = size_ * std::pow(10, exponent);
  }
  for (const double m : margins) {
    FiberManagerOptions options;
    options.margin = m;
    options.threads = threads;
    options.motion = chance(0.5);
    if (options.motion || chance(0.5)) options.report = Report::kCapsules;
    if (chance(0.3)) options.topology = Topology::kSuperThread;
    options.ignored_neighbors = static_cast<int>(random_.below(3));
    const bool spheres = !options.motion && chance(0.4);
    if (options.report == Report::kCapsules && !options.motion && !spheres) {
      // Of no number of its own, so that the other scenes stay what they are.
      const double skins[] = {0, -1, 0.1 * size_};
      options.skin = skins[options.ignored_neighbors];
    }
    managers_.emplace_back(options, spheres);
  }

  const std::size_t count = 4 + random_.below(chance(0.1) ? 50 : 20);
  while (things_.size() < count) enroll(managers_[random_.below(2)], addSome());
  if (chance(0.6)) {
    for (std::size_t i = 0; i < 2; ++i) {
      std::vector<Thing*> shared;
      for (const Member& member : managers_[i].members()) {
        if (managers_[1 - i].find(member.thing) == nullptr && chance(0.3)) {
          shared.push_back(member.thing);
        }
      }
      enroll(managers_[1 - i], shared);
    }
  }
  for (std::size_t i = random_.below(3); i > 0; --i) addSome();
}

Eigen::Isometry3d ManagerScene::somePose() {
  Eigen::Isometry3d pose(random_.rotation());
  if (chance(0.1)) pose.setIdentity();
  pose.translation() = random_.inCube(spread_);
  return pose;
}

Thing* ManagerScene::add(ThingShape shape, std::vector<Eigen::Vector3d> points, double radius) {
  const bool may_widen = shape.kind == ThingKind::kCapsule || shape.kind == ThingKind::kMesh;
  const double margin = may_widen && chance(widened_) ? size_ * random_.between(0, 0.1) : 0;
  things_.push_back(
      std::make_unique<Thing>(things_.size(), std::move(shape), std::move(points), radius, margin));
  things_.back()->place(somePose());
  return things_.back().get();
}

Thing* ManagerScene::addCapsule(double length, double radius) {
  const Eigen::Vector3d half(0, 0, length / 2);
  return add({}, {-half, half}, radius);
}

Thing* ManagerScene::addMesh() {
  ThingShape shape;
  shape.kind = ThingKind::kMesh;
  std::vector<Eigen::Vector3d> points;
  const double size = size_ * random_.between(0.1, 0.6);
  if (chance(0.2)) {
    // A sheet.
    for (int i = 0; i < 4; ++i) points.push_back(random_.inCube(size));
    shape.triangles = {{0, 1, 2}};
    if (chance(0.5)) shape.triangles.push_back({2, 1, 3});
  } else {
    // Octahedra, and prisms with tips.
    const std::size_t around = 3 + random_.below(2), rows = 2 + random_.below(2);
    MeshShape closed = blob(1, 0, around, rows);
    const Eigen::Vector3d sides = Eigen::Vector3d::Constant(0.7) + random_.inCube(0.3);
    for (const Eigen::Vector3d& p : closed.points) points.push_back(size * p.cwiseProduct(sides));
    shape.triangles = std::move(closed.triangles);
  }
  return add(std::move(shape), std::move(points), 0);
}

Thing* ManagerScene::addHalfspace() {
  ThingShape shape;
  shape.kind = ThingKind::kHalfspace;
  return add(shape, {Eigen::Vector3d::Zero()}, 0);
}

/// A fiber, or one object of another kind.
std::vector<Thing*> ManagerScene::addSome() {
  const std::size_t kind = random_.below(16);
  const double radius = chance(0.05) ? 0 : size_ * random_.between(0.01, 0.15);
  if (kind < 7) {
    std::vector<Thing*> fiber;
    const double length = size_ * random_.between(0.05, 0.4);
    Eigen::Isometry3d pose = somePose();
    for (std::size_t i = 1 + random_.below(5); i > 0; --i) {
      fiber.push_back(addCapsule(length, radius));
      fiber.back()->place(pose);
      pose.translate(Eigen::Vector3d(0, 0, length / 2));
      pose.rotate(random_.rotation(1.2));
      pose.translate(Eigen::Vector3d(0, 0, length / 2));
    }
    return fiber;
  }
  if (kind < 9) return {addCapsule(0, radius)};
  if (kind < 15 || chance(0.4)) return {addMesh()};
  if (!chance(0.6)) return {addHalfspace()};
  ThingShape box;
  box.kind = ThingKind::kBox;
  box.half = size_ * (random_.inCube(0.15).array() + 0.2).matrix();
  return {add(box, {Eigen::Vector3d::Zero()}, 0)};
}

/// Registers objects in any of the ways, the capsules among them as fibers.
void ManagerScene::enroll(ModelledManager& manager, const std::vector<Thing*>& things) {
  if (!things.empty() && chance(0.05)) return manager.registerObjects(things);
  const auto categories = [&] {
    return std::uint32_t{1} << random_.below(3) | std::uint32_t{1} << random_.below(3);
  };
  std::vector<Thing*> fiber;
  const auto registerFiber = [&] {
    if (fiber.empty()) return;
    FiberObstacles obstacles;
    if (chance(0.6)) obstacles.meets = categories();
    if (chance(0.4)) obstacles.root_segments = static_cast<int>(random_.below(4));
    if (chance(0.2)) obstacles.root_length = size_ * random_.between(0, 0.5);
    const FiberEnds ends = chance(0.2) ? FiberEnds::kClosed : FiberEnds::kOpen;
    const int group = static_cast<int>(random_.below(3));
    manager.registerFiber(fiber, ends, group, obstacles);
    fiber.clear();
  };
  for (Thing* thing : things) {
    if (thing->isSegment() && chance(0.9)) {
      fiber.push_back(thing);
      if (chance(0.1)) registerFiber();
    } else if (chance(0.8)) {
      ObstacleOptions options;
      if (chance(0.8)) options.categories = categories();
      options.solid = thing->isMesh() && isWatertight(thing->shape()) && chance(0.6);
      options.rigid = thing->isMesh() && chance(0.5);
      if (options.rigid) thing->promiseRigid();
      manager.registerObstacle(thing, options);
    } else {
      manager.registerObjects({thing});
    }
  }
  registerFiber();
}

void ManagerScene::comeAndGo(ModelledManager& manager) {
  manager.has_changed = true;
  for (std::size_t i = random_.below(4); i > 0 && manager.members().size() > 2; --i) {
    manager.unregister(manager.members()[random_.below(manager.members().size())].thing);
  }
  std::vector<Thing*> coming;
  for (const auto& thing : things_) {
    if (manager.find(thing.get()) == nullptr && chance(0.15)) coming.push_back(thing.get());
  }
  if (coming.empty()) coming = addSome();
  enroll(manager, coming);
}

/// As many come beside the tree as leave it standing, and some of these go before they are read.
void ManagerScene::comeAndGoUnread(ModelledManager& manager) {
  manager.has_changed = true;
  manager->setup();
  std::vector<Thing*> young;
  for (std::size_t i = (manager.members().size() + 2) / 8; i > 0; --i) {
    young.push_back(chance(0.7) ? addMesh() : addHalfspace());
    enroll(manager, {young.back()});
  }
  for (std::size_t i = 1 + random_.below(young.size() - 1); i > 0; --i) {
    const auto gone = young.begin() + static_cast<std::ptrdiff_t>(random_.below(young.size()));
    manager.unregister(*gone);
    young.erase(gone);
  }
}

void ManagerScene::clone(ModelledManager& manager) {
  std::vector<Thing*> members;
  for (const Member& member : manager.members()) members.push_back(member.thing);
  const double replaced = random_.unit();
  for (Thing*& thing : members) {
    if (!chance(replaced)) continue;
    things_.push_back(thing->copy(things_.size()));
    if (chance(0.5)) move(*things_.back());
    thing = things_.back().get();
  }
  manager.becomeClone(members);
}

void ManagerScene::move(Thing& thing) {
  if (chance(0.05)) return thing.place(somePose());
  Eigen::Isometry3d pose(thing.getTransform().matrix());
  if (chance(0.7)) pose.rotate(random_.rotation(0.8));
  pose.translation() = 0.9 * pose.translation() + random_.inCube(size_ * 0.6 * mobility_);
  thing.place(pose);
}

void ManagerScene::change() {
  std::vector<Thing*> moved;
  // An object starts where it is first read.
  for (ModelledManager& manager : managers_) {
    manager->setup();
    manager.beginStep();
  }
  for (std::size_t updates = chance(0.2) ? 2 : 1; updates > 0; --updates) {
    moved.clear();
    for (const auto& thing : things_) {
      if (thing->isMesh() && !thing->isRigid() && chance(deforming_)) {
        Eigen::Matrix3d by = Eigen::Matrix3d::Identity();
        for (int i = 0; i < 3; ++i) by.col(i) += random_.inCube(0.2);
        thing->deform(by);
      } else if (!chance(mobility_)) {
        continue;
      }
      move(*thing);
      if (thing->shape().kind == ThingKind::kCapsule && chance(0.1)) {
        thing->setRadius(size_ * random_.between(0.01, 0.15));
      }
      moved.push_back(thing.get());
    }
    Thing* broken = nullptr;
    if (chance(0.25) && !moved.empty()) {
      broken = moved[random_.below(moved.size())];
      const Eigen::Isometry3d pose(broken->getTransform().matrix());
      Eigen::Isometry3d no_pose = pose;
      no_pose.translation()[1] = std::numeric_limits<double>::quiet_NaN();
      broken->setTransform(no_pose);
      for (ModelledManager& manager : managers_) {
        if (manager.find(broken) == nullptr) continue;
        manager.failToUpdate(moved, random_);
      }
      broken->place(pose);
    }
    for (ModelledManager& manager : managers_) {
      if (broken != nullptr && manager.find(broken) != nullptr) {
        manager.repair(chance(0.5));
      } else {
        manager.update(moved, random_);
      }
    }
  }
  for (ModelledManager& manager : managers_) {
    if (!manager.tellsMargins()) throw std::logic_error("a margin is not what a box has more");
    if (chance(0.3)) comeAndGo(manager);
    if (manager.members().size() >= 14 && chance(0.3)) comeAndGoUnread(manager);
    if (chance(0.2)) clone(manager);
    if (chance(0.5)) manager->setup();
  }
}

}  // namespace fcl_fibers::test
