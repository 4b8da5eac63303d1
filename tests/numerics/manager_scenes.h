// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <fcl/narrowphase/collision_object.h>
#include <fcl_fibers/fiber_collision_manager.h>

#include "numerics/manager_truth.h"
#include "support/random.h"

namespace fcl_fibers::test {

/// An object of a program that makes its box larger than FCL's by `margin` on all sides.
class Thing : public fcl::CollisionObjectd {
 public:
  Thing(std::size_t number, ThingShape shape, std::vector<Eigen::Vector3d> points, double radius,
        double margin);

  void place(const Eigen::Isometry3d& pose);
  /// Multiplies the points of a mesh.
  void deform(const Eigen::Matrix3d& by);
  void setRadius(double radius);

  /// An object of the same shape in the same pose.
  std::unique_ptr<Thing> copy(std::size_t number) const;

  std::size_t number() const { return number_; }
  const ThingShape& shape() const { return shape_; }
  bool isMesh() const { return shape_.kind == ThingKind::kMesh; }
  /// Whether it is an fcl::Capsule, of which fibers are made.
  bool isSegment() const { return cgeom->getNodeType() == fcl::GEOM_CAPSULE; }
  bool isDeformed() const { return is_deformed_; }
  /// Whether a manager was promised that its points stay the same.
  bool isRigid() const { return is_rigid_; }
  void promiseRigid() { is_rigid_ = true; }
  Instant now() const;

 private:
  void readBox();

  std::size_t number_;
  ThingShape shape_;
  std::vector<Eigen::Vector3d> points_;  // before the pose
  double radius_, margin_;
  bool is_deformed_ = false, is_rigid_ = false;
};

/// What an object is to fibers and obstacles.
struct Party {
  bool is_obstacle = true;
  bool is_root = false;                    ///< of a fiber
  std::uint32_t bits = ~std::uint32_t{0};  ///< categories of an obstacle, or what a fiber meets
};

/// An object as a manager was given it, and where the manager read it.
struct Member {
  Thing* thing;
  Party party;
  bool is_solid = false;
  int fiber = -1;  ///< given by registerFiber(); -1 if none
  int segment = 0, fiber_size = 1, group = 0;
  bool is_closed = false;
  Instant start{}, end{};  ///< of the step
};

/// A manager, what it was given, and what was done to it.
class ModelledManager {
 public:
  ModelledManager(const FiberManagerOptions& options, bool of_spheres);

  FiberCollisionManager<double>& operator*() const { return *manager_; }
  FiberCollisionManager<double>* operator->() const { return manager_.get(); }
  const FiberManagerOptions& options() const { return options_; }
  bool isOfSpheres() const { return of_spheres_; }
  const std::vector<Member>& members() const { return members_; }  ///< in order of registration
  const Member* find(const Thing* thing) const;

  /// Where a member is during the steps that queries look at, or at the end.
  Body body(const Member& member, bool moves) const {
    const Instant* start = moves && has_step_ ? &member.start : &member.end;
    return {&member.thing->shape(), start, &member.end, member.is_solid};
  }
  /// To call after a query about the step, so that the next change begins a new one.
  void seeStep() { step_is_seen_ = true; }
  /// Begins a step if a query has asked about the present one.
  void beginStep();

  // Members that come are where they are now.
  void registerFiber(const std::vector<Thing*>& things, FiberEnds ends, int group,
                     const FiberObstacles& obstacles);
  void registerObstacle(Thing* thing, const ObstacleOptions& options);
  void registerObjects(const std::vector<Thing*>& things);
  void unregister(const Thing* thing);

  /// Whether margin() tells what the objects have added to their boxes.
  bool tellsMargins() const;

  /// Goes on as a clone with these objects in the place of the members.
  void becomeClone(const std::vector<Thing*>& things);

  /// Reads the things that have moved since the last call, by one of the forms of the call.
  void update(const std::vector<Thing*>& moved, Random& random);
  /// Updates while one of the things is broken. Throws if that or the next query is not refused.
  void failToUpdate(const std::vector<Thing*>& moved, Random& random);
  /// Updates all when nothing is broken any more.
  void repair(bool by_setup);

  bool was_cloned = false, has_failed = false, has_changed = false;

 private:
  void add(Thing* thing, Member member);
  std::vector<Thing*> membersOf(const std::vector<Thing*>& things) const;
  void readEnds();

  FiberManagerOptions options_;
  bool of_spheres_;
  std::unique_ptr<FiberCollisionManager<double>> manager_;
  std::vector<Member> members_;
  int fibers_ = 0;
  bool has_step_ = false, step_is_seen_ = false;
};

/// Two managers over random objects, some in both and some in none, that move, deform, come and go.
/// All depends on what is random alone.
class ManagerScene {
 public:
  ManagerScene(Random random, int threads);
  ManagerScene(const ManagerScene&) = delete;
  ManagerScene& operator=(const ManagerScene&) = delete;

  /// Moves and changes everything a little. Throws if a manager refuses or takes what it should
  /// not.
  void change();

  Random& random() { return random_; }
  double size() const { return size_; }  ///< of the cube that the objects are in, about
  ModelledManager& manager(std::size_t i) { return managers_[i]; }
  const std::vector<std::unique_ptr<Thing>>& things() const { return things_; }

 private:
  Thing* add(ThingShape shape, std::vector<Eigen::Vector3d> points, double radius);
  Thing* addCapsule(double length, double radius);
  Thing* addMesh();
  Thing* addHalfspace();
  std::vector<Thing*> addSome();
  void enroll(ModelledManager& manager, const std::vector<Thing*>& things);
  void comeAndGo(ModelledManager& manager);
  void comeAndGoUnread(ModelledManager& manager);
  void clone(ModelledManager& manager);
  void move(Thing& thing);
  Eigen::Isometry3d somePose();
  bool chance(double probability) { return random_.unit() < probability; }

  Random random_;
  double size_ = 1, spread_ = 1, mobility_ = 1, deforming_ = 0, widened_ = 0;
  std::vector<std::unique_ptr<Thing>> things_;
  std::vector<ModelledManager> managers_;
};

}  // namespace fcl_fibers::test
