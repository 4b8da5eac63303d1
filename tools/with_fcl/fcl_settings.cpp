// SPDX-License-Identifier: BSD-3-Clause
#include "tools/with_fcl/fcl_settings.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <fcl_fibers/contact_collector.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>
#include <fmt/format.h>

#include "benchmarks/contenders/closed_form.h"
#include "tools/along_fibers.h"

namespace fcl_fibers::tools {
namespace {

using namespace trade;
using Object = fcl::CollisionObjectd;

Point pointOf(const fcl::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// A capsule whose box can be made tight, which FCL's own object cannot.
class TightObject : public Object {
 public:
  using Object::CollisionObject;
  void computeTightBox() {
    const auto& capsule = static_cast<const fcl::Capsuled&>(*collisionGeometry());
    const fcl::Vector3d extent =
        (capsule.lz / 2 * t.linear().col(2).cwiseAbs()).array() + capsule.radius;
    aabb.min_ = t.translation() - extent;
    aabb.max_ = t.translation() + extent;
  }
};

enum class Boxes { kOfPoses, kStock, kTight };

/// Decides whether two capsules touch, and if `touch` is given, how.
using NarrowPhase = std::function<bool(const Object& a, const Object& b, Touch* touch)>;

bool closedForm(const Object& a, const Object& b, Touch* touch) {
  if (!benchmarks::capsulesTouch(a, b)) return false;
  if (touch == nullptr) return true;
  const benchmarks::CapsuleAxis<double> p = benchmarks::axisOf(a), q = benchmarks::axisOf(b);
  const auto near = benchmarks::nearestPoints(p, q);
  const fcl::Vector3d way = near.q - near.p;
  const double distance = way.norm();
  touch->distance = distance - p.radius - q.radius;
  if (!(distance > 0)) return true;
  const fcl::Vector3d normal = way / distance;
  touch->normal = pointOf(normal);
  touch->place = pointOf((near.p + p.radius * normal + near.q - q.radius * normal) / 2);
  return true;
}

bool fclDistance(const Object& a, const Object& b, Touch* touch) {
  fcl::DistanceRequestd request;
  request.enable_nearest_points = touch != nullptr;
  fcl::DistanceResultd result;
  const double distance = fcl::distance(&a, &b, request, result);
  if (distance > 0) return false;
  if (touch == nullptr) return true;
  // The points lie deepest in the other capsule.
  const fcl::Vector3d &p = result.nearest_points[0], &q = result.nearest_points[1];
  touch->distance = distance;
  touch->normal = pointOf((p - q).normalized());
  touch->place = pointOf((p + q) / 2);
  return true;
}

NarrowPhase fclCollide(fcl::GJKSolverType solver) {
  return [solver](const Object& a, const Object& b, Touch* touch) {
    fcl::CollisionRequestd request;
    request.gjk_solver_type = solver;
    request.enable_contact = touch != nullptr;
    fcl::CollisionResultd result;
    fcl::collide(&a, &b, request, result);
    if (!result.isCollision()) return false;
    if (touch == nullptr) return true;
    const fcl::Contactd& contact = result.getContact(0);
    // FCL 0.7.0 leaves the depth of this solver negative and its normal in the frame of a. What is
    // judged is how good they are for a program that knows.
    const bool is_indep = solver == fcl::GST_INDEP;
    touch->distance = is_indep ? contact.penetration_depth : -contact.penetration_depth;
    touch->normal = pointOf(is_indep ? fcl::Vector3d(a.getTransform().linear() * contact.normal)
                                     : contact.normal);
    touch->place = pointOf(contact.pos);
    return true;
  };
}

bool ourContact(const Object& a, const Object& b, Touch* touch) {
  if (touch == nullptr) return true;
  const Contact contact = capsuleContact(a, b);
  touch->distance = contact.distance;
  touch->normal = contact.normal;
  for (std::size_t k = 0; k < 3; ++k) {
    touch->place[k] = (contact.point_a[k] + contact.point_b[k]) / 2;
  }
  return true;
}

using MakeManager =
    std::function<std::unique_ptr<fcl::BroadPhaseCollisionManagerd>(const FiberTreeOptions&)>;

/// A manager of FCL's interface, and who decides its pairs.
class ManagerTrial : public Trial {
 public:
  ManagerTrial(const Scene& scene, const FiberTreeOptions& options, const MakeManager& make,
               Boxes boxes, NarrowPhase narrow)
      : along_(scene.fibers),
        options_(options),
        poses_{segmentPoses<double>(scene.before), segmentPoses<double>(scene.fibers)},
        boxes_(boxes),
        narrow_(std::move(narrow)),
        manager_(make(options)) {
    for (std::size_t f = 0; f < scene.fibers.fiberCount(); ++f) {
      for (std::size_t n = 0; n < scene.fibers.segmentCount(f); ++n) {
        places_.push_back({f, scene.fibers.point_begin[f] + n});
      }
    }
    for (const std::unique_ptr<Object>& object : makeObjects<double>(scene.fibers)) {
      const auto shape =
          std::const_pointer_cast<fcl::CollisionGeometryd>(object->collisionGeometry());
      objects_.push_back(std::make_unique<TightObject>(shape, object->getTransform()));
      objects_.back()->setUserData(&places_[objects_.size() - 1]);
    }
    if (auto* const ours = dynamic_cast<FiberCollisionManager<double>*>(manager_.get())) {
      is_ours_ = true;
      for (const auto& fiber : objectsByFiber(scene.fibers, objects_)) {
        std::vector<Object*> objects(fiber.objects.begin(), fiber.objects.end());
        std::vector<FiberJoint<Object>> joints;
        for (const auto& joint : fiber.joints) {
          joints.push_back({joint.point, joint.segment, joint.at_end});
        }
        ours->registerFiber(objects, fiber.ends, {}, {}, joints);
      }
      manager_->setup();
    }
  }

  double frame(Deadline& deadline) override {
    deadline_ = &deadline;
    pairs_.clear();
    seen_ = 0;
    setPoses(0);
    computeBoxes();
    if (is_ours_) {
      manager_->update();
    } else {
      // FCL's tree becomes slower with every update.
      manager_->clear();
      std::vector<Object*> all;
      for (const auto& object : objects_) all.push_back(object.get());
      manager_->registerObjects(all);
      manager_->setup();
    }
    setPoses(1);
    return timed(deadline, [&] {
      computeBoxes();
      manager_->update();
      manager_->collide(this, &take);
    });
  }

  std::vector<Touch> found() const override {
    std::vector<Touch> touches;
    for (const auto& [a, b] : pairs_) {
      const bool in_order = placeOf(a).point < placeOf(b).point;
      const Object &first = in_order ? *a : *b, &second = in_order ? *b : *a;
      Touch touch{static_cast<std::int32_t>(placeOf(&first).point),
                  static_cast<std::int32_t>(placeOf(&second).point)};
      narrow_(first, second, &touch);
      touches.push_back(touch);
    }
    std::sort(touches.begin(), touches.end());
    return touches;
  }

  /// Of ours what they tell; FCL does not.
  std::size_t bytes() const override {
    const auto* const ours = dynamic_cast<const FiberCollisionManager<double>*>(manager_.get());
    return ours != nullptr ? ours->memoryUsage() : 0;
  }

 private:
  struct Place {
    std::size_t fiber, point;
  };
  static const Place& placeOf(const Object* object) {
    return *static_cast<const Place*>(object->getUserData());
  }

  static bool take(Object* a, Object* b, void* data) {
    auto& self = *static_cast<ManagerTrial*>(data);
    if (!self.areNeighbors(placeOf(a), placeOf(b)) && self.narrow_(*a, *b, nullptr) &&
        !self.areNeighborsAcross(placeOf(a), placeOf(b))) {
      self.pairs_.emplace_back(a, b);
    }
    return self.deadline_->isOver(self.pairs_.size(), ++self.seen_);
  }

  bool areNeighbors(const Place& a, const Place& b) const {
    if (a.fiber != b.fiber) return false;
    const auto [low, high] = std::minmax(a.point, b.point);
    const NearAlong near =
        along_.near(a.fiber, {static_cast<std::int32_t>(low), static_cast<std::int32_t>(high)});
    return near.numbers_apart <= static_cast<std::size_t>(options_.ignored_neighbors) ||
           (options_.ignored_arc_length > 0 && near.length_between <= options_.ignored_arc_length);
  }

  /// Across fibers that are joined, which our managers leave out and others do not. It is looked up
  /// for what touches alone, as that takes longer.
  bool areNeighborsAcross(const Place& a, const Place& b) const {
    if (is_ours_ || !along_.hasBranches()) return false;
    const SegmentPair pair = {static_cast<std::int32_t>(a.point),
                              static_cast<std::int32_t>(b.point)};
    const auto most_apart = static_cast<std::size_t>(options_.ignored_neighbors);
    const double most_length = options_.ignored_arc_length > 0 ? options_.ignored_arc_length : -1;
    return along_.nearAcross(pair, most_length, most_apart).has_value();
  }

  void setPoses(std::size_t frame) {
    for (std::size_t i = 0; i < objects_.size(); ++i) objects_[i]->setTransform(poses_[frame][i]);
  }
  void computeBoxes() {
    for (const auto& object : objects_) {
      if (boxes_ == Boxes::kStock) object->computeAABB();
      if (boxes_ == Boxes::kTight) object->computeTightBox();
    }
  }

  AlongFibers along_;
  FiberTreeOptions options_;
  std::vector<Place> places_;
  std::vector<fcl::Transform3d> poses_[2];  ///< of the frame before, and of this one
  std::vector<std::unique_ptr<TightObject>> objects_;
  Boxes boxes_;
  NarrowPhase narrow_;
  std::unique_ptr<fcl::BroadPhaseCollisionManagerd> manager_;
  bool is_ours_ = false;
  Deadline* deadline_ = nullptr;
  std::size_t seen_ = 0;
  std::vector<std::pair<Object*, Object*>> pairs_;
};

template <class Manager>
MakeManager ours() {
  return [](const FiberTreeOptions& options) {
    return std::make_unique<Manager>(FiberManagerOptions{options});
  };
}

std::unique_ptr<fcl::BroadPhaseCollisionManagerd> fclTree(const FiberTreeOptions&) {
  return std::make_unique<fcl::DynamicAABBTreeCollisionManagerd>();
}

std::string codeOf(const FiberTreeOptions& options, const char* manager) {
  std::string lines = "FiberManagerOptions options;\noptions.report = Report::kCapsules;\n";
  lines += fmt::format("options.ignored_neighbors = {};\n", options.ignored_neighbors);
  if (options.ignored_arc_length > 0) {
    lines += fmt::format("options.ignored_arc_length = {};\n", options.ignored_arc_length);
  }
  return lines + fmt::format("{} manager(options);\n", manager);
}

}  // namespace

std::vector<Setting> fclSettings(const Scene& scene, const FiberTreeOptions& options) {
  std::vector<Setting> settings;
  if (scene.isStep() || !scene.meshes.empty()) return settings;
  const auto add = [&](const std::string& dial, const std::string& value, const std::string& cpp,
                       const MakeManager& make, Boxes boxes, const NarrowPhase& narrow) {
    settings.push_back({dial, value, cpp, "# The Python package has no managers.\n", [=, &scene] {
                          return std::make_unique<ManagerTrial>(scene, options, make, boxes,
                                                                narrow);
                        }});
  };
  add("manager", "layered boxes", codeOf(options, "LayeredAABBTreeCollisionManagerd"),
      ours<LayeredAABBTreeCollisionManagerd>(), Boxes::kOfPoses, ourContact);
  add("manager", "wrapped spheres", codeOf(options, "WrappedSphereTreeCollisionManagerd"),
      ours<WrappedSphereTreeCollisionManagerd>(), Boxes::kOfPoses, ourContact);
  const std::string tree = "fcl::DynamicAABBTreeCollisionManagerd manager;\n";
  const auto addFcl = [&](const std::string& dial, const std::string& value,
                          const std::string& test, Boxes boxes, const NarrowPhase& narrow) {
    add(dial, value, tree + "// In the callback: " + test + ".\n", fclTree, boxes, narrow);
  };
  const std::string closed_form = "the closed form of two capsules, without neighbours";
  addFcl("FCL's tree", "tight boxes, closed form", closed_form, Boxes::kTight, closedForm);
  addFcl("FCL's tree", "stock boxes, closed form", closed_form, Boxes::kStock, closedForm);
  addFcl("FCL's tree", "tight boxes, fcl::distance", "fcl::distance", Boxes::kTight, fclDistance);
  addFcl("FCL's tree", "tight boxes, fcl::collide", "fcl::collide", Boxes::kTight,
         fclCollide(fcl::GST_LIBCCD));
  addFcl("FCL's tree", "tight boxes, fcl::collide with FCL's GJK",
         "fcl::collide with gjk_solver_type = GST_INDEP", Boxes::kTight,
         fclCollide(fcl::GST_INDEP));
  return settings;
}

}  // namespace fcl_fibers::tools
