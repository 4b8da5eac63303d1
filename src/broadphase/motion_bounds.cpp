// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/motion_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <type_traits>
#include <typeinfo>

#include <fcl/math/motion/interp_motion.h>
#include <fcl/math/motion/screw_motion.h>
#include <fcl/math/motion/spline_motion.h>
#include <fcl/math/motion/translation_motion.h>

#include "broadphase/motion_samples.h"
#include "broadphase/object_segments.h"
#include "broadphase/shape_box.h"
#include "broadphase/taylor_bounds.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::MovingSegment;
using geometry::Segment;
using geometry::Vec3d;

constexpr const char* kNoAxis =
    "the axis of its motion is not of length 1; use a constructor of the motion that sets it";
constexpr const char* kDerived =
    "its motion is of a class derived from one of FCL's motions, whose Taylor models are wrong; "
    "derive the class from fcl::MotionBase";

template <typename S>
const char* readCore(const fcl::CollisionGeometry<S>& shape, ShapeCore& core) {
  double radius = 0, length = 0;
  core.is_capsule = readSize(shape, shape.getNodeType(), radius, length);
  if (core.is_capsule) {
    core.box = around({0, 0, 0}, {0, 0, length / 2});
    core.thickness = radius;
    return sizeProblem(radius, length);
  }
  Corners posed{};
  core.thickness = 0;
  return readShapeBox(shape, fcl::Transform3<S>(fcl::Transform3<S>::Identity()), core.box, posed);
}

/// How far a motion strays from linear motion between its samples. For a point p of the shape the
/// second derivative of its path is at most turn (|p - pivot| + arm), as a length, and `curve` in
/// each coordinate.
struct Bend {
  int parts = 1;         ///< a power of two
  double turn = 0;       ///< the second derivative of the rotation, as a norm
  Vec3d pivot{0, 0, 0};  ///< in the shape's axes
  double arm = 0;        ///< a length that turns with the shape
  Vec3d curve{0, 0, 0};  ///< the second derivative of the translation
  double angle = 0;      ///< the largest that integrate() computes with, in radians
  double reach = 0;      ///< the largest length that integrate() computes with
};

/// Enough parts of a rotation for each to be nearly straight: it turns by at most an eighth of a
/// radian, if that is possible.
int partsOf(double angle) {
  int parts = 4;
  while (parts < kMostParts && 8 * angle > parts) parts *= 2;
  return parts;
}

template <typename S>
const char* readBend(const fcl::TranslationMotion<S>& motion, const fcl::Transform3<S>& start,
                     Bend& bend) {
  bend.reach = maxNorm(toVec3(start.translation())) + maxNorm(toVec3(motion.getVelocity()));
  return nullptr;
}

/// Its rotation turns about an axis at constant speed.
const char* readTurn(const Vec3d& axis, double speed, Bend& bend) {
  // FCL's ScrewMotion that does not turn has the translation as its axis.
  if (speed != 0 && !(std::fabs(squaredNorm(axis) - 1) < 1e-6)) return kNoAxis;
  bend.angle = std::fabs(speed);
  bend.turn = kDrift * speed * speed;
  bend.parts = partsOf(bend.angle);
  return nullptr;
}

// The path of a point p is  c + d t + Q(t) (R p - R pivot)  with a rotation Q about the axis.
const char* readBend(const fcl::InterpMotion<double>& motion, const fcl::Transform3d& start,
                     Bend& bend) {
  bend.pivot = toVec3(motion.getReferencePoint());
  bend.reach = maxNorm(toVec3(start.translation())) + maxNorm(toVec3(motion.getLinearVelocity())) +
               norm1(bend.pivot);
  return readTurn(toVec3(motion.getAngularAxis()), motion.getAngularVelocity(), bend);
}

// The path of a point p is  o + d t + Q(t) (R p + start - o)  with a point o of the axis.
const char* readBend(const fcl::ScrewMotion<double>& motion, const fcl::Transform3d& start,
                     Bend& bend) {
  const Vec3d origin = toVec3(motion.getAxisOrigin()), from = toVec3(start.translation());
  bend.arm = norm(from - origin);
  bend.reach = maxNorm(origin) + maxNorm(from) +
               std::fabs(motion.getLinearVelocity()) * maxNorm(toVec3(motion.getAxis()));
  return readTurn(toVec3(motion.getAxis()), motion.getAngularVelocity(), bend);
}

/// Gives access to the control points. They have no accessors.
template <typename S>
class SplineMembers : fcl::SplineMotion<S> {
 public:
  using Points = std::array<Vec3d, 4>;
  static Points translations(const fcl::SplineMotion<S>& motion) {
    return points(motion.*(&SplineMembers::Td));
  }
  static Points rotations(const fcl::SplineMotion<S>& motion) {
    return points(motion.*(&SplineMembers::Rd));
  }

 private:
  static Points points(const fcl::Vector3<S> (&p)[4]) {
    return {toVec3(p[0]), toVec3(p[1]), toVec3(p[2]), toVec3(p[3])};
  }
};

Vec3d secondDifference(const Vec3d& p, const Vec3d& q, const Vec3d& r) { return p - 2.0 * q + r; }

// Translation and rotation vector w are uniform cubic B-splines. Their derivatives are splines of
// the differences of the control points, and lie within those. The rotation exp(w) changes at most
// as fast as w, and its second derivative is at most |w''| + |w'|^2.
template <typename S>
const char* readBend(const fcl::SplineMotion<S>& motion, const fcl::Transform3<S>& /*start*/,
                     Bend& bend) {
  const auto t = SplineMembers<S>::translations(motion), w = SplineMembers<S>::rotations(motion);
  double speed = 0, bends = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    bend.reach += maxNorm(t[i]);
    bend.angle += norm(w[i]);
    if (i < 3) speed = std::max(speed, norm(w[i + 1] - w[i]));
    if (i < 2) bends = std::max(bends, norm(secondDifference(w[i], w[i + 1], w[i + 2])));
  }
  bend.curve =
      max(abs(secondDifference(t[0], t[1], t[2])), abs(secondDifference(t[1], t[2], t[3])));
  bend.turn = kDrift * (bends + speed * speed);
  bend.parts = bend.turn > 0 || maxNorm(bend.curve) > 0 ? std::max(partsOf(speed), 16) : 1;
  return nullptr;
}

/// Bounds the shape by poses that FCL computes and by the parameters of one of its motions.
template <typename S, class Motion>
const char* boundMotion(const fcl::CollisionGeometry<S>& shape, const ShapeCore& core,
                        const Motion& original, MovingSegment& moving) {
  Motion motion(original);  // integrate() writes into the motion
  fcl::Transform3<S> pose;
  motion.integrate(0);
  motion.getCurrentTransform(pose);
  Bend bend;
  if (const char* problem = readBend(motion, pose, bend)) return problem;
  if (!std::isfinite(bend.turn + bend.reach + bend.angle + bend.arm + norm1(bend.curve))) {
    return kNotFinite;
  }

  const bool is_bounded = isBounded(core.box);
  if (!is_bounded && (bend.turn > 0 || maxNorm(bend.curve) > 0)) return boundEverywhere(moving);
  double radius = 0;  // of the core around the pivot
  if (is_bounded) {
    forEachCorner(core.box,
                  [&](const Vec3d& p) { radius = std::max(radius, norm(p - bend.pivot)); });
  }
  radius += bend.arm;
  // A path with second derivative b strays from the chord of a time h by at most b h^2 / 8. What
  // turns also stays within a ball, and so does its chord.
  const double share = kDrift / (8.0 * bend.parts * bend.parts);
  const double stray = std::min(share * bend.turn, 2 * kDrift) * radius;
  // Each of the few operations of integrate() rounds, and so do the samples.
  const double rounding = 32 * double{std::numeric_limits<S>::epsilon()} *
                          ((1 + bend.angle) * (radius + core.thickness) + bend.reach);
  const Vec3d slack =
      Vec3d{stray + rounding, stray + rounding, stray + rounding} + share * bend.curve;

  const bool is_linear = stray == 0 && bend.curve == Vec3d{0, 0, 0};
  const int parts = is_linear ? 1 : bend.parts;
  MotionSamples samples;
  samples.parts = parts;
  for (int i = 0; i <= parts; ++i) {
    motion.integrate(static_cast<S>(i) / static_cast<S>(parts));
    motion.getCurrentTransform(pose);
    if (const char* problem = poseProblem(pose, kMotionTolerance)) return problem;
    const Vec3d position = toVec3(pose.translation());
    Corners& box = samples.boxes[static_cast<std::size_t>(i)];
    if (core.is_capsule) {
      const Vec3d half = core.box.high.z * toVec3(pose.linear().col(2));
      (i == 0 ? moving.start : moving.end) =
          Segment{position - half, position + half, core.thickness + rounding};
      const Vec3d reach = abs(half) + Vec3d{core.thickness, core.thickness, core.thickness};
      box = around(position, reach);
    } else {
      Corners local;
      if (const char* problem = readShapeBox(shape, pose, local, box)) return problem;
    }
  }
  if (core.is_capsule && is_linear) return checked(moving);
  if (is_bounded) {
    moving = samples.bound(slack);
    return checked(moving);
  }
  // The same sides are open at both times.
  const Corners &first = samples.boxes[0], &last = samples.boxes[1];
  moving.start = Segment::box(first.low - slack, first.high + slack);
  moving.end = Segment::box(last.low - slack, last.high + slack);
  return nullptr;
}

template <class Motion, typename S>
bool isOf(const fcl::MotionBase<S>* motion) {
  return dynamic_cast<const Motion*>(motion) != nullptr;
}

}  // namespace

template <typename S>
const char* readMoving(const fcl::ContinuousCollisionObject<S>& object, MovingSegment& moving) {
  const auto& shape = object.collisionGeometry();
  if (shape == nullptr) return "it has no geometry; construct it with a shape";
  const fcl::MotionBase<S>* motion = object.getMotion();
  if (motion == nullptr) return "it has no motion; construct it with one";
  ShapeCore core{};
  if (const char* problem = readCore(*shape, core)) return problem;

  // A class derived from one of these may move in another way. Their own Taylor models are wrong:
  // FCL's product of a matrix and a model leaves out the third column, that of a translation is
  // empty, and that of a spline takes other weights.
  const std::type_info& type = typeid(*motion);
  const auto bound = [&](const auto& known) { return boundMotion(*shape, core, known, moving); };
  if (type == typeid(fcl::TranslationMotion<S>)) {
    return bound(static_cast<const fcl::TranslationMotion<S>&>(*motion));
  }
  if (type == typeid(fcl::SplineMotion<S>)) {
    return bound(static_cast<const fcl::SplineMotion<S>&>(*motion));
  }
  // FCL's other two are abstract for float.
  if constexpr (std::is_same_v<S, double>) {
    if (type == typeid(fcl::InterpMotion<S>)) {
      return bound(static_cast<const fcl::InterpMotion<S>&>(*motion));
    }
    if (type == typeid(fcl::ScrewMotion<S>)) {
      return bound(static_cast<const fcl::ScrewMotion<S>&>(*motion));
    }
  }
  if (isOf<fcl::TranslationMotion<S>>(motion) || isOf<fcl::SplineMotion<S>>(motion) ||
      isOf<fcl::InterpMotion<S>>(motion) || isOf<fcl::ScrewMotion<S>>(motion)) {
    return kDerived;
  }
  return boundTaylorModel(core, *motion, moving);
}

template const char* readMoving(const fcl::ContinuousCollisionObject<float>&, MovingSegment&);
template const char* readMoving(const fcl::ContinuousCollisionObject<double>&, MovingSegment&);

}  // namespace fcl_fibers::broadphase
