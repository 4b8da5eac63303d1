// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "geometry/sphere.h"

namespace fcl_fibers::geometry {

/// The sphere to which all balls of a basis are internally tangent.
struct SupportSphere {
  Ball ball;
  /// The centre is the sum of weight[i] times the i-th ball's centre; the weights sum to 1. If no
  /// weight is negative, the sphere is the least around the basis.
  std::array<double, 4> weight;

  bool isLeast() const;
};

/// The support sphere of one to four balls. There is none if their centres are affinely dependent
/// or no sphere is tangent to all: Fischer and Gaertner, The smallest enclosing ball of balls,
/// 2003.
std::optional<SupportSphere> supportSphere(const Ball* const* balls, int count);

/// The basis of a minimum enclosing sphere: indices of the one to four balls that determine it.
struct Basis {
  std::array<int, 4> ball{};
  int size = 0;
};

struct EnclosingSphere {
  Ball ball;
  Basis basis;
};

/// The minimum enclosing sphere of `count` > 0 balls of any radii. Every ball is inside with
/// certainty; the radius is the least up to rounding.
///
/// This is an algorithm for LP-type problems (Matousek, Sharir and Welzl, 1996): the ball that
/// stands out farthest enters the basis until no ball stands out. Welzl's recursion for points
/// (1991) fails for balls.
///
/// The search begins with `start`, such as the basis of the same balls at an earlier time. These
/// balls need not be a basis any more, and `start` may be empty.
EnclosingSphere enclosingSphere(const Ball* balls, int count, const Basis& start = {});

}  // namespace fcl_fibers::geometry
