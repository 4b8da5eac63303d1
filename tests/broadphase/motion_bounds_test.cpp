// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/motion_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/geometry/shape/triangle_p.h>
#include <fcl/math/motion/interp_motion.h>
#include <fcl/math/motion/screw_motion.h>
#include <fcl/math/motion/spline_motion.h>
#include <fcl/math/motion/translation_motion.h>

#include "support/least_box.h"
#include "support/motions.h"
#include "support/random.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using geometry::MovingSegment;
using geometry::Segment;
using geometry::Vec3d;

Point pointOf(const Vec3d& v) { return {v.x, v.y, v.z}; }

/// What the index makes of a segment.
ExactBox boxOf(const Segment& s) {
  const Point by = Point::Constant(Real(s.thickness()) + Real(geometry::endPointError(s)));
  return {pointOf(min(s.a, s.b)) - by, pointOf(max(s.a, s.b)) + by};
}

template <typename S>
MovingSegment bound(const fcl::ContinuousCollisionObject<S>& object) {
  MovingSegment moving{};
  const char* problem = broadphase::readMoving(object, moving);
  EXPECT_EQ(problem, nullptr) << problem;
  return moving;
}

template <typename S>
std::string problemOf(const std::shared_ptr<fcl::CollisionGeometry<S>>& shape,
                      const std::shared_ptr<fcl::MotionBase<S>>& motion) {
  MovingSegment moving{};
  const char* problem =
      broadphase::readMoving(fcl::ContinuousCollisionObject<S>(shape, motion), moving);
  return problem == nullptr ? "" : problem;
}

constexpr int kShapes = 6;

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeShape(int kind, double size, Random& random) {
  const auto side = [&] { return static_cast<S>(size * random.between(0.1, 1)); };
  switch (kind) {
    case 0:
      return std::make_shared<fcl::Capsule<S>>(side(), side());
    case 1:
      return std::make_shared<fcl::Sphere<S>>(side());
    case 2:
      return std::make_shared<fcl::Box<S>>(side(), side(), side());
    case 3:
      return std::make_shared<fcl::Cone<S>>(side(), side());
    case 4:
      return std::make_shared<fcl::Cylinder<S>>(side(), side());
    default:
      return std::make_shared<fcl::Ellipsoid<S>>(side(), side(), side());
  }
}

/// Motions are sampled at the ends of up to 32 equal parts here, and stray most near their middles.
constexpr int kTimes = 64;

/// How far the box of the moving shape reaches out of the bound, at most, at many times; and how
/// far the bound is from the best one of its kind, whose start and end are moved outward by as much
/// as the shape leaves the interpolation of the two least boxes.
struct Deviation {
  Real missing = 0, excess = 0;
};

template <typename S>
Deviation deviationOf(const std::shared_ptr<fcl::CollisionGeometry<S>>& shape,
                      const fcl::MotionBase<S>& motion, const MovingSegment& moving) {
  const ExactBox start = boxOf(moving.start), end = boxOf(moving.end);
  const auto leastAt = [&](Real t) {
    motion.integrate(static_cast<S>(t));
    fcl::Transform3<S> pose;
    motion.getCurrentTransform(pose);
    return leastBox(fcl::CollisionObject<S>(shape, pose));
  };
  const ExactBox first = leastAt(0), last = leastAt(1);
  Deviation deviation;
  Point below = Point::Zero(), above = Point::Zero();
  for (int i = 0; i <= kTimes; ++i) {
    const auto t = Real(i) / kTimes;
    const ExactBox least = leastAt(t);
    const auto between = [t](const Point& p, const Point& q) -> Point {
      return (1 - t) * p + t * q;
    };
    const Point out =
        (between(start.min, end.min) - least.min).cwiseMax(least.max - between(start.max, end.max));
    deviation.missing = std::max(deviation.missing, out.maxCoeff());
    below = below.cwiseMax(between(first.min, last.min) - least.min);
    above = above.cwiseMax(least.max - between(first.max, last.max));
  }
  const Point low = (first.min - below - start.min).cwiseMax(last.min - below - end.min);
  const Point high = (start.max - first.max - above).cwiseMax(end.max - last.max - above);
  deviation.excess = low.cwiseMax(high).maxCoeff();
  return deviation;
}

template <typename S>
class MotionBounds : public testing::Test {};
TYPED_TEST_SUITE(MotionBounds, Scalars, ScalarName);

// What touches during the motion would not be found, or be drowned in what does not.
TYPED_TEST(MotionBounds, HoldTheShapeAtEachOfManyTimes) {
  using S = TypeParam;
  constexpr double kEps{std::numeric_limits<S>::epsilon()};
  for (const MotionKind kind : motionKinds<S>()) {
    for (const double size : {1e-3, 1e3}) {
      for (const auto& [offset, drift] : {std::pair(0.0, 0.0), {1e3, 0.0}, {1.0, 0.999e-3}}) {
        for (const double angle : {0.0, 0.1, 1.0, 3.1}) {
          SCOPED_TRACE(nameOf(kind) + ", size " + std::to_string(size) + ", offset " +
                       std::to_string(offset) + ", drift " + std::to_string(drift) + ", angle " +
                       std::to_string(angle));
          Random random(4021);
          for (int i = 0; i < kShapes; ++i) {
            const auto shape = makeShape<S>(i, size, random);
            const auto motion =
                makeMotion<S>(kind, Eigen::Vector3d::Constant(offset), size, angle, random, drift);
            const MovingSegment moving = bound(fcl::ContinuousCollisionObject<S>(shape, motion));
            const Deviation found = deviationOf(shape, *motion, moving);
            EXPECT_LE(found.missing, 0) << "shape " << i;
            // A part of a rotation between samples, and of the bend of a spline. Taylor models are
            // looser, and know round shapes by their local boxes only.
            const double radius = 8 * size;
            // Between two matrices that have drifted there is a turn as well. A translation has
            // one matrix.
            const double turn = kind == MotionKind::kTranslation ? 0 : drift;
            const double loose = kind == MotionKind::kOwn ? 2 * size + std::pow(angle, 4) * size
                                 : kind == MotionKind::kSpline
                                     ? 0.02 * radius
                                     : 0.02 * std::min(angle + turn, 1.0) * radius;
            // FCL's screw that does not turn goes farther than asked for.
            const Real largest = std::max({maxNorm(moving.start.a), maxNorm(moving.end.a), radius});
            EXPECT_LE(found.excess, loose + 256 * kEps * largest * (1 + angle)) << "shape " << i;
            if (testing::Test::HasFailure()) return;
          }
        }
      }
    }
  }
}

// Capsules that only move would be boxes, so that all that is near them touched them.
TYPED_TEST(MotionBounds, CapsulesThatDoNotTurnMoveByTheirEnds) {
  using S = TypeParam;
  constexpr double kEps{std::numeric_limits<S>::epsilon()};
  Random random(4022);
  for (int i = 0; i < 200; ++i) {
    const double offset = i % 2 == 0 ? 0 : 1e3;
    const auto shape = makeShape<S>(i % 4 / 2, 1, random);
    const MotionKind kind = i % 8 < 4 ? MotionKind::kTranslation : MotionKind::kSpline;
    auto motion = makeMotion<S>(kind, Eigen::Vector3d::Constant(offset), 1, 1, random);
    if (kind == MotionKind::kSpline) motion = makeLinearSpline<S>(offset, random);
    const MovingSegment moving = bound(fcl::ContinuousCollisionObject<S>(shape, motion));
    ASSERT_FALSE(moving.start.isBox());
    ASSERT_FALSE(moving.end.isBox());
    const bool is_capsule = shape->getNodeType() == fcl::GEOM_CAPSULE;
    const auto& capsule = static_cast<const fcl::Capsule<S>&>(*shape);
    const Real half = is_capsule ? Real(capsule.lz) / 2 : 0;
    const Real radius =
        is_capsule ? Real(capsule.radius) : Real(static_cast<const fcl::Sphere<S>&>(*shape).radius);
    for (int k = 0; k <= 100; ++k) {
      const auto t = static_cast<S>(k / 100.0);
      motion->integrate(t);
      fcl::Transform3<S> pose;
      motion->getCurrentTransform(pose);
      for (const int sign : {-1, 1}) {
        const Point axis = pose.linear().col(2).template cast<Real>();
        const Point is = pose.translation().template cast<Real>() + sign * half * axis;
        const auto ends = [sign](const Segment& s) { return pointOf(sign < 0 ? s.a : s.b); };
        const Point held = (1 - Real(t)) * ends(moving.start) + Real(t) * ends(moving.end);
        const Real more = (1 - Real(t)) * Real(moving.start.radius) +
                          Real(t) * Real(moving.end.radius) - radius - (is - held).norm();
        EXPECT_GE(more, 0) << i << ", " << k;
        EXPECT_LE(more, 256 * kEps * (offset + 16)) << i << ", " << k;
      }
    }
  }
}

// A spline would bend between samples by what only its speed or only its acceleration tells.
TYPED_TEST(MotionBounds, SplinesThatTurnAtConstantSpeedOrBackAndForth) {
  using S = TypeParam;
  Random random(4027);
  const std::vector<std::vector<double>> turns = {{-2, -1, 0, 1}, {0, 0.1, 0, 0.1}, {0.2, 0, 0, 0}};
  for (const auto& turn : turns) {
    for (int i = 0; i < 30; ++i) {
      const fcl::Vector3<S> axis = random.direction().template cast<S>(),
                            zero = fcl::Vector3<S>::Zero();
      const auto w = [&](std::size_t k) -> fcl::Vector3<S> { return S(turn[k]) * axis; };
      const auto shape = makeShape<S>(2, 1, random);
      const auto motion =
          std::make_shared<fcl::SplineMotion<S>>(zero, zero, zero, zero, w(0), w(1), w(2), w(3));
      const MovingSegment moving = bound(fcl::ContinuousCollisionObject<S>(shape, motion));
      EXPECT_LE(deviationOf(shape, *motion, moving).missing, 0) << turn[1] << ", " << i;
    }
  }
}

// A screw or an interpolation that does not turn, or whose axis is far away, would lose digits that
// the bound must have.
TEST(MotionBoundsOfDouble, RotationsThatAreTinyOrNone) {
  Random random(4023);
  for (const double angle : {0.0, 1e-300, 1e-12, 1e-9, 1e-6}) {
    for (const MotionKind kind : {MotionKind::kInterp, MotionKind::kScrew}) {
      for (int i = 0; i < kShapes; ++i) {
        SCOPED_TRACE(nameOf(kind) + ", " + std::to_string(angle) + ", shape " + std::to_string(i));
        const auto shape = makeShape<double>(i, 1, random);
        const auto motion = makeMotion<double>(kind, Eigen::Vector3d::Zero(), 1, angle, random);
        const MovingSegment moving = bound(fcl::ContinuousCollisionObject<double>(shape, motion));
        EXPECT_LE(deviationOf(shape, *motion, moving).missing, 0);
      }
    }
  }
}

// A motion that is shared, or stopped at some time, would be at another one after a query.
TYPED_TEST(MotionBounds, TheMotionStaysAtItsTime) {
  using S = TypeParam;
  Random random(4024);
  for (const MotionKind kind : motionKinds<S>()) {
    const auto motion = makeMotion<S>(kind, Eigen::Vector3d::Zero(), 1, 1, random);
    motion->integrate(S(0.3));
    fcl::Transform3<S> before, after;
    motion->getCurrentTransform(before);
    bound(fcl::ContinuousCollisionObject<S>(makeShape<S>(0, 1, random), motion));
    motion->getCurrentTransform(after);
    EXPECT_EQ(before.matrix(), after.matrix()) << nameOf(kind);
  }
}

// The floor would have an end, or everything would touch it.
TYPED_TEST(MotionBounds, HalfSpacesStayUnbounded) {
  using S = TypeParam;
  const auto floor = std::make_shared<fcl::Halfspace<S>>(S(0), S(0), S(1), S(2));
  floor->computeLocalAABB();
  fcl::Transform3<S> from = fcl::Transform3<S>::Identity(), to = from;
  to.translation() = fcl::Vector3<S>(1, 2, 3);
  const auto sinking = std::make_shared<fcl::TranslationMotion<S>>(from, to);
  const MovingSegment moving = bound(fcl::ContinuousCollisionObject<S>(floor, sinking));
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(moving.start.a, (Vec3d{-inf, -inf, -inf}));
  EXPECT_EQ(moving.end.b.x, inf);
  EXPECT_NEAR(moving.start.b.z, 2, 1e-4);
  EXPECT_NEAR(moving.end.b.z, 5, 1e-4);
  // One that lies flat at the start.
  const fcl::Vector3<S> zero = fcl::Vector3<S>::Zero(), x = fcl::Vector3<S>::UnitX();
  const auto tilting =
      std::make_shared<fcl::SplineMotion<S>>(zero, zero, zero, zero, x, zero, -x, S(-2) * x);
  const MovingSegment tilted = bound(fcl::ContinuousCollisionObject<S>(floor, tilting));
  EXPECT_EQ(tilted.start.b, (Vec3d{inf, inf, inf}));
  EXPECT_EQ(tilted.end.b, (Vec3d{inf, inf, inf}));
  Random random(4025);
  for (const MotionKind kind : motionKinds<S>()) {
    if (kind == MotionKind::kTranslation) continue;
    const auto turning = makeMotion<S>(kind, Eigen::Vector3d::Zero(), 1, 1, random);
    const MovingSegment turned = bound(fcl::ContinuousCollisionObject<S>(floor, turning));
    EXPECT_EQ(turned.start.b, (Vec3d{inf, inf, inf})) << nameOf(kind);
    EXPECT_EQ(turned.end.a, (Vec3d{-inf, -inf, -inf})) << nameOf(kind);
  }
}

template <typename S>
class Unset final : public OwnMotion<S> {
 public:
  using OwnMotion<S>::OwnMotion;
  void getTaylorModel(fcl::TMatrix3<S>&, fcl::TVector3<S>&) const override {}
};

template <class Motion>
class Derived final : public Motion {
 public:
  using Motion::Motion;
};

// A broken object would be somewhere else, or crash.
TYPED_TEST(MotionBounds, RefuseWhatCannotBeRead) {
  using S = TypeParam;
  using testing::HasSubstr;
  using Motion = std::shared_ptr<fcl::MotionBase<S>>;
  Random random(4026);
  const std::shared_ptr<fcl::CollisionGeometry<S>> shape = makeShape<S>(0, 1, random);
  const Motion good =
      makeMotion<S>(MotionKind::kTranslation, Eigen::Vector3d::Zero(), 1, 0, random);
  EXPECT_EQ(problemOf<S>(shape, good), "");
  EXPECT_THAT(problemOf<S>(nullptr, good), HasSubstr("has no geometry"));
  EXPECT_THAT(problemOf<S>(shape, nullptr), HasSubstr("has no motion"));
  EXPECT_THAT(problemOf<S>(std::make_shared<fcl::Capsule<S>>(S(-1), S(1)), good),
              HasSubstr("radius is negative"));
  EXPECT_THAT(problemOf<S>(std::make_shared<fcl::Capsule<S>>(S(1), S(NAN)), good),
              HasSubstr("length is negative, NaN"));
  const fcl::Vector3<S> nowhere = fcl::Vector3<S>::Constant(S(NAN));
  EXPECT_THAT(problemOf<S>(std::make_shared<fcl::TriangleP<S>>(nowhere, nowhere, nowhere), good),
              HasSubstr("NaN or infinite; give it finite vertices"));
  fcl::Transform3<S> from = fcl::Transform3<S>::Identity(), to = from;
  for (const S bad : {std::numeric_limits<S>::quiet_NaN(), std::numeric_limits<S>::infinity()}) {
    to.translation()[1] = bad;
    EXPECT_NE(problemOf<S>(shape, std::make_shared<fcl::TranslationMotion<S>>(from, to)), "");
    EXPECT_NE(problemOf<S>(shape, std::make_shared<fcl::TranslationMotion<S>>(to, from)), "");
    for (const int point : {0, 3}) {
      for (const bool turns : {false, true}) {
        std::vector<fcl::Vector3<S>> p(8, fcl::Vector3<S>::Zero());
        p[static_cast<std::size_t>(point + 4 * turns)][2] = bad;
        EXPECT_NE(problemOf<S>(shape, std::make_shared<fcl::SplineMotion<S>>(
                                          p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7])),
                  "");
      }
    }
  }
  EXPECT_THAT(problemOf<S>(shape, std::make_shared<Unset<S>>(from, fcl::Vector3<S>::Zero(),
                                                             fcl::Vector3<S>::UnitX(), S(0))),
              HasSubstr("getTaylorModel() does not set"));
  const fcl::Transform3<S> here = fcl::Transform3<S>::Identity();
  const fcl::Vector3<S> zero = fcl::Vector3<S>::Zero();
  EXPECT_THAT(problemOf<S>(shape, std::make_shared<Derived<fcl::TranslationMotion<S>>>(here, here)),
              HasSubstr("derived from one of FCL's"));
  EXPECT_THAT(problemOf<S>(shape, std::make_shared<Derived<fcl::SplineMotion<S>>>(
                                      zero, zero, zero, zero, zero, zero, zero, zero)),
              HasSubstr("derived from one of FCL's"));
  if constexpr (std::is_same_v<S, double>) {
    EXPECT_THAT(problemOf<S>(shape, std::make_shared<Derived<fcl::ScrewMotion<S>>>(here, here)),
                HasSubstr("derived from one of FCL's"));
  }
  auto late = std::make_shared<OwnMotion<S>>(here, zero, fcl::Vector3<S>::UnitX(), S(0));
  late->getTimeInterval()->setValue(S(0.5), S(1));
  EXPECT_THAT(problemOf<S>(shape, late), HasSubstr("[0, 1]"));
  auto lost = std::make_shared<OwnMotion<S>>(here, fcl::Vector3<S>::Constant(S(NAN)),
                                             fcl::Vector3<S>::UnitX(), S(0));
  EXPECT_THAT(problemOf<S>(shape, lost), HasSubstr("NaN"));
}

// FCL's constructor that takes a reference point and two transforms sets no speed and no axis.
TEST(MotionBoundsOfDouble, AnAxisThatIsNoneIsRefused) {
  struct Interp : fcl::InterpMotion<double> {
    Interp(const fcl::Transform3d& from, const fcl::Transform3d& to)
        : fcl::InterpMotion<double>(from, to, fcl::Vector3d::Zero()) {}
    using fcl::InterpMotion<double>::angular_axis, fcl::InterpMotion<double>::angular_vel,
        fcl::InterpMotion<double>::linear_vel;
  };
  Interp parameters(fcl::Transform3d::Identity(), fcl::Transform3d::Identity());
  parameters.linear_vel.setZero();
  parameters.angular_axis = fcl::Vector3d(0, 0, 2);
  parameters.angular_vel = 1;
  const auto shape = std::make_shared<fcl::Box<double>>(1, 1, 1);
  EXPECT_THAT(problemOf<double>(shape, std::make_shared<fcl::InterpMotion<double>>(parameters)),
              testing::HasSubstr("axis of its motion is not of length 1"));
}

}  // namespace
}  // namespace fcl_fibers::test
