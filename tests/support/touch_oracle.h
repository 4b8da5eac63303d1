// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace fcl_fibers::test {

/// A capsule by the numbers that a program gave, each of them taken as exact: all points within
/// `radius` of the segment from a - (length / 2) axis to b + (length / 2) axis. Arrays give a and b
/// and leave length 0; the capsule of an FCL object has a = b, its centre. Or a rounded cone: the
/// hull of two balls, of which the first one has that radius.
struct GivenCapsule {
  std::array<double, 3> a, b;
  double radius = 0;
  double length = 0;
  std::array<double, 3> axis = {0, 0, 0};
  double radius_of_second = -1;  ///< of the balls of a rounded cone; negative if it is the same

  double radiusAtB() const { return radius_of_second < 0 ? radius : radius_of_second; }
  bool isTapered() const { return radiusAtB() != radius; }
};

/// What touches, without error: the squared distance of two segments is rational in their
/// coordinates. Most pairs are decided in double, by two points that are certainly near enough or a
/// plane that certainly parts them, the others in integers of any size. The distance of rounded
/// cones has square roots: they are decided by two balls and a plane in long double, or in 100
/// digits, where 2^-200 of their size counts as contact. Shares nothing with the library.
class TouchOracle {
 public:
  explicit TouchOracle(std::vector<GivenCapsule> capsules);

  std::size_t size() const { return capsules_.size(); }
  const GivenCapsule& operator[](std::size_t i) const { return capsules_[i]; }

  /// Whether capsules i and j are at most `margin` apart; exactly as far counts.
  bool touch(std::size_t i, std::size_t j, double margin = 0) const {
    return !certainlyApart(i, j, margin) && judge(capsules_[i], capsules_[j], margin).touching;
  }

  /// Calls take(i, j, verdict) for each i < j but those whose enclosing spheres are certainly more
  /// than `margin` apart.
  struct Verdict {
    bool touching;
    bool exact;     ///< decided in integers or 100 digits
    double excess;  ///< distance of the segments less radii and margin, rounded
    double reach;   ///< radii and margin, of cones the larger radii
  };
  template <class Take>
  void visitNearPairs(double margin, Take&& take) const {
    for (std::size_t i = 0; i < size(); ++i) {
      for (std::size_t j = i + 1; j < size(); ++j) {
        if (certainlyApart(i, j, margin)) continue;
        take(i, j, judge(capsules_[i], capsules_[j], margin));
      }
    }
  }

  static Verdict judge(const GivenCapsule& p, const GivenCapsule& q, double margin);

  /// What judge() falls back on. `margin` may be negative.
  static bool touchExactly(const GivenCapsule& p, const GivenCapsule& q, double margin);

 private:
  /// A sphere around a capsule, rounding included.
  struct Enclosing {
    double x, y, z, radius;
  };

  bool certainlyApart(std::size_t i, std::size_t j, double margin) const {
    const Enclosing &p = spheres_[i], &q = spheres_[j];
    const double x = p.x - q.x, y = p.y - q.y, z = p.z - q.z;
    const double reach = p.radius + q.radius + margin;
    // The last term covers what underflows.
    return x * x + y * y + z * z > reach * reach * (1 + 0x1p-40) + 0x1p-900;
  }

  std::vector<GivenCapsule> capsules_;
  std::vector<Enclosing> spheres_;
};

}  // namespace fcl_fibers::test
