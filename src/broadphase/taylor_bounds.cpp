// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/taylor_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "broadphase/motion_samples.h"

namespace fcl_fibers::broadphase {

using geometry::kAxes;
using geometry::MovingSegment;
using geometry::Vec3d;

namespace {

constexpr const char* kNoTaylorModel =
    "its motion's getTaylorModel() does not set a time interval that contains [0, 1]; let it set "
    "both models";

/// A polynomial of time and a remainder that may have any value of an interval at any time.
struct Polynomial {
  double c[4] = {0, 0, 0, 0};
  double low = 0, high = 0;
  double size = 0;  ///< sum of all absolute values that were added

  template <typename S>
  void add(const fcl::TaylorModel<S>& model, double factor) {
    for (std::size_t i = 0; i < 4; ++i) {
      const double term = factor * static_cast<double>(model.coeff(i));
      c[i] += term;
      size += std::fabs(term);
    }
    const double p = factor * static_cast<double>(model.remainder()[0]);
    const double q = factor * static_cast<double>(model.remainder()[1]);
    low += std::min(p, q);
    high += std::max(p, q);
    size += std::max(std::fabs(p), std::fabs(q));
  }
  double at(double t) const { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
  /// Bounds the second derivative from time 0 to 1.
  double bend() const { return std::max(std::fabs(2 * c[2]), std::fabs(2 * c[2] + 6 * c[3])); }
};

template <typename S>
bool coversStep(const fcl::TaylorModel<S>& model) {
  const auto& interval = model.getTimeInterval();
  return interval != nullptr && interval->t_[0] <= 0 && interval->t_[1] >= 1;
}

}  // namespace

template <typename S>
const char* boundTaylorModel(const ShapeCore& core, const fcl::MotionBase<S>& motion,
                             MovingSegment& moving) {
  fcl::TMatrix3<S> rotation;
  fcl::TVector3<S> translation;
  motion.getTaylorModel(rotation, translation);
  bool is_set = true;
  for (std::size_t row = 0; row < 3; ++row) {
    is_set = is_set && coversStep(translation[row]);
    for (std::size_t column = 0; column < 3; ++column) {
      is_set = is_set && coversStep(rotation(row, column));
    }
  }
  if (!is_set) return kNoTaylorModel;
  if (!isBounded(core.box)) return boundEverywhere(moving);

  constexpr int kParts = 16;
  MotionSamples samples;
  samples.parts = kParts;
  Vec3d slack{0, 0, 0};
  for (std::size_t row = 0; row < 3; ++row) {
    const auto axis = kAxes[row];
    for (Corners& box : samples.boxes) {
      box.low.*axis = kInfinity;
      box.high.*axis = -kInfinity;
    }
    double bend = 0, size = 0;
    forEachCorner(core.box, [&](const Vec3d& p) {
      Polynomial path;
      path.add(translation[row], 1);
      for (std::size_t column = 0; column < 3; ++column) {
        path.add(rotation(row, column), p.*kAxes[column]);
      }
      for (int i = 0; i <= kParts; ++i) {
        Corners& box = samples.boxes[static_cast<std::size_t>(i)];
        const double x = path.at(static_cast<double>(i) / kParts);
        box.low.*axis = std::min(box.low.*axis, x + path.low - core.thickness);
        box.high.*axis = std::max(box.high.*axis, x + path.high + core.thickness);
      }
      bend = std::max(bend, path.bend());
      size = std::max(size, path.size);
    });
    // The models are computed in S, without outward rounding, from numbers of about their size.
    slack.*axis = kDrift * bend / (8.0 * kParts * kParts) +
                  64 * double{std::numeric_limits<S>::epsilon()} * (size + core.thickness);
  }
  moving = samples.bound(slack);
  return checked(moving);
}

template const char* boundTaylorModel(const ShapeCore&, const fcl::MotionBase<float>&,
                                      MovingSegment&);
template const char* boundTaylorModel(const ShapeCore&, const fcl::MotionBase<double>&,
                                      MovingSegment&);

}  // namespace fcl_fibers::broadphase
