// SPDX-License-Identifier: BSD-3-Clause
#include "support/promise.h"

#include <algorithm>
#include <limits>

namespace fcl_fibers::test {

Real volumeBand(Real extent) {
  // The last is what squares of float lose where a scene is subnormal as a whole.
  return 0x1p-20L * extent + 0x1p-1062L;
}

bool isPromised(const GivenCapsule& p, const GivenCapsule& q, Report report, LeafVolume volume,
                double margin, Real extent) {
  const ExactCapsule a = roundedCapsule(p), b = roundedCapsule(q);
  if (report == Report::kCapsules) {
    const Real lengths = (a.b - a.a).norm() + (b.b - b.a).norm();
    const bool thick = p.radius > 0 && q.radius > 0;
    const Real band =
        (thick ? 16 : 256) * Real(std::numeric_limits<double>::epsilon()) * (extent + lengths);
    constexpr Real kLeast = std::numeric_limits<double>::denorm_min();
    return TouchOracle::judge(p, q, static_cast<double>(margin + std::max(band, kLeast))).touching;
  }
  const Real gap =
      volume == LeafVolume::kBox ? boxGap(boxOf(a), boxOf(b)) : sphereGap(sphereOf(a), sphereOf(b));
  return gap <= margin + volumeBand(extent);
}

}  // namespace fcl_fibers::test
