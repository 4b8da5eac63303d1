// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <fcl/math/motion/interp_motion.h>
#include <fcl/math/motion/screw_motion.h>
#include <fcl/math/motion/spline_motion.h>
#include <fcl/math/motion/translation_motion.h>

#include "support/drift.h"
#include "support/random.h"

namespace fcl_fibers::test {

/// A motion of a class that is not FCL's: it turns about an axis through the body's origin at
/// constant speed, and moves along a cubic.
template <typename S>
class OwnMotion : public fcl::MotionBase<S> {
 public:
  OwnMotion(const fcl::Transform3<S>& start, const fcl::Vector3<S>& velocity,
            const fcl::Vector3<S>& axis, S speed,
            const fcl::Vector3<S>& cubic = fcl::Vector3<S>::Zero())
      : start_(start),
        velocity_(velocity),
        axis_(axis),
        cubic_(cubic),
        speed_(speed),
        now_(start) {}

  bool integrate(S t) const override {
    now_.linear() = Eigen::AngleAxis<S>(speed_ * t, axis_).toRotationMatrix() * start_.linear();
    now_.translation() = start_.translation() + t * velocity_ + t * t * t * cubic_;
    return true;
  }
  S computeMotionBound(const fcl::BVMotionBoundVisitor<S>&) const override { return 0; }
  S computeMotionBound(const fcl::TriangleMotionBoundVisitor<S>&) const override { return 0; }
  void getCurrentTransform(fcl::Transform3<S>& pose) const override { pose = now_; }
  void getTaylorModel(fcl::TMatrix3<S>& rotation, fcl::TVector3<S>& translation) const override {
    const auto& interval = this->getTimeInterval();
    // FCL's models of sine and cosine lose a side of the remainder if that may have either sign.
    const double w = double(speed_), c = std::cos(w / 2), s = std::sin(w / 2);
    const auto cosine = aroundHalf(c, -w * s, -w * w * c, w * w * w * s);
    const auto sine = aroundHalf(s, w * c, -w * w * s, -w * w * w * c);
    fcl::Matrix3<S> hat;
    hat << 0, -axis_[2], axis_[1], axis_[2], 0, -axis_[0], -axis_[1], axis_[0], 0;
    const fcl::Matrix3<S> squared = hat * hat, turned = start_.linear();
    // FCL's product of a matrix and a model leaves out the third column.
    fcl::TMatrix3<S> turn(interval);
    for (const int i : {0, 1, 2}) {
      for (const int j : {0, 1, 2}) {
        turn(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) =
            sine * hat(i, j) - (cosine - S(1)) * squared(i, j) + S(i == j ? 1 : 0);
      }
    }
    rotation = turn * turned;
    fcl::TaylorModel<S> along[3];
    for (int i = 0; i < 3; ++i) {
      along[i].setTimeInterval(interval);
      fcl::generateTaylorModelForLinearFunc(along[i], start_.translation()[i], velocity_[i]);
      along[i].coeff(3) = cubic_[i];
    }
    translation = fcl::TVector3<S>(along[0], along[1], along[2]);
  }

 private:
  /// The model of a sine or cosine of `speed_` by its derivatives at time 1/2.
  fcl::TaylorModel<S> aroundHalf(double f, double f1, double f2, double f3) const {
    const double h = 0.5, rest = std::pow(double(speed_) * h, 4) / 24;
    const double coefficients[] = {f - h * f1 + h * h * f2 / 2 - h * h * h * f3 / 6,
                                   f1 - h * f2 + h * h * f3 / 2, f2 / 2 - h * f3 / 2, f3 / 6};
    fcl::TaylorModel<S> model(this->getTimeInterval());
    for (std::size_t i = 0; i < 4; ++i) model.coeff(i) = static_cast<S>(coefficients[i]);
    model.remainder().setValue(static_cast<S>(-rest), static_cast<S>(rest));
    return model;
  }

  fcl::Transform3<S> start_;
  fcl::Vector3<S> velocity_, axis_, cubic_;
  S speed_;
  mutable fcl::Transform3<S> now_;

 public:
  EIGEN_MAKE_ALIGNED_OPERATOR_NEW
};

enum class MotionKind { kTranslation, kSpline, kOwn, kInterp, kScrew };

inline std::string nameOf(MotionKind kind) {
  constexpr const char* kNames[] = {"translation", "spline", "own", "interp", "screw"};
  return kNames[static_cast<int>(kind)];
}

/// FCL's other two are abstract for float.
template <typename S>
std::vector<MotionKind> motionKinds() {
  using K = MotionKind;
  if (std::is_same_v<S, float>) return {K::kTranslation, K::kSpline, K::kOwn};
  return {K::kTranslation, K::kSpline, K::kOwn, K::kInterp, K::kScrew};
}

/// A motion from near `place` by about `size`, which turns by about `angle` unless it is a
/// translation. Its matrices deviate from rotations by `drift`, as shearedRotation() has it.
template <typename S>
std::shared_ptr<fcl::MotionBase<S>> makeMotion(MotionKind kind, const Eigen::Vector3d& place,
                                               double size, double angle, Random& random,
                                               double drift = 0) {
  const auto near = [&](double by) -> fcl::Vector3<S> {
    return (place + random.inCube(by)).template cast<S>();
  };
  const auto pose = [&](const Eigen::Quaterniond& turn) {
    fcl::Transform3<S> made = fcl::Transform3<S>::Identity();
    made.linear() = drift > 0 ? shearedRotation<S>(turn, drift, random)
                              : turn.toRotationMatrix().template cast<S>().eval();
    made.translation() = near(size);
    return made;
  };
  const Eigen::Quaterniond turn = random.rotation();
  const Eigen::Vector3d axis = random.direction();
  const Eigen::Quaterniond turned = Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)) * turn;
  const fcl::Transform3<S> from = pose(turn);
  switch (kind) {
    case MotionKind::kTranslation:
      return std::make_shared<fcl::TranslationMotion<S>>(from, pose(turn));
    case MotionKind::kOwn:
      return std::make_shared<OwnMotion<S>>(from, random.inCube(size).template cast<S>(),
                                            axis.template cast<S>(), S(angle),
                                            random.inCube(size).template cast<S>());
    case MotionKind::kSpline: {
      fcl::Vector3<S> t[4], w[4];
      const Eigen::Vector3d first = random.inCube(3);
      for (int i = 0; i < 4; ++i) {
        t[i] = near(size);
        w[i] = (first + random.inCube(angle / 2)).template cast<S>();
      }
      return std::make_shared<fcl::SplineMotion<S>>(t[0], t[1], t[2], t[3], w[0], w[1], w[2], w[3]);
    }
    default:
      if constexpr (std::is_same_v<S, double>) {
        const fcl::Transform3<S> to = pose(turned);
        if (kind == MotionKind::kScrew) return std::make_shared<fcl::ScrewMotion<S>>(from, to);
        // FCL's other constructors leave the reference point or the speeds unset.
        return std::make_shared<fcl::InterpMotion<S>>(
            from.linear(), from.translation(), to.linear(), to.translation(), random.inCube(size));
      }
      return nullptr;
  }
}

/// A spline along a line, without a turn.
template <typename S>
std::shared_ptr<fcl::MotionBase<S>> makeLinearSpline(double offset, Random& random) {
  // Whole numbers, whose differences are exact.
  const auto whole = [&] {
    return fcl::Vector3<S>(S(random.below(5)), S(random.below(5)), S(random.below(5)));
  };
  const fcl::Vector3<S> from = fcl::Vector3<S>::Constant(S(offset)) + whole(), step = whole();
  const fcl::Vector3<S> turn = random.inCube(2).template cast<S>();
  return std::make_shared<fcl::SplineMotion<S>>(from, from + step, from + S(2) * step,
                                                from + S(3) * step, turn, turn, turn, turn);
}

}  // namespace fcl_fibers::test
