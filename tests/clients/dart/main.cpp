// SPDX-License-Identifier: BSD-3-Clause

// DART with the fiber managers in the place of FCL's dynamic tree: it builds a world of ropes that
// fall on each other, on posts and on the ground, and steps it. In each step the pairs of
// objects that touch are compared between FCL's tree and ours, and DART gets its contacts from one
// of ours. Exits with failure where a pair is missing, there twice or one too many, and where
// nothing has touched.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>
#include <dart/collision/fcl/fcl.hpp>
#include <dart/constraint/constraint.hpp>
#include <dart/dynamics/BallJoint.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/CapsuleShape.hpp>
#include <dart/dynamics/CylinderShape.hpp>
#include <dart/dynamics/EllipsoidShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/ShapeNode.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>

namespace {

using Object = fcl::CollisionObjectd;
using Pair = std::pair<Object*, Object*>;
using Pairs = std::vector<Pair>;

bool collect(Object* a, Object* b, void* pairs) {
  const auto [first, second] = std::minmax(a, b, std::less<>());
  static_cast<Pairs*>(pairs)->emplace_back(first, second);
  return false;
}

/// Of DART, which leaves itself in the user data.
std::string nameOf(const Object* object) {
  const auto* frame = static_cast<dart::collision::FCLCollisionObject*>(object->getUserData())
                          ->getShapeFrame()
                          ->asShapeNode();
  return frame->getSkeleton()->getName() + ", " + frame->getName();
}

/// The exact test of a pair is done once, whoever hands it over: FCL's may depend on the order of
/// its arguments.
class NarrowPhase {
 public:
  bool touch(const Pair& pair) {
    const auto [entry, is_new] = known_.emplace(pair, false);
    if (is_new) {
      fcl::CollisionResultd result;
      entry->second = fcl::collide(pair.first, pair.second, fcl::CollisionRequestd(), result) > 0;
    }
    return entry->second;
  }

 private:
  std::map<Pair, bool> known_;
};

/// What one manager has handed over.
struct Contender {
  const char* name;
  fcl::BroadPhaseCollisionManagerd* manager;
  std::size_t candidates = 0;

  /// In order, each once.
  Pairs touching(NarrowPhase& narrow_phase) {
    Pairs pairs;
    manager->collide(&pairs, collect);
    candidates += pairs.size();
    std::sort(pairs.begin(), pairs.end());
    const auto repeated = std::adjacent_find(pairs.begin(), pairs.end());
    if (repeated != pairs.end()) fail(*repeated, "reported twice");
    const auto apart = [&](const Pair& pair) { return !narrow_phase.touch(pair); };
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(), apart), pairs.end());
    return pairs;
  }

  void compare(const Pairs& touching, const Pairs& expected) const {
    const auto [ours, fcls] =
        std::mismatch(touching.begin(), touching.end(), expected.begin(), expected.end());
    if (ours == touching.end() && fcls == expected.end()) return;
    if (ours == touching.end() || (fcls != expected.end() && *fcls < *ours)) fail(*fcls, "missed");
    fail(*ours, "reported, unlike by FCL's tree");
  }

 private:
  [[noreturn]] void fail(const Pair& pair, const char* how) const {
    throw std::runtime_error(std::string(name) + ": " + how + ": " + nameOf(pair.first) + " and " +
                             nameOf(pair.second));
  }
};

fcl_fibers::FiberManagerOptions capsules() {
  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;
  return options;
}

/// What DART takes for FCL's dynamic tree. All calls go to FCL's tree and to ours.
class Managers final : public fcl::DynamicAABBTreeCollisionManagerd {
 public:
  void registerObject(Object* object) override {
    for (Contender& one : ours_) one.manager->registerObject(object);
    tree_.registerObject(object);
  }
  void unregisterObject(Object* object) override {
    for (Contender& one : ours_) one.manager->unregisterObject(object);
    tree_.unregisterObject(object);
  }
  void setup() override {
    for (Contender& one : ours_) one.manager->setup();
    tree_.setup();
  }
  void update() override {
    for (Contender& one : ours_) one.manager->update();
    tree_.update();
  }
  void clear() override {
    for (Contender& one : ours_) one.manager->clear();
    tree_.clear();
  }

  void collide(void* cdata, fcl::CollisionCallBack<double> callback) const override {
    NarrowPhase narrow_phase;
    const Pairs expected = fcls_.touching(narrow_phase);
    touching_ += expected.size();
    for (Contender& one : ours_) one.compare(one.touching(narrow_phase), expected);
    ours_[queries_++ % ours_.size()].manager->collide(cdata, callback);
  }

  void print() const {
    std::printf("%zu queries of %zu objects at the end, %zu pairs touch\n", queries_, tree_.size(),
                touching_);
    std::printf("%zu pairs handed over by %s\n", fcls_.candidates, fcls_.name);
    for (const Contender& one : ours_) {
      std::printf("%zu pairs handed over by %s\n", one.candidates, one.name);
    }
  }

 private:
  fcl::DynamicAABBTreeCollisionManagerd tree_;
  fcl_fibers::LayeredAABBTreeCollisionManagerd boxes_;
  fcl_fibers::LayeredAABBTreeCollisionManagerd boxes_of_capsules_{capsules()};
  fcl_fibers::WrappedSphereTreeCollisionManagerd spheres_;
  fcl_fibers::WrappedSphereTreeCollisionManagerd spheres_of_capsules_{capsules()};

  // DART's queries are const, and these count.
  mutable Contender fcls_ = {"FCL's dynamic tree", &tree_};
  mutable std::array<Contender, 4> ours_ = {
      Contender{"layered boxes, kVolumes", &boxes_},
      Contender{"layered boxes, kCapsules", &boxes_of_capsules_},
      Contender{"wrapped spheres, kVolumes", &spheres_},
      Contender{"wrapped spheres, kCapsules", &spheres_of_capsules_}};
  mutable std::size_t queries_ = 0;
  mutable std::size_t touching_ = 0;
};

class Group final : public dart::collision::FCLCollisionGroup {
 public:
  explicit Group(const dart::collision::CollisionDetectorPtr& detector)
      : FCLCollisionGroup(detector) {
    mBroadPhaseAlg = std::make_unique<Managers>();
  }
  const Managers& managers() const { return static_cast<const Managers&>(*mBroadPhaseAlg); }
};

/// DART's detector by itself refuses capsules, and puts a sphere of radius 0.1 in the place of
/// each.
class Detector final : public dart::collision::FCLCollisionDetector {
 public:
  Detector() { setPrimitiveShapeType(PRIMITIVE); }

  std::unique_ptr<dart::collision::CollisionGroup> createCollisionGroup() override {
    return std::make_unique<Group>(shared_from_this());
  }

 protected:
  std::unique_ptr<dart::collision::CollisionObject> createCollisionObject(
      const dart::dynamics::ShapeFrame* frame) override {
    const auto capsule =
        std::dynamic_pointer_cast<const dart::dynamics::CapsuleShape>(frame->getShape());
    if (!capsule) return FCLCollisionDetector::createCollisionObject(frame);
    return std::make_unique<CapsuleObject>(this, frame, *capsule);
  }

 private:
  struct CapsuleObject final : dart::collision::FCLCollisionObject {
    CapsuleObject(Detector* detector, const dart::dynamics::ShapeFrame* frame,
                  const dart::dynamics::CapsuleShape& shape)
        : FCLCollisionObject(
              detector, frame,
              std::make_shared<fcl::Capsuled>(shape.getRadius(), shape.getHeight())) {}
  };
};

constexpr int kRopes = 20;
constexpr int kBodies = 50;
constexpr int kSteps = 200;
constexpr double kRadius = 0.02;
constexpr double kLength = 0.08;  ///< of a body between its joints

using dart::dynamics::ShapePtr;

void addShape(dart::dynamics::BodyNode& body, const ShapePtr& shape) {
  body.createShapeNodeWith<dart::dynamics::CollisionAspect, dart::dynamics::DynamicsAspect>(shape);
  dart::dynamics::Inertia inertia;
  inertia.setMass(1000 * shape->getVolume());
  inertia.setMoment(shape->computeInertia(inertia.getMass()));
  body.setInertia(inertia);
}

Eigen::Isometry3d moved(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

/// With names of their own, as DART tells of each one that it has to change.
template <class Joint>
std::pair<dart::dynamics::Joint*, dart::dynamics::BodyNode*> addBody(
    dart::dynamics::Skeleton& skeleton, dart::dynamics::BodyNode* parent, int number) {
  typename Joint::Properties joint;
  joint.mName = "joint " + std::to_string(number);
  const dart::dynamics::BodyNode::AspectProperties body("body " + std::to_string(number));
  return skeleton.createJointAndBodyNodePair<Joint>(parent, joint, body);
}

/// One above the other and crosswise, in waves; every fifth is held at its first joint. Two are of
/// ellipsoids, which DART hands to FCL as they are.
dart::dynamics::SkeletonPtr makeRope(int rope) {
  ShapePtr shape = std::make_shared<dart::dynamics::CapsuleShape>(kRadius, kLength);
  if (rope % 10 == 3) {
    shape = std::make_shared<dart::dynamics::EllipsoidShape>(
        Eigen::Vector3d(2 * kRadius, 2 * kRadius, kLength + 2 * kRadius));
  }

  const auto skeleton = dart::dynamics::Skeleton::create("rope " + std::to_string(rope));
  dart::dynamics::BodyNode* last = nullptr;
  for (int i = 0; i < kBodies; ++i) {
    const auto [joint, body] = !last && rope % 5 != 0
                                   ? addBody<dart::dynamics::FreeJoint>(*skeleton, last, i)
                                   : addBody<dart::dynamics::BallJoint>(*skeleton, last, i);
    addShape(*body, shape);
    Eigen::Isometry3d start = moved(0, 0, kLength / 2);
    if (!last) {
      start = moved(0, 0, 0.13 + 0.045 * rope) *
              Eigen::AngleAxisd(rope * 0.7, Eigen::Vector3d::UnitZ()) *
              moved(-kLength * kBodies / 2, 0.05 * (rope % 4), 0) *
              Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitY());
    }
    joint->setTransformFromParentBodyNode(start);
    joint->setTransformFromChildBodyNode(moved(0, 0, -kLength / 2));
    // About the axis that points up, as the first body lies.
    if (last) joint->setPosition(0, 0.4 * std::sin(0.5 * i + rope));
    for (std::size_t k = 0; k < joint->getNumDofs(); ++k) joint->setDampingCoefficient(k, 0.01);
    last = body;
  }
  return skeleton;
}

/// A body that stays where it is.
dart::dynamics::SkeletonPtr makeFixed(const std::string& name, const ShapePtr& shape,
                                      const Eigen::Isometry3d& pose) {
  const auto skeleton = dart::dynamics::Skeleton::create(name);
  const auto [joint, body] = addBody<dart::dynamics::WeldJoint>(*skeleton, nullptr, 0);
  addShape(*body, shape);
  joint->setTransformFromParentBodyNode(pose);
  return skeleton;
}

void run() {
  using namespace dart;
  const auto world = simulation::World::create();
  world->setTimeStep(0.00125);
  // The solver that DART has by default takes too long for so many contacts.
  world->setConstraintSolver(std::make_unique<constraint::BoxedLcpConstraintSolver>(
      std::make_shared<constraint::PgsBoxedLcpSolver>()));
  constraint::ConstraintSolver& solver = *world->getConstraintSolver();
  solver.setCollisionDetector(std::make_shared<Detector>());
  const auto group = std::static_pointer_cast<const Group>(solver.getCollisionGroup());

  world->addSkeleton(makeFixed("ground",
                               std::make_shared<dynamics::BoxShape>(Eigen::Vector3d(10, 10, 1)),
                               moved(0, 0, -0.5)));
  // Of a cylinder DART makes a mesh. The posts hover, as they would touch the ground in every step.
  const std::array<ShapePtr, 2> shapes = {std::make_shared<dynamics::SphereShape>(0.05),
                                          std::make_shared<dynamics::CylinderShape>(0.05, 0.1)};
  for (int i = 0; i < 36; ++i) {
    world->addSkeleton(makeFixed("post " + std::to_string(i), shapes[(i / 6 + i) % 2],
                                 moved(0.4 * (i % 6) - 1, 0.4 * (i / 6) - 1, 0.051)));
  }
  std::vector<dynamics::SkeletonPtr> ropes;
  for (int rope = 0; rope < kRopes; ++rope) world->addSkeleton(ropes.emplace_back(makeRope(rope)));

  std::size_t contacts = 0;
  for (int step = 0; step < kSteps; ++step) {
    // One is taken away and comes back.
    if (step == kSteps / 4) world->removeSkeleton(ropes[4]);
    if (step == kSteps / 2) world->addSkeleton(ropes[4]);
    try {
      world->step();
    } catch (const std::exception& e) {
      throw std::runtime_error("step " + std::to_string(step) + ": " + e.what());
    }
    contacts += world->getLastCollisionResult().getNumContacts();
  }
  std::printf("%d steps of %d ropes of %d bodies, %zu contacts between them and with others\n",
              kSteps, kRopes, kBodies, contacts);
  group->managers().print();
  if (contacts == 0) throw std::runtime_error("nothing has touched");
}

}  // namespace

int main() {
  try {
    run();
    return 0;
  } catch (const std::exception& e) {
    std::printf("%s\n", e.what());
    return 1;
  }
}
