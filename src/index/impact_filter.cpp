// SPDX-License-Identifier: BSD-3-Clause
#include "index/impact_filter.h"

#include <algorithm>

#include "geometry/rounding.h"

namespace fcl_fibers::index {

using geometry::Impact;
using geometry::MovingSegment;
using tree::Pair;

ImpactFilter::ImpactFilter(MovingRange a, MovingRange b, const geometry::FrameChange* b_to_a,
                           double margin, double unit, double error, const PairFilter* wanted)
    : a_(a), b_(b), b_to_a_(b_to_a), margin_(margin), unit_(unit), error_(error), wanted_(wanted) {
  const double most = a.mostError() + std::max(b.mostError(), error);
  if (b_to_a == nullptr && geometry::ImpactPairs::isSmall(unit * most)) error_of_all_ = most;
}

ImpactFilter::Motions ImpactFilter::motionsOf(const Pair& pair) const {
  const MovingSegment p = a_[pair.a], q = b_[pair.b];
  const double p_error = endPointError(p);
  if (b_to_a_ == nullptr) return {p, q, p_error + std::max(endPointError(q), error_)};
  const MovingSegment moved{(*b_to_a_)(q.start), (*b_to_a_)(q.end)};
  return {p, moved, p_error + std::max(b_to_a_->error(moved.start), b_to_a_->error(moved.end))};
}

std::size_t ImpactFilter::keep(Pair* pairs, std::size_t count, std::vector<Impact>& impacts) const {
  Pair waiting[geometry::kImpactsAtOnce];
  geometry::ImpactQuery queries[geometry::kImpactsAtOnce];
  Impact found[geometry::kImpactsAtOnce];
  int waits = 0;
  std::size_t kept = 0;
  const auto decide = [&] {
    for (auto rest = geometry::findImpacts(queries, waits, found); rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      impacts.push_back(found[i]);
      pairs[kept++] = waiting[i];
    }
    waits = 0;
  };
  const auto take = [&](const Pair& pair, const Motions& motions, double from) {
    waiting[waits] = pair;
    queries[waits++] = {motions.p, motions.q, margin_, motions.error, from};
    if (waits == geometry::kImpactsAtOnce) decide();
  };
  forEachUndecided(pairs, count, impacts, take);
  decide();
  return kept;
}

void FirstTime::add(double time) {
  double first = get();
  while (time < first && !first_.compare_exchange_weak(first, time)) {
  }
  // Another thread may just have written a later time, which costs time and no impact.
  until_.store(geometry::roundedUp(get()), std::memory_order_relaxed);
}

std::size_t FirstImpact::keep(Pair* pairs, std::size_t count, std::vector<Impact>& impacts) const {
  const auto take = [&](const Pair& /*pair*/, const ImpactFilter::Motions& m, double from) {
    Impact impact;
    if (from < first_.get() && findApproach(m.p, m.q, filter_.margin(), m.error, from, impact)) {
      first_.add(impact.time);
    }
  };
  filter_.forEachUndecided(pairs, count, impacts, take);
  return 0;
}

}  // namespace fcl_fibers::index
