// SPDX-License-Identifier: BSD-3-Clause

// For the instructions of this machine, and Eigen aligned as in FCL's binary: objects, convex
// shapes and meshes that this program makes and FCL frees, and what FCL makes and this program
// frees. Exits with failure if one of the managers has other touching pairs than all pairs tried
// one by one.
#include <cstdio>
#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

namespace {

using Pairs = std::set<std::pair<fcl::CollisionObjectd*, fcl::CollisionObjectd*>>;

/// As programs derive theirs from FCL's: members are read by the layout that they have here.
class Object : public fcl::CollisionObjectd {
 public:
  using fcl::CollisionObjectd::CollisionObjectd;
  bool isAt(const fcl::Transform3d& pose) const {
    return t.matrix() == pose.matrix() && aabb.contain(pose * cgeom->aabb_center);
  }
};

std::shared_ptr<fcl::CollisionGeometryd> makeShape(int i) {
  if (i % 3 == 0) return std::make_shared<fcl::Capsuled>(0.05, 0.4);
  if (i % 3 == 1) {
    const auto corners = std::make_shared<const std::vector<fcl::Vector3d>>(
        std::vector<fcl::Vector3d>{{0, 0, 0}, {0.3, 0, 0}, {0, 0.3, 0}, {0, 0, 0.3}});
    const auto faces = std::make_shared<const std::vector<int>>(
        std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3, 3, 0, 3, 2, 3, 1, 2, 3});
    return std::make_shared<fcl::Convexd>(corners, 4, faces);
  }
  auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  fcl::generateBVHModel(*mesh, fcl::Boxd(0.2, 0.2, 0.2), fcl::Transform3d::Identity());
  return mesh;
}

fcl::Transform3d randomPose(std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  fcl::Transform3d pose = fcl::Transform3d::Identity();
  pose.linear() = fcl::Quaterniond(number(random), number(random), number(random), 1.5)
                      .normalized()
                      .toRotationMatrix();
  pose.translation() = fcl::Vector3d(number(random), number(random), number(random));
  return pose;
}

bool addIfTouching(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* cdata) {
  fcl::CollisionResultd result;
  // FCL makes the contacts and their costs, this program frees them.
  fcl::collide(a, b, fcl::CollisionRequestd(10, true, 10, true), result);
  if (result.isCollision()) static_cast<Pairs*>(cdata)->insert(std::minmax(a, b));
  return false;
}

bool isRight(fcl::BroadPhaseCollisionManagerd&& manager, const std::vector<Object*>& objects,
             std::mt19937 random) {
  manager.registerObjects({objects.begin(), objects.end()});
  manager.setup();
  for (int step = 0; step < 2; ++step) {
    for (Object* object : objects) {
      const fcl::Transform3d pose = randomPose(random);
      object->setTransform(pose);
      object->computeAABB();
      if (!object->isAt(pose)) return false;
    }
    manager.update();
    Pairs expected, found;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) addIfTouching(objects[i], objects[j], &expected);
    }
    manager.collide(&found, addIfTouching);
    std::printf("touching pairs: %zu, found: %zu\n", expected.size(), found.size());
    if (expected.size() < 50 || found != expected) return false;
  }
  return true;
}

}  // namespace

int main() {
  std::mt19937 random(1);
  std::vector<std::unique_ptr<Object>> owned;
  std::vector<Object*> objects;
  for (int i = 0; i < 150; ++i) {
    owned.push_back(std::make_unique<Object>(makeShape(i), randomPose(random)));
    objects.push_back(owned.back().get());
  }
  fcl_fibers::FiberManagerOptions capsules;  // then the triangles of meshes count
  capsules.report = fcl_fibers::Report::kCapsules;
  using Boxes = fcl_fibers::LayeredAABBTreeCollisionManagerd;
  using Spheres = fcl_fibers::WrappedSphereTreeCollisionManagerd;
  const bool is_right =
      isRight(fcl::DynamicAABBTreeCollisionManagerd(), objects, random) &&
      isRight(Boxes(), objects, random) && isRight(Boxes(capsules), objects, random) &&
      isRight(Spheres(), objects, random) && isRight(Spheres(capsules), objects, random);
  return is_right ? 0 : 1;
}
