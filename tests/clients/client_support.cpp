// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/shadow_manager.h>

namespace fcl_fibers::test {
namespace {

using Mesh = fcl::BVHModel<fcl::OBBRSS<double>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// FCL's narrow phase is iterative, to 1e-6 of lengths of about 1: this much nearer than asked for
// is near enough without doubt.
constexpr double kGap = 1e-4;

std::shared_ptr<Mesh> octahedron(const Eigen::Vector3d& half_axes) {
  auto mesh = std::make_shared<Mesh>();
  mesh->beginModel();
  for (const double x : {-half_axes.x(), half_axes.x()}) {
    for (const double y : {-half_axes.y(), half_axes.y()}) {
      for (const double z : {-half_axes.z(), half_axes.z()}) {
        mesh->addTriangle({x, 0, 0}, {0, y, 0}, {0, 0, z});
      }
    }
  }
  mesh->endModel();
  return mesh;
}

Point toPoint(const Eigen::Vector3d& v) { return v.cast<Real>(); }

bool isHalfspace(const Object& object) { return object.getNodeType() == fcl::GEOM_HALFSPACE; }

struct NearestSearch {
  const Truth* truth;
  double found = kInfinity;

  static bool visit(Object* a, Object* b, void* data, double& dist) {
    auto& self = *static_cast<NearestSearch*>(data);
    const double distance = self.truth->distance(a, b);
    self.found = std::min(self.found, distance);
    if (distance < dist) dist = distance;
    return dist <= 0;
  }
};

}  // namespace

std::unique_ptr<Manager> makeShadowed(Report report) {
  FiberManagerOptions options;
  options.report = report;
  ShadowOptions shadow;
  shadow.file.clear();
  shadow.on_difference = [](const ShadowResult& result) { ADD_FAILURE() << result.difference; };
  return std::make_unique<ShadowManager<double>>(makeFclTree<double>(), options, shadow);
}

void addAllShapes(Scene<double>& scene, std::size_t count, double size, double half_side,
                  Random& random) {
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d center = random.inCube(half_side);
    const fcl::Transform3d pose = makePose<double>(random.rotation(), center);
    const auto side = [&] { return size * random.between(0.5, 1); };
    const double a = side(), b = side(), c = side();
    switch (i % 7) {
      case 0:
        scene.add(std::make_shared<fcl::Sphered>(a / 2), pose);
        break;
      case 1:
        scene.add(std::make_shared<fcl::Boxd>(a, b, c), pose);
        break;
      case 2:
        scene.add(std::make_shared<fcl::Cylinderd>(a / 2, b), pose);
        break;
      case 3:
        scene.add(std::make_shared<fcl::Coned>(a / 2, b), pose);
        break;
      case 4:
        scene.add(std::make_shared<fcl::Ellipsoidd>(a / 2, b / 2, c / 2), pose);
        break;
      case 5:
        moveTo(*scene.addConvex(center, a / 2), pose);
        break;
      case 6:
        scene.add(octahedron({a / 2, b / 2, c / 2}), pose);
        break;
    }
  }
}

std::vector<Eigen::Vector3d> wanderingChain(std::size_t segments, double length, double half_side,
                                            Random& random) {
  std::vector<Eigen::Vector3d> points = {random.inCube(half_side)};
  Eigen::Vector3d direction = random.direction();
  while (points.size() <= segments) {
    // Straight on by and large, and back where it would leave.
    direction += 0.5 * random.direction();
    if (points.back().lpNorm<Eigen::Infinity>() > half_side) direction -= points.back();
    direction.normalize();
    points.push_back(points.back() + length * direction);
  }
  return points;
}

fcl::Transform3d posedAlong(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  Eigen::Matrix3d axes;
  axes.col(2) = (to - from).normalized();
  axes.col(0) = axes.col(2).unitOrthogonal();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return makePose<double>(Eigen::Quaterniond(axes), (from + to) / 2);
}

void Truth::read(const Objects& objects, double margin) {
  for (const Object* object : objects) {
    Body& body = bodies_[object];
    body.object = std::make_shared<const Object>(*object);
    const auto& shape = *body.object->collisionGeometry();
    body.center = body.object->getTransform() * shape.aabb_center;
    body.radius = isHalfspace(*body.object) ? kInfinity : shape.aabb_local.radius();
    body.box = leastBox(*body.object);
    if (body.object->getNodeType() == fcl::BV_OBBRSS) {
      // A program that widens a mesh gives it a ball that cuts nothing off its local box.
      const Eigen::Vector3d half = (shape.aabb_local.max_ - shape.aabb_local.min_) / 2;
      const Eigen::Vector3d reach = body.object->getRotation().cwiseAbs() * half;
      body.box = {toPoint(body.center - reach), toPoint(body.center + reach)};
    }
    body.margin = margin;
  }
}

void Truth::ignoreNeighbors(const Objects& chain) {
  for (std::size_t i = 1; i < chain.size(); ++i) bodies_.at(chain[i]).ignored = chain[i - 1];
}

double Truth::distance(const Object* a, const Object* b) const {
  const Body &p = bodies_.at(a), &q = bodies_.at(b);
  return p.ignored == b || q.ignored == a ? kInfinity : distance(p, q);
}

double Truth::distance(const Body& a, const Body& b) const {
  if (isHalfspace(*a.object) || isHalfspace(*b.object)) {
    fcl::CollisionResult<double> result;
    const auto contacts =
        fcl::collide(a.object.get(), b.object.get(), fcl::CollisionRequest<double>(), result);
    return contacts > 0 ? 0 : kInfinity;
  }
  fcl::DistanceResult<double> result;
  return std::max(
      0.0, fcl::distance(a.object.get(), b.object.get(), fcl::DistanceRequest<double>(), result));
}

template <typename Visitor>
void Truth::visitPairs(const Objects& managed, const Partners& partners, Visitor visit) const {
  for (std::size_t i = 0; i < managed.size(); ++i) {
    for (std::size_t j = partners ? 0 : i + 1; j < (partners ? *partners : managed).size(); ++j) {
      Object* partner = (partners ? *partners : managed)[j];
      if (partner != managed[i]) visit(managed[i], partner);
    }
  }
}

/// By how much two bodies are further apart than any pair that this manager may report. The margin
/// of what is turned grows with the cube that FCL bounds it by.
double Truth::apart(const FiberCollisionManager<double>& manager, const Body& p,
                    const Body& q) const {
  const double reach = 3 * (p.margin + q.margin) + kGap;
  const auto is_capsule = [](const Body& body) {
    const fcl::NODE_TYPE type = body.object->getNodeType();
    return type == fcl::GEOM_CAPSULE || type == fcl::GEOM_SPHERE;
  };
  if (manager.options().report == Report::kCapsules && is_capsule(p) && is_capsule(q)) {
    return distance(p, q) - reach;
  }
  if (dynamic_cast<const LayeredAABBTreeCollisionManager<double>*>(&manager) != nullptr) {
    const Point gaps = (p.box.min - q.box.max).cwiseMax(q.box.min - p.box.max);
    return static_cast<double>(gaps.maxCoeff()) - reach;
  }
  // Balls around boxes of what is no capsule.
  return (p.center - q.center).norm() - std::sqrt(3) * (p.radius + q.radius) - reach;
}

testing::AssertionResult Truth::areAll(const Manager& manager, const Calls<double>& calls,
                                       const Partners& partners, std::size_t least) const {
  // FCL's tree keeps the larger box of an object from an earlier pose, or not, as the addresses of
  // its objects have it.
  const auto* const ours = dynamic_cast<const FiberCollisionManager<double>*>(&manager);
  const Objects managed = objectsOf(manager);
  const auto name = [&](const Object* object) {
    return testing::PrintToString(bodies_.at(object).object->getNodeType());
  };
  using Pair = std::pair<const Object*, const Object*>;
  std::set<Pair> asked, handed;
  visitPairs(managed, partners, [&](Object* a, Object* b) { asked.insert(std::minmax(a, b)); });
  for (const auto& [a, b] : calls) {
    if (asked.count(std::minmax(a, b)) == 0) {
      return testing::AssertionFailure() << "a pair that was not asked for";
    }
    if (!handed.insert(std::minmax(a, b)).second) {
      return testing::AssertionFailure() << "a pair twice: types " << name(a) << ", " << name(b);
    }
    if (ours != nullptr && apart(*ours, bodies_.at(a), bodies_.at(b)) > 0) {
      return testing::AssertionFailure()
             << "a pair that is far apart by " << apart(*ours, bodies_.at(a), bodies_.at(b))
             << ": types " << name(a) << ", " << name(b);
    }
  }
  std::size_t near = 0;
  for (const auto& [a, b] : asked) {
    const Body &p = bodies_.at(a), &q = bodies_.at(b);
    const double reach = std::max(0.0, p.margin + q.margin - kGap);
    if ((p.center - q.center).norm() > p.radius + q.radius + reach) continue;
    const double distance = this->distance(a, b);
    if (distance > reach) continue;
    ++near;
    if (handed.count({a, b}) == 0) {
      return testing::AssertionFailure() << "a pair is missing: types " << name(a) << ", "
                                         << name(b) << ", " << distance << " apart";
    }
  }
  if (near < least) {
    return testing::AssertionFailure() << "only " << near << " pairs are near enough";
  }
  return testing::AssertionSuccess();
}

void Truth::expectAll(const Manager& manager, std::size_t least) const {
  EXPECT_TRUE(areAll(manager, selfPairs(manager), {}, least));
}

void Truth::expectAll(const Manager& manager, Object& object) const {
  EXPECT_TRUE(areAll(manager, pairsWith(manager, object), Objects{&object}, 0));
}

void Truth::expectAll(const Manager& manager, Manager& other, std::size_t least) const {
  EXPECT_TRUE(areAll(manager, pairsWith(manager, other), objectsOf(other), least));
}

template <typename... Partner>
void Truth::nearest(const Manager& manager, const Partners& partners, Partner*... partner) const {
  NearestSearch search{this};
  manager.distance(partner..., &search, &NearestSearch::visit);
  double least = kInfinity;
  visitPairs(objectsOf(manager), partners, [&](Object* a, Object* b) {
    const Body &p = bodies_.at(a), &q = bodies_.at(b);
    if ((p.center - q.center).norm() - p.radius - q.radius > least) return;
    least = std::min(least, distance(a, b));
  });
  // Of nothing it is infinite.
  EXPECT_TRUE(search.found == least || std::fabs(search.found - least) <= kGap)
      << search.found << " instead of " << least;
}

void Truth::expectNearest(const Manager& manager) const { nearest(manager, {}); }

void Truth::expectNearest(const Manager& manager, Object& object) const {
  nearest(manager, Objects{&object}, &object);
}

void Truth::expectNearest(const Manager& manager, Manager& other) const {
  nearest(manager, objectsOf(other), &other);
}

}  // namespace fcl_fibers::test
