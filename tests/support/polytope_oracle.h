// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace fcl_fibers::test {

/// A number as a quotient, so that integers are enough.
template <typename T>
struct Quotient {
  T above, below;  ///< below is positive
};

/// The squared distance of the origin from the hull of points, without error for integers. It is
/// the least over all corners, edges, triangles and tetrahedra of points, in time of the fourth
/// power of their number.
template <typename T>
Quotient<T> squaredDistanceToHull(const std::vector<std::array<T, 3>>& points) {
  using Vector = std::array<T, 3>;
  const auto product = [](const Vector& p, const Vector& q) {
    return T(p[0] * q[0] + p[1] * q[1] + p[2] * q[2]);
  };
  const auto crossed = [](const Vector& p, const Vector& q) {
    return Vector{T(p[1] * q[2] - p[2] * q[1]), T(p[2] * q[0] - p[0] * q[2]),
                  T(p[0] * q[1] - p[1] * q[0])};
  };
  const auto less = [](const Vector& p, const Vector& q) {
    return Vector{T(p[0] - q[0]), T(p[1] - q[1]), T(p[2] - q[2])};
  };
  Quotient<T> least{T(-1), T(1)};
  const auto consider = [&](const T& above, const T& below) {
    if (least.above < 0 || above * least.below < least.above * below) least = {above, below};
  };
  const std::size_t count = points.size();
  // What is beside their box is not within a tetrahedron.
  bool may_be_within = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bool has_low = false, has_high = false;
    for (const Vector& p : points) {
      has_low = has_low || p[axis] <= 0;
      has_high = has_high || p[axis] >= 0;
    }
    may_be_within = may_be_within && has_low && has_high;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Vector& p = points[i];
    consider(product(p, p), T(1));
    for (std::size_t j = i + 1; j < count; ++j) {
      const Vector& q = points[j];
      const Vector edge = less(q, p), moment = crossed(p, q);
      const T length = product(edge, edge);
      if (product(p, edge) < 0 && product(q, edge) > 0) consider(product(moment, moment), length);
      for (std::size_t k = j + 1; k < count; ++k) {
        const Vector& r = points[k];
        const Vector normal = crossed(edge, less(r, p));
        const T area = product(normal, normal), height = product(normal, p);
        if (!(area > 0)) continue;
        if (product(normal, moment) >= 0 && product(normal, crossed(q, r)) >= 0 &&
            product(normal, crossed(r, p)) >= 0) {
          consider(T(height * height), area);
        }
        for (std::size_t l = k + 1; may_be_within && l < count; ++l) {
          const Vector& s = points[l];
          const T at[4] = {height, T(-product(crossed(edge, less(s, p)), p)),
                           product(crossed(less(r, p), less(s, p)), p),
                           T(-product(crossed(less(r, q), less(s, q)), q))};
          const bool is_low = at[0] < 0 && at[1] < 0 && at[2] < 0 && at[3] < 0;
          const bool is_high = at[0] > 0 && at[1] > 0 && at[2] > 0 && at[3] > 0;
          if (is_low || is_high) return {T(0), T(1)};
        }
      }
    }
  }
  return least;
}

}  // namespace fcl_fibers::test
