// SPDX-License-Identifier: BSD-3-Clause
#include "judge/exact_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include <fcl_fibers/benchmark/judge.h>

#include "support/exact_numbers.h"

namespace fcl_fibers::benchmarks {
namespace {

// Differences of coordinates and products of two of them are exact, unless coordinates are 10^25
// times as large as the capsules.
using Number = boost::multiprecision::number<
    boost::multiprecision::cpp_bin_float<300, boost::multiprecision::digit_base_2>,
    boost::multiprecision::et_off>;
using NumberVector = test::Vector<Number>;
using test::cross, test::dot, test::operator+, test::operator-, test::operator*;

Number intoUnit(const Number& x) { return x < 0 ? Number(0) : x > 1 ? Number(1) : x; }

NumberVector numbers(const fcl::Vector3d& p) { return {Number(p[0]), Number(p[1]), Number(p[2])}; }

NumberVector halfAxis(const PosedCapsule& c) {
  return Number(Number(c.length) / 2) * numbers(c.axis);
}

ExactVector rounded(const NumberVector& p) {
  return {static_cast<Exact>(p[0]), static_cast<Exact>(p[1]), static_cast<Exact>(p[2])};
}

/// The closest points of the segments from 0 to u and from w to w + v.
struct Closest {
  Number s;
  NumberVector apart;
  Number squared;
};

Closest closestPoints(const NumberVector& w, const NumberVector& u, const NumberVector& v) {
  const Number uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const NumberVector normal = cross(u, v);
  const Number normal2 = dot(normal, normal);
  Closest best{0, w, dot(w, w)};
  const auto take = [&](const Number& s, const Number& t) {
    const NumberVector apart = w + t * v - s * u;
    const Number squared = dot(apart, apart);
    if (squared < best.squared) best = {s, apart, squared};
  };
  // Either at an end of one of the two, or where the common perpendicular meets both.
  for (const int end : {0, 1}) {
    if (vv > 0) take(end, intoUnit((end * uv - vw) / vv));
    if (uu > 0) take(intoUnit((uw + end * uv) / uu), end);
  }
  if (normal2 > 0) {
    const Number s = dot(cross(w, v), normal) / normal2, t = dot(cross(w, u), normal) / normal2;
    if (s > 0 && s < 1 && t > 0 && t < 1) take(s, t);
  }
  return best;
}

/// By a plane across the line between an end of one axis and the nearest point of the other, or
/// across the common perpendicular.
bool certainlyApart(const PosedCapsule& a, const PosedCapsule& b) {
  // Differences first, so that a place far from the origin costs no precision.
  const fcl::Vector3d half_a = a.length / 2 * a.axis, half_b = b.length / 2 * b.axis;
  const fcl::Vector3d w = b.centre - a.centre, a0 = -half_a, b0 = w - half_b, b1 = w + half_b;
  const double size = w.norm() + 2 * (half_a.norm() + half_b.norm());
  const double reach = (a.radius + b.radius) * 1.001 + 1e-13 * size;
  fcl::Vector3d apart = b0 - closestPoint(a0, half_a, b0);
  const auto take = [&](const fcl::Vector3d& other) {
    if (other.squaredNorm() < apart.squaredNorm()) apart = other;
  };
  take(b1 - closestPoint(a0, half_a, b1));
  take(closestPoint(b0, b1, a0) - a0);
  take(closestPoint(b0, b1, half_a) - half_a);
  for (const fcl::Vector3d& across : {apart, fcl::Vector3d(half_a.cross(half_b))}) {
    const double gap =
        std::fabs(across.dot(w)) - std::fabs(across.dot(half_a)) - std::fabs(across.dot(half_b));
    if (gap > reach * across.norm()) return true;
  }
  return false;
}

}  // namespace

std::optional<ExactContact> ExactContact::of(const PosedCapsule& a, const PosedCapsule& b) {
  if (certainlyApart(a, b)) return std::nullopt;
  const NumberVector half_a = halfAxis(a), half_b = halfAxis(b);
  const NumberVector from_a = numbers(a.centre) - half_a;
  const NumberVector from_b = numbers(b.centre) - half_b;
  const NumberVector w = from_b - from_a;
  const NumberVector u = Number(2) * half_a, v = Number(2) * half_b;
  const Closest closest = closestPoints(w, u, v);
  const Number axis_distance = sqrt(closest.squared), radii = Number(a.radius) + Number(b.radius);
  ExactContact contact;
  contact.origin_ = rounded(from_a);
  contact.w_ = rounded(w);
  contact.u_ = rounded(u);
  contact.v_ = rounded(v);
  contact.radius_a_ = a.radius;
  contact.radius_b_ = b.radius;
  contact.s_ = static_cast<Exact>(closest.s);
  contact.axis_distance_ = static_cast<Exact>(axis_distance);
  contact.distance_ = static_cast<Exact>(Number(axis_distance - radii));
  contact.touching_ = closest.squared <= radii * radii;
  contact.apart_.setZero();
  if (axis_distance > 0) {
    contact.apart_ = rounded(Number(1 / axis_distance) * closest.apart);
  }
  return contact;
}

Exact ExactContact::angleTo(const fcl::Vector3d& normal) const {
  const ExactVector n = normal.cast<Exact>();
  return std::atan2(n.cross(apart_).norm(), n.dot(apart_));
}

Exact ExactContact::wayBeyond(const fcl::Vector3d& normal) const {
  const ExactVector n = normal.cast<Exact>().normalized();
  const Exact of_a = std::max<Exact>(0, n.dot(u_));
  const Exact of_b = n.dot(w_) + std::min<Exact>(0, n.dot(v_));
  return of_a - of_b + axis_distance_;
}

Exact ExactContact::placeOnB(Exact s) const {
  const Exact vv = v_.squaredNorm();
  return vv > 0 ? std::clamp<Exact>((s * u_ - w_).dot(v_) / vv, 0, 1) : 0;
}

Exact ExactContact::squaredGapAt(Exact s) const {
  return (w_ + placeOnB(s) * v_ - s * u_).squaredNorm();
}

/// Between the axes, relative to origin_.
ExactVector ExactContact::middleAt(Exact s) const { return (s * u_ + w_ + placeOnB(s) * v_) / 2; }

Exact ExactContact::distanceTo(const fcl::Vector3d& point) const {
  // A thicker capsule moves the middle of the surfaces away from that of the axes.
  const Exact moved = (radius_a_ - radius_b_) / 2;
  const Exact rounding = 64 * Exact(std::numeric_limits<double>::epsilon()) * size();
  const bool axes_meet = axis_distance_ <= rounding;
  ExactVector p = point.cast<Exact>() - origin_;
  if (!axes_meet) p -= moved * apart_;
  // The squared gap is convex along a, so the right places are an interval around s_.
  const Exact enough = axis_distance_ + rounding;
  const auto edge = [&](Exact outside) {
    Exact inside = s_;
    if (squaredGapAt(outside) <= enough * enough) return outside;
    for (int i = 0; i < 64; ++i) {
      const Exact middle = (inside + outside) / 2;
      (squaredGapAt(middle) <= enough * enough ? inside : outside) = middle;
    }
    return inside;
  };
  // Their middles are a straight line on either side of s_. Where the place on b stays at one of
  // its ends it may bend, but such an interval is no longer than the root of that rounding.
  const std::array<Exact, 3> ends = {edge(0), s_, edge(1)};
  Exact least = std::numeric_limits<Exact>::infinity();
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const ExactVector from = middleAt(ends[i]), along = middleAt(ends[i + 1]) - from;
    const Exact squared = along.squaredNorm();
    const Exact x = squared > 0 ? std::clamp<Exact>((p - from).dot(along) / squared, 0, 1) : 0;
    least = std::min(least, (p - from - x * along).norm());
  }
  // Where axes meet it is moved to one side or another.
  return axes_meet ? std::fabs(least - std::fabs(moved)) : least;
}

}  // namespace fcl_fibers::benchmarks
