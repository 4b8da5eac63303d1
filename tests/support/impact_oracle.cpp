// SPDX-License-Identifier: BSD-3-Clause
#include "support/impact_oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/exact_geometry.h"
#include "support/exact_within.h"

namespace fcl_fibers::test {
namespace {

// --- In double ---

/// Relative to the first corner: the axis from w to w + u, and the other corners.
struct Pose {
  Vector<double> w, u, v[2] = {};
  double reach;
};

Pose poseOf(const GivenMotion& motion, const GivenInstant& i) {
  Pose pose{i.axis[0] - i.corner[0], i.axis[1] - i.axis[0], {}, 0};
  for (std::size_t k = 1; k < motion.corners; ++k) pose.v[k - 1] = i.corner[k] - i.corner[0];
  pose.reach = i.radii[0] + i.radii[1] + motion.margin;
  return pose;
}

Pose poseAt(const Pose& start, const Pose& end, double time) {
  const auto at = [time](const Vector<double>& p, const Vector<double>& q) {
    return p + time * (q - p);
  };
  return {at(start.w, end.w),
          at(start.u, end.u),
          {at(start.v[0], end.v[0]), at(start.v[1], end.v[1])},
          start.reach + time * (end.reach - start.reach)};
}

double sizeOf(const Pose& pose) {
  double size = 0;
  for (const auto& vector : {pose.w, pose.u, pose.v[0], pose.v[1]}) {
    for (const double x : vector) size += std::fabs(x);
  }
  return size;
}

/// The part of p across v. What rounding leaves along v is removed as well.
Vector<double> across(Vector<double> p, const Vector<double>& v) {
  const double length = dot(v, v);
  for (int i = 0; i < 2 && length > 0; ++i) p = p - (dot(p, v) / length) * v;
  return p;
}

/// The direction, of length at most 1, along which all of the axis lies farthest beyond all of the
/// hull. It is that between two corners, from a corner to a line, across two edges, or across the
/// hull.
class BestDirection {
 public:
  BestDirection(const Pose& pose, std::size_t corners) : pose_(pose), corners_(corners) {
    const Vector<double>& u = pose.u;
    const auto corner = [&](std::size_t k) { return k == 0 ? Vector<double>{} : pose.v[k - 1]; };
    for (std::size_t k = 0; k < corners; ++k) {
      const Vector<double> from = pose.w - corner(k);
      const Vector<double> edge = corner((k + 1) % corners) - corner(k);
      consider(across(from, u));
      for (const Vector<double>& p : {from, from + u}) {
        consider(p);
        consider(across(p, edge));
      }
      Vector<double> normal = across(cross(u, edge), u);
      normal = across(normal, across(edge, u));
      consider(normal);
      consider(-1.0 * normal);
    }
    if (corners == 3) {
      Vector<double> normal = across(cross(pose.v[0], pose.v[1]), pose.v[0]);
      normal = across(normal, across(pose.v[1], pose.v[0]));
      consider(normal);
      consider(-1.0 * normal);
    }
  }

  Vector<double> n{};

 private:
  void consider(const Vector<double>& p) {
    const double length = std::sqrt(dot(p, p)) * (1 + 4 * kEps);
    const Vector<double> m = (1 / length) * p;
    double most = 0;
    for (std::size_t k = 1; k < corners_; ++k) most = std::max(most, dot(m, pose_.v[k - 1]));
    const double gap = dot(m, pose_.w) + std::min(dot(m, pose_.u), 0.0) - most;
    // NaN, as of a length of 0, loses every comparison.
    if (!(gap > gap_)) return;
    gap_ = gap;
    n = m;
  }

  const Pose& pose_;
  std::size_t corners_;
  double gap_ = 0;
};

/// Whether the Bernstein coefficients of all gaps along a direction that turns from m to n are
/// positive.
bool areBeyond(const Pose& start, const Pose& end, const Vector<double>& m, const Vector<double>& n,
               std::size_t corners, double error) {
  const double reach = (start.reach + end.reach) / 2;
  const auto isBeyond = [&](const Vector<double>& p, const Vector<double>& q) {
    return dot(m, p) > start.reach + error && dot(n, q) > end.reach + error &&
           (dot(m, q) + dot(n, p)) / 2 > reach + error;
  };
  for (std::size_t k = 0; k < corners; ++k) {
    const Vector<double> p = k == 0 ? start.w : start.w - start.v[k - 1];
    const Vector<double> q = k == 0 ? end.w : end.w - end.v[k - 1];
    if (!isBeyond(p, q) || !isBeyond(p + start.u, q + end.u)) return false;
  }
  return true;
}

/// Differences and what is computed of them carry an error of 6 eps of the size, products with a
/// direction 4 eps more, and the reach 6 eps of what it is made of.
double errorOf(const GivenMotion& motion) {
  return 16 * kEps * (motion.size() + std::fabs(motion.margin));
}

// --- In integers ---

/// A motion in units of a power of two.
class ExactMotion {
 public:
  explicit ExactMotion(const GivenMotion& motion) : motion_(motion) {
    visit([this](double x) {
      if (x != 0) unit_ = std::min(unit_, lastBit(x));
    });
    if (unit_ == std::numeric_limits<int>::max()) unit_ = 0;
  }

  /// All lengths at a time, times 2^shift.
  /// @pre the time is a multiple of 2^-shift
  struct Lengths {
    Vector<Integer> w, u, v[2];
    Integer reach;
  };
  Lengths at(double time, int shift) const {
    const Integer part = inUnits(time, -shift), rest = (Integer(1) << shift) - part;
    const auto number = [&](double x, double y) -> Integer {
      return rest * inUnits(x, unit_) + part * inUnits(y, unit_);
    };
    const auto point = [&](const Vector<double>& p, const Vector<double>& q) -> Vector<Integer> {
      return {number(p[0], q[0]), number(p[1], q[1]), number(p[2], q[2])};
    };
    const GivenInstant &i = motion_.start, &j = motion_.end;
    const Vector<Integer> a = point(i.axis[0], j.axis[0]), c = point(i.corner[0], j.corner[0]);
    Lengths lengths{
        a - c, point(i.axis[1], j.axis[1]) - a, {}, number(motion_.margin, motion_.margin)};
    for (std::size_t k = 1; k < motion_.corners; ++k) {
      lengths.v[k - 1] = point(i.corner[k], j.corner[k]) - c;
    }
    for (std::size_t k = 0; k < 2; ++k) lengths.reach += number(i.radii[k], j.radii[k]);
    return lengths;
  }

  bool areWithin(double time) const {
    const auto [w, u, v, reach] = at(time, shiftFor(time));
    if (reach < 0) return false;
    if (segmentsWithin(w, u, v[0], reach)) return true;
    return motion_.corners == 3 &&
           (segmentsWithin(w, u, v[1], reach) || segmentsWithin(w - v[0], u, v[1] - v[0], reach) ||
            insideWithin(w, u, v[0], v[1], reach));
  }

  /// As areBeyond() in double, without error.
  bool areBeyond(double from, double to, const Vector<double>& m, const Vector<double>& n) const {
    const int shift = std::max(shiftFor(from), shiftFor(to));
    const Lengths start = at(from, shift), end = at(to, shift);
    const Vector<Integer> first = direction(m), last = direction(n);
    const Integer one = Integer(1) << kBits;
    if (dot(first, first) > one * one || dot(last, last) > one * one) return false;
    for (std::size_t k = 0; k < motion_.corners; ++k) {
      for (const bool at_end : {false, true}) {
        const auto length = [&](const Lengths& l) {
          Vector<Integer> x = at_end ? l.w + l.u : l.w;
          return k == 0 ? x : x - l.v[k - 1];
        };
        const Vector<Integer> p = length(start), q = length(end);
        if (dot(first, p) <= start.reach * one || dot(last, q) <= end.reach * one ||
            dot(first, q) + dot(last, p) <= (start.reach + end.reach) * one) {
          return false;
        }
      }
    }
    return true;
  }

 private:
  static constexpr int kBits = 64;

  static int shiftFor(double time) { return time == 0 ? 0 : std::max(0, -lastBit(time)); }
  static Vector<Integer> direction(const Vector<double>& n) {
    Vector<Integer> in_units;
    for (std::size_t i = 0; i < 3; ++i) in_units[i] = Integer(std::trunc(std::ldexp(n[i], kBits)));
    return in_units;
  }
  template <class See>
  void visit(See&& see) const {
    see(motion_.margin);
    for (const GivenInstant* i : {&motion_.start, &motion_.end}) {
      for (const auto& p : i->axis) std::for_each(p.begin(), p.end(), see);
      for (std::size_t k = 0; k < motion_.corners; ++k) {
        std::for_each(i->corner[k].begin(), i->corner[k].end(), see);
      }
      std::for_each(i->radii.begin(), i->radii.end(), see);
    }
  }

  const GivenMotion& motion_;
  int unit_ = std::numeric_limits<int>::max();
};

struct Places {
  Point a, b, c, d, e;  ///< the axis, and the corners
};

Places placesAt(const GivenMotion& motion, double time) {
  const GivenInstant &i = motion.start, &j = motion.end;
  // Differences first, so that a place far from the origin costs no precision.
  const auto point = [&](const std::array<double, 3>& p, const std::array<double, 3>& q) {
    Point relative;
    for (std::size_t k = 0; k < 3; ++k) {
      const Real start = Real(p[k]) - i.corner[0][k], last = Real(q[k]) - j.corner[0][k];
      relative[static_cast<int>(k)] = start + time * (last - start);
    }
    return relative;
  };
  return {point(i.axis[0], j.axis[0]), point(i.axis[1], j.axis[1]), Point::Zero(),
          point(i.corner[1], j.corner[1]), point(i.corner[2], j.corner[2])};
}

Real distanceOf(const GivenMotion& motion, double time) {
  const auto [a, b, c, d, e] = placesAt(motion, time);
  return motion.corners == 2 ? segmentDistance(a, b, c, d)
                             : segmentTriangleDistance(a, b, {c, d, e});
}

/// The distance of two of their points, which is that of the two unless the triangle is a needle.
Real distanceOfPoints(const GivenMotion& motion, double time) {
  if (motion.corners == 2) return distanceOf(motion, time);
  const auto [a, b, c, d, e] = placesAt(motion, time);
  const Point along = b - a, normal = d.cross(e);
  const Real area = normal.squaredNorm(), from = a.dot(normal), to = b.dot(normal);
  const auto intoUnit = [](Real t) { return t > 0 ? std::min(t, Real(1)) : 0; };
  Real least = std::min(
      {segmentDistance(a, b, c, d), segmentDistance(a, b, d, e), segmentDistance(a, b, e, c)});
  for (const Real s : {Real(0), Real(1), intoUnit(from / (from - to))}) {
    const Point p = a + s * along;
    const Real x = intoUnit(p.cross(e).dot(normal) / area);
    const Real y = std::min(intoUnit(d.cross(p).dot(normal) / area), 1 - x);
    least = std::min(least, (p - x * d - y * e).norm());
  }
  return least;
}

Real reachOf(const GivenMotion& motion, double time) {
  Real reach = motion.margin;
  for (std::size_t k = 0; k < 2; ++k) {
    const Real start = motion.start.radii[k];
    reach += start + time * (motion.end.radii[k] - start);
  }
  return reach;
}

}  // namespace

double GivenMotion::size() const {
  const Pose first = poseOf(*this, start), last = poseOf(*this, end);
  return std::max(sizeOf(first), sizeOf(last)) +
         std::max(start.radii[0] + start.radii[1], end.radii[0] + end.radii[1]);
}

ImpactOracle::Verdict ImpactOracle::apartDuring(const GivenMotion& motion, double from, double to,
                                                bool always_exact) {
  const Pose start = poseOf(motion, motion.start), end = poseOf(motion, motion.end);
  const double error = errorOf(motion);
  const ExactMotion exact(motion);
  Verdict verdict{true, always_exact};
  struct Moment {
    double time;
    Pose pose;
    Vector<double> direction;
  };
  const auto momentAt = [&](double time) -> Moment {
    const Pose pose = poseAt(start, end, time);
    return {time, pose, BestDirection(pose, motion.corners).n};
  };
  // Where double decides nothing, integers often do for a long part.
  constexpr int kDeepInDouble = 24, kDeepest = 60, kPartsInDouble = 1 << 20, kMostParts = 1 << 21;
  int parts = 0;
  // The ends of the parts that are open, the first on top, and how often each was halved.
  Moment ends[kDeepest + 2] = {momentAt(to)};
  int depths[kDeepest + 2] = {0};
  Moment first = momentAt(from);
  for (int count = 1; count > 0;) {
    const Moment& last = ends[count - 1];
    const int depth = depths[count - 1];
    const auto isParted = [&] {
      if (!always_exact && areBeyond(first.pose, last.pose, first.direction, last.direction,
                                     motion.corners, error)) {
        return true;
      }
      if (!always_exact && depth < kDeepInDouble && parts < kPartsInDouble) return false;
      verdict.exact = true;
      return exact.areBeyond(first.time, last.time, first.direction, last.direction);
    };
    if (isParted()) {
      first = last;
      --count;
      continue;
    }
    const double middle = first.time + (last.time - first.time) / 2;
    if (++parts > kMostParts || depth == kDeepest || middle <= first.time || middle >= last.time)
      return {false, true};
    depths[count - 1] = depths[count] = depth + 1;
    ends[count++] = momentAt(middle);
  }
  return verdict;
}

ImpactOracle::Verdict ImpactOracle::withinAt(const GivenMotion& motion, double time,
                                             bool always_exact) {
  // Of distances in long double, and a rounding for each of the numbers above.
  const double size = motion.size();
  const Real error = 0x1p-55L * (Real(size) + std::fabs(motion.margin));
  if (!always_exact && distanceOfPoints(motion, time) <= reachOf(motion, time) - error)
    return {true, false};
  // Where squares of lengths neither overflow nor vanish.
  if (!always_exact && size > 0x1p-150 && size < 0x1p150) {
    const Pose pose = poseAt(poseOf(motion, motion.start), poseOf(motion, motion.end), time);
    const Vector<double> n = BestDirection(pose, motion.corners).n;
    if (areBeyond(pose, pose, n, n, motion.corners, errorOf(motion))) return {false, false};
  }
  return {ExactMotion(motion).areWithin(time), true};
}

double ImpactOracle::excessAt(const GivenMotion& motion, double time) {
  return static_cast<double>(distanceOf(motion, time) - reachOf(motion, time));
}

}  // namespace fcl_fibers::test
