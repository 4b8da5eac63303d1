// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>

#include "broadphase/shape_samples.h"
#include "support/least_box.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using geometry::Segment;

/// What FCL's meshes tell a manager: a box and a ball around vertices that it does not see.
template <typename S>
struct MeshOf : fcl::CollisionGeometry<S> {
  std::vector<fcl::Vector3<S>> vertices;

  void computeLocalAABB() override {
    this->aabb_local = fcl::AABB<S>(vertices[0]);
    for (const auto& v : vertices) this->aabb_local += v;
    this->aabb_center = this->aabb_local.center();
    this->aabb_radius = 0;
    for (const auto& v : vertices) {
      this->aabb_radius = std::max(this->aabb_radius, (v - this->aabb_center).norm());
    }
  }
};

/// After those of makeSample().
constexpr int kMesh = kBounded, kKinds = kMesh + 1;
constexpr const char* kNames[] = {"box",       "cube",   "cylinder", "cone",
                                  "ellipsoid", "convex", "triangle", "mesh"};

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeShape(int kind, double size, Random& random) {
  if (kind != kMesh) return makeSample<S>(kind, size, random).shape;
  auto mesh = std::make_shared<MeshOf<S>>();
  const Eigen::Vector3d center = random.inCube(2 * size);
  for (int i = 0; i < 9; ++i) {
    mesh->vertices.emplace_back((center + random.inCube(size)).template cast<S>());
  }
  return mesh;
}

template <typename S>
Segment boxRead(const fcl::CollisionObject<S>& object, Bounds bounds) {
  Segment segment;
  const char* problem = broadphase::readSegment(object, geometry::Frame{}, bounds, segment);
  EXPECT_EQ(problem, nullptr) << problem;
  EXPECT_TRUE(segment.isBox());
  return segment;
}

/// Calls check(object, kind, i) for objects of each shape, size and place, in poses of all kinds.
/// Their boxes are as FCL constructs them; `i` counts.
template <typename S>
void forAll(std::uint64_t seed, const std::vector<double>& sizes,
            const std::function<void(Object<S>&, int, std::size_t, Random&)>& check) {
  Random random(seed);
  for (int kind = 0; kind < kKinds; ++kind) {
    for (const double size : sizes) {
      for (const double offset : {0.0, 1e3, 1e6}) {
        SCOPED_TRACE(std::string(kNames[kind]) + ", size " + std::to_string(size) + ", offset " +
                     std::to_string(offset));
        for (std::size_t i = 0; i < 25; ++i) {
          // Compilers differ in the order in which they evaluate arguments.
          const auto shape = makeShape<S>(kind, size, random);
          const Eigen::Vector3d position = Eigen::Vector3d::Constant(offset) + random.inCube(size);
          Object<S> object(shape, makePose<S>(i, position, random));
          check(object, kind, i, random);
          if (testing::Test::HasFailure()) return;
        }
      }
    }
  }
}

/// The largest coordinate of a box, or by how far it reaches beyond another one at most and least.
Real farthest(const Segment& box) { return std::max(maxNorm(box.a), maxNorm(box.b)); }
std::pair<Real, Real> beyond(const Segment& outer, const ExactBox& inner) {
  const Point low = inner.min - Point(outer.a.x, outer.a.y, outer.a.z);
  const Point high = Point(outer.b.x, outer.b.y, outer.b.z) - inner.max;
  return {low.cwiseMax(high).maxCoeff(), low.cwiseMin(high).minCoeff()};
}
std::pair<Real, Real> beyond(const Segment& outer, const Segment& inner) {
  return beyond(outer,
                {Point(inner.a.x, inner.a.y, inner.a.z), Point(inner.b.x, inner.b.y, inner.b.z)});
}

/// What coordinates of S may carry.
template <typename S>
Real roundingOf(const Object<S>& object, double factor) {
  const Real size =
      object.getAABB().max_.cwiseAbs().cwiseMax(object.getAABB().min_.cwiseAbs()).maxCoeff();
  const auto& shape = *object.collisionGeometry();
  return factor * Real(std::numeric_limits<S>::epsilon()) *
         (size + shape.aabb_center.cwiseAbs().maxCoeff() + shape.aabb_radius);
}

template <typename S>
std::vector<double> allSizes() {
  return std::is_same_v<S, float> ? std::vector<double>{1e-30, 1e-3, 1, 1e3, 1e30}
                                  : std::vector<double>{1e-200, 1e-30, 1e-3, 1, 1e3, 1e200};
}

template <typename S>
class ShapeBoxes : public testing::Test {};
TYPED_TEST_SUITE(ShapeBoxes, Scalars, ScalarName);

// What touches would not be found, or be drowned in what does not.
TYPED_TEST(ShapeBoxes, AreTheLeast) {
  using S = TypeParam;
  forAll<S>(401, allSizes<S>(), [](Object<S>& object, int kind, std::size_t, Random&) {
    const Segment box = boxRead(object, Bounds::kShapes);
    const auto [most, least] = beyond(box, leastBox(object));
    // What every box is widened by before it is used.
    EXPECT_GE(least, -geometry::endPointError(box));
    // S is exact in double, in which all is computed, from numbers as large as the shape is far
    // from its own origin. FCL rounds the ball around a mesh in S.
    const auto& shape = object.shape();
    const Real reach = farthest(box) + 2 * shape.aabb_local.max_.cwiseAbs().maxCoeff() +
                       2 * shape.aabb_local.min_.cwiseAbs().maxCoeff();
    const Real eps = kind == kMesh ? Real(std::numeric_limits<S>::epsilon()) : Real(0x1p-52);
    // FCL's squares of tiny lengths vanish, and with them the ball.
    if (kind != kMesh || reach > 1e-10) {
      EXPECT_LE(most, 32 * eps * reach + 16 * std::numeric_limits<double>::min());
    }
    if (kind != kMesh) return;
    for (const auto& v : static_cast<const MeshOf<S>&>(shape).vertices) {
      const Point p = object.getRotation().template cast<Real>() * v.template cast<Real>() +
                      object.getTranslation().template cast<Real>();
      EXPECT_GE(beyond(box, ExactBox{p, p}).second, -geometry::endPointError(box));
    }
  });
}

// A turned box would count by FCL's cube after computeAABB(), and where it was before.
TYPED_TEST(ShapeBoxes, DoNotDependOnComputeAABB) {
  using S = TypeParam;
  forAll<S>(402, allSizes<S>(), [](Object<S>& object, int kind, std::size_t i, Random& random) {
    const auto expectNothingAdded = [&](const char* when) {
      EXPECT_TRUE(boxRead(object, Bounds::kShapesAndMargins) == boxRead(object, Bounds::kShapes))
          << when << ", " << i;
    };
    expectNothingAdded("as constructed");
    object.computeAABB();
    expectNothingAdded("computed");
    // Turned, and by more than it is large; a cube is told from its ball by whether it is turned.
    const std::size_t turn = kind == kCube ? kAnyTurn : random.below(5);
    const Eigen::Vector3d place =
        object.getTranslation().template cast<double>() * 1.5 + random.inCube(1);
    object.setTransform(makePose<S>(turn, place, random));
    expectNothingAdded("moved");
    object.computeAABB();
    expectNothingAdded("computed again");
    // A program may compute the least box itself; that of a mesh we do not know.
    const ExactBox least = leastBox(object);
    object.aabb.min_ = least.min.template cast<S>();
    object.aabb.max_ = least.max.template cast<S>();
    if (kind != kMesh) expectNothingAdded("the least");
    object.aabb.min_.setConstant(std::numeric_limits<S>::quiet_NaN());
    expectNothingAdded("NaN");
    object.aabb.min_ = fcl::Vector3<S>(0, std::numeric_limits<S>::quiet_NaN(), 0);
    expectNothingAdded("NaN on one side");
  });
}

// A program that looks ahead would lose pairs in silence, or get all of FCL's cube with them.
TYPED_TEST(ShapeBoxes, AreWidenedByTheMarginOfTheProgram) {
  using S = TypeParam;
  constexpr const char* kWays[] = {"object's box", "shape's box", "shape's ball", "least box"};
  for (int way = 0; way < 4; ++way) {
    SCOPED_TRACE(kWays[way]);
    forAll<S>(403, {1.0, 64.0}, [&](Object<S>& object, int kind, std::size_t i, Random& random) {
      // What is added to a mesh's ball, or to a box of it that is not FCL's, is not known.
      if (kind == kMesh && way >= 2) return;
      const auto margin = S(i % 3 + 1) / 16;
      const auto grow = [margin](fcl::AABB<S>& box) {
        box.min_.array() -= margin;
        box.max_.array() += margin;
      };
      auto& shape = object.shape();
      if (way == 1) {
        grow(shape.aabb_local);
        shape.aabb_radius = (shape.aabb_local.max_ - shape.aabb_center).norm();
      }
      if (way == 2) shape.aabb_radius += margin;
      object.computeAABB();
      if (way == 3) {
        const ExactBox least = leastBox(object);
        object.aabb.min_ = least.min.template cast<S>();
        object.aabb.max_ = least.max.template cast<S>();
      }
      if (way == 0 || way == 3) grow(object.aabb);
      // FCL does not use the ball where it does not turn the box.
      const bool is_turned = !object.getTransform().linear().isIdentity();
      const Real added = way == 2 && !is_turned ? 0 : Real(margin);
      // Far out floats tell margins from rounding only if they are larger, and a cube in the ball
      // of another one only by its pose.
      const Real rounding = roundingOf(object, 64) + 64 * Real(0x1p-52) * 1000;
      if (rounding > Real(margin) / 2) return;
      bool may_be_more = false;
      const auto expectMargin = [&](const char* when) {
        const auto [most, least] =
            beyond(boxRead(object, Bounds::kShapesAndMargins), boxRead(object, Bounds::kShapes));
        // The box of a mesh is its local one, so what is added there is turned with it.
        EXPECT_GE(least, (kind == kMesh && way == 1 ? 0 : added) - rounding) << when << ", " << i;
        EXPECT_TRUE(may_be_more || most <= added + rounding)
            << when << ", " << i << ", " << double(most - added);
      };
      // A quarter turn makes no other box of a cube, which FCL's may be a margin around.
      may_be_more = kind == kCube && i % 5 == 2;
      expectMargin("computed");
      // A box of another pose may be that of a cube that was not turned yet.
      may_be_more = kind == kCube;
      // Far away, without computeAABB(): the size tells.
      object.setTranslation(object.getTranslation() +
                            fcl::Vector3<S>((1000 * random.direction()).template cast<S>()));
      expectMargin("moved");
    });
  }
}

// FCL does not use the ball where it does not turn the box, so a wider local box would be cut off.
TYPED_TEST(ShapeBoxes, TheLocalBoxOfAMeshCountsWholeUnlessItIsTurned) {
  using S = TypeParam;
  Random random(405);
  for (int i = 0; i < 50; ++i) {
    Object<S> object(makeShape<S>(kMesh, 1, random));
    object.shape().aabb_local.max_[i % 3] += S(4);
    object.setTranslation(random.inCube(5).template cast<S>());
    object.computeAABB();
    const Segment box = boxRead(object, Bounds::kShapesAndMargins);
    const double high[3] = {box.b.x, box.b.y, box.b.z};
    constexpr double kRounding = 1e-5;  // of FCL's sum, in float
    EXPECT_GE(high[i % 3], double{object.aabb.max_[i % 3]} - kRounding);
  }
}

// A box that is stretched along a motion would be cut off.
TYPED_TEST(ShapeBoxes, ABoxAroundTheShapeCountsAsWell) {
  using S = TypeParam;
  const auto check = [](Object<S>& object, int kind, std::size_t i, Random& random) {
    const int axis = static_cast<int>(i % 3);
    object.aabb.max_[axis] += S(0.5);
    if (i % 2 == 0) object.aabb.min_[(axis + 1) % 3] = -std::numeric_limits<S>::infinity();
    if (kind == kMesh && i % 3 == 0) {
      // The program knows a smaller box.
      const auto& vertices = static_cast<const MeshOf<S>&>(object.shape()).vertices;
      object.aabb = fcl::AABB<S>(fcl::Vector3<S>(object.getTransform() * vertices[0]));
      for (const auto& v : vertices) object.aabb += object.getTransform() * v;
      object.aabb.max_[axis] += S(random.between(0.5, 3));
    }
    const ExactBox own{object.aabb.min_.template cast<Real>(),
                       object.aabb.max_.template cast<Real>()};
    const Segment box = boxRead(object, Bounds::kShapesAndMargins);
    for (int k = 0; k < 3; ++k) {
      const double low[] = {box.a.x, box.a.y, box.a.z}, high[] = {box.b.x, box.b.y, box.b.z};
      EXPECT_LE(low[k], own.min[k]) << i;
      EXPECT_GE(high[k], own.max[k]) << i;
    }
    // A box of another place does not, except for what it may be larger by on all sides.
    object.aabb.min_[(axis + 1) % 3] = object.aabb.max_[(axis + 1) % 3] - S(1);
    object.setTranslation(object.getTranslation() + fcl::Vector3<S>::Constant(S(100)));
    const auto [most, least] =
        beyond(boxRead(object, Bounds::kShapesAndMargins), boxRead(object, Bounds::kShapes));
    EXPECT_GE(least, 0);
    EXPECT_LE(most, 20);
  };
  // Far out in float, few scenes have shapes and boxes of just the sizes that rounding confuses.
  for (std::uint64_t seed = 404; seed < 414; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    forAll<S>(seed, {1.0}, check);
  }
}

// Far out, rounding hides that sides differ. The box that a program widens may be as large as FCL's
// cube around the shape, which would be taken for one of a turned pose and add nothing.
TYPED_TEST(ShapeBoxes, OfSidesThatAreEqualWithinRoundingCountWhatTheProgramAdds) {
  using S = TypeParam;
  const auto expectToCount = [](const Object<S>& object) {
    Segment read;
    ASSERT_EQ(broadphase::readSegment(object, geometry::Frame{}, Bounds::kShapesAndMargins, read),
              nullptr);
    if (!read.isBox()) {
      const geometry::Vec3d radius{read.radius, read.radius, read.radius};
      read = Segment::box(min(read.a, read.b) - radius, max(read.a, read.b) + radius);
    }
    const ExactBox own{object.aabb.min_.template cast<Real>(),
                       object.aabb.max_.template cast<Real>()};
    EXPECT_GE(beyond(read, own).second, 0);
  };
  const auto at = [](S coordinate) {
    return fcl::Transform3<S>(Eigen::Translation<S, 3>(fcl::Vector3<S>::Constant(coordinate)));
  };

  // On all sides, by as much as the cube is larger than the shape.
  const S step = 512 * std::numeric_limits<S>::epsilon();
  const std::shared_ptr<fcl::CollisionGeometry<S>> shapes[] = {
      std::make_shared<fcl::Box<S>>(S(1), S(1), S(1) + 2 * step),
      std::make_shared<fcl::Cylinder<S>>(S(0.5), S(1) + 2 * step),
      std::make_shared<fcl::Ellipsoid<S>>(S(0.5), S(0.5), S(0.5) + step),
      std::make_shared<fcl::Capsule<S>>(S(0.5), 2 * step)};
  for (const auto& shape : shapes) {
    SCOPED_TRACE(shape->getNodeType());
    Object<S> object(shape, at(1024));
    object.aabb.expand(fcl::Vector3<S>::Constant(shape->aabb_radius - S(0.5)));
    expectToCount(object);
  }

  // On one side, of a shape that is hardly larger than the step between numbers.
  const S ulp = std::numeric_limits<S>::epsilon() * S(0x1p19);
  Object<S> object(std::make_shared<fcl::Box<S>>(S(0), S(3.75) * ulp, S(2.75) * ulp), at(1e6));
  object.aabb.max_[0] += 8 * ulp;
  expectToCount(object);
}

// FCL's cube does not grow with a rotation that has drifted, so a thin shape sticks out of its own
// box, which would be taken for one of an earlier pose.
TYPED_TEST(ShapeBoxes, OfDriftedRotationsCountTheMarginOfTheProgram) {
  using S = TypeParam;
  for (const bool is_capsule : {false, true}) {
    std::shared_ptr<fcl::CollisionGeometry<S>> shape;
    if (is_capsule) shape = std::make_shared<fcl::Capsule<S>>(S(1e-4), S(2));
    if (!is_capsule) shape = std::make_shared<fcl::Box<S>>(S(2e-4), S(2e-4), S(2));
    fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
    pose.linear() *= S(1 + 4.9e-4);
    pose.translation() = fcl::Vector3<S>(1, 2, 3);
    Object<S> object(shape, pose);
    const auto read = [&](Bounds bounds) {
      Segment segment{};
      EXPECT_EQ(broadphase::readSegment(object, geometry::Frame{}, bounds, segment), nullptr);
      return segment;
    };
    EXPECT_TRUE(read(Bounds::kShapesAndMargins) == read(Bounds::kShapes));
    const S half = shape->aabb_radius;
    ASSERT_LT(double{half}, 1 + 4e-4) << "the shape does not stick out";

    // Stretched along one axis.
    object.aabb.max_[0] += S(5);
    const Segment stretched = read(Bounds::kShapesAndMargins);
    ASSERT_TRUE(stretched.isBox());
    EXPECT_GE(stretched.b.x, double{object.aabb.max_[0]});
    EXPECT_GE(stretched.b.z, 3 + 1 + 4.8e-4);
    object.aabb.max_[0] -= S(5);

    // Larger on all sides, by less than what sticks out, and by more.
    for (const double margin : {2e-4, 0x1p-5}) {
      object.computeAABB();
      object.aabb.expand(fcl::Vector3<S>::Constant(S(margin)));
      const Segment bare = read(Bounds::kShapes), widened = read(Bounds::kShapesAndMargins);
      EXPECT_EQ(widened.isBox(), !is_capsule);
      const double added = is_capsule ? widened.radius - bare.radius : widened.b.z - bare.b.z;
      const double rounding = 32 * double{std::numeric_limits<S>::epsilon()};
      EXPECT_GE(added, margin - rounding);
      EXPECT_LE(added, margin + rounding);
    }
  }
}

// A size that is no size would spoil the tree for all.
TYPED_TEST(ShapeBoxes, BadSizesAreRefused) {
  using S = TypeParam;
  constexpr S kNaN = std::numeric_limits<S>::quiet_NaN();
  constexpr S kInfinity = std::numeric_limits<S>::infinity();
  for (const S bad : {S(-1), kNaN, kInfinity}) {
    for (int which = 0; which < 3; ++which) {
      for (int kind = 0; kind < kMesh; ++kind) {
        Random random(405);
        const auto shape = makeShape<S>(kind, 1, random);
        const Object<S> object(shape, makePose<S>(kAnyTurn, {1, 2, 3}, random));
        if (kind == kBox || kind == kCube) static_cast<fcl::Box<S>&>(*shape).side[which] = bad;
        if (kind == kCylinder) {
          auto& cylinder = static_cast<fcl::Cylinder<S>&>(*shape);
          (which == 0 ? cylinder.radius : cylinder.lz) = bad;
        }
        if (kind == kCone) {
          auto& cone = static_cast<fcl::Cone<S>&>(*shape);
          (which == 0 ? cone.radius : cone.lz) = bad;
        }
        if (kind == kEllipsoid) static_cast<fcl::Ellipsoid<S>&>(*shape).radii[which] = bad;
        if (kind == kConvex) {
          const auto& vertices = static_cast<fcl::Convex<S>&>(*shape).getVertices();
          const_cast<fcl::Vector3<S>&>(vertices[static_cast<std::size_t>(which)])[which] = bad;
        }
        if (kind == kTriangle) static_cast<fcl::TriangleP<S>&>(*shape).b[which] = bad;
        Segment segment;
        for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins}) {
          const char* problem = broadphase::readSegment(object, geometry::Frame{}, bounds, segment);
          // Any finite number is a coordinate.
          if (bad == S(-1) && (kind == kConvex || kind == kTriangle)) continue;
          ASSERT_NE(problem, nullptr) << kNames[kind] << ", " << bad;
          EXPECT_NE(std::string(problem).find("; give it"), std::string::npos) << problem;
        }
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
