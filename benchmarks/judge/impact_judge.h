// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <fcl_fibers/benchmark/judge.h>

namespace fcl_fibers::benchmarks {

/// A capsule during a step of which ends and radius are linear functions of the time, from 0 to 1.
struct MovingCapsule {
  Capsule start, end;

  Capsule at(double time) const {
    return {start.from + time * (end.from - start.from), start.to + time * (end.to - start.to),
            start.radius + time * (end.radius - start.radius)};
  }
};

/// Whether two capsules touch during a step. If they do, the first touch is after `from` or at it,
/// and not after `to`.
struct JudgedImpact {
  Contact contact;
  double from, to;
};

/// The distance of two capsules, less than 0 where they touch. It changes no faster than by
/// `speed` per unit of time: points of two axes part no faster than some ends of these do. So what
/// is far enough apart at a time is apart for some time before and after it. Halves the rest again
/// and again, the earliest first. Shares no code with the library, which it judges.
inline JudgedImpact judgeImpact(const MovingCapsule& a, const MovingCapsule& b) {
  constexpr double kBand = 1e-9;  // as contact()
  constexpr double kShortest = 0x1p-30;
  constexpr int kMostTests = 100000;
  const double band =
      kBand * std::max(a.start.radius + b.start.radius, a.end.radius + b.end.radius);
  const auto gap = [&](double time) {
    const Capsule p = a.at(time), q = b.at(time);
    return segmentDistance(p.from, p.to, q.from, q.to) - (p.radius + q.radius);
  };
  double speed = 0;
  for (const fcl::Vector3d& p :
       {fcl::Vector3d(a.end.from - a.start.from), fcl::Vector3d(a.end.to - a.start.to)}) {
    speed = std::max(
        {speed, (p - (b.end.from - b.start.from)).norm(), (p - (b.end.to - b.start.to)).norm()});
  }
  speed += std::abs(a.end.radius - a.start.radius + b.end.radius - b.start.radius);

  struct Interval {
    double from, to;
  };
  std::vector<Interval> rest = {{0, 1}};
  double undecided = 2;  // where the first interval begins that is neither
  double touching = 2;
  if (gap(0) < -band) return {Contact::kTouching, 0, 0};
  if (gap(1) < -band) touching = 1;
  for (int tests = 0; !rest.empty() && tests < kMostTests; ++tests) {
    const Interval interval = rest.back();
    rest.pop_back();
    const double middle = 0.5 * (interval.from + interval.to), half = middle - interval.from;
    const double found = gap(middle);
    if (found > speed * half + band) continue;
    if (found < -band) {
      touching = middle;
      rest.clear();  // what is later
    }
    if (half < kShortest) {
      undecided = std::min(undecided, interval.from);
      if (touching <= 1) break;
      continue;
    }
    if (touching > middle) rest.push_back({middle, interval.to});
    rest.push_back({interval.from, middle});
  }
  if (!rest.empty()) undecided = std::min(undecided, rest.back().from);
  if (touching > 1) return {undecided > 1 ? Contact::kApart : Contact::kBoundary, undecided, 1};
  return {Contact::kTouching, std::min(undecided, touching), touching};
}

}  // namespace fcl_fibers::benchmarks
