// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

namespace fcl_fibers::test {

/// The least value of a convex function over [0, 1], by golden sections.
template <class F>
long double leastOfConvex(F&& f) {
  constexpr long double kSection = 0.618033988749894848204586834365638L;
  long double low = 0, high = 1, p = 1 - kSection, q = kSection;
  long double at_p = f(p), at_q = f(q);
  // Which leaves 2^-62 of the interval.
  for (int i = 0; i < 90; ++i) {
    if (at_p <= at_q) {
      high = q, q = p, at_q = at_p;
      p = high - kSection * (high - low), at_p = f(p);
    } else {
      low = p, p = q, at_p = at_q;
      q = low + kSection * (high - low), at_q = f(q);
    }
  }
  return std::fmin(std::fmin(at_p, at_q), std::fmin(f(0.0L), f(1.0L)));
}

}  // namespace fcl_fibers::test
