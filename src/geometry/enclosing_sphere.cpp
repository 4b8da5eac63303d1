// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/enclosing_sphere.h"

#include <algorithm>
#include <bitset>
#include <cassert>
#include <cmath>
#include <limits>

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// Weights this far below 0 count as rounding. A sphere may be too small by this part of its basis'
/// extent, because in the end it grows to enclose everything.
constexpr double kWeightTolerance = 1e-9;

/// During the search, balls that stand out by less than this, relative to the sphere, count as
/// enclosed.
constexpr double kOutTolerance = 64 * kEps;

/// Solves the symmetric positive definite systems G x = p and G y = q of size n <= 3 by Gaussian
/// elimination, which then needs no pivoting. Returns false if G is singular to working precision.
bool solveSpd(double (&g)[3][3], double (&p)[3], double (&q)[3], int n) {
  constexpr double kSingular = 1e-14;
  double diagonal[3];
  for (int i = 0; i < n; ++i) diagonal[i] = g[i][i];
  for (int k = 0; k < n; ++k) {
    if (!(g[k][k] > kSingular * diagonal[k])) return false;
    for (int i = k + 1; i < n; ++i) {
      const double factor = g[i][k] / g[k][k];
      for (int j = k; j < n; ++j) g[i][j] -= factor * g[k][j];
      p[i] -= factor * p[k];
      q[i] -= factor * q[k];
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    for (int j = k + 1; j < n; ++j) {
      p[k] -= g[k][j] * p[j];
      q[k] -= g[k][j] * q[j];
    }
    p[k] /= g[k][k];
    q[k] /= g[k][k];
  }
  return true;
}

/// The ball that stands out farthest from `center`, and the distance of its far side.
struct Farthest {
  int ball;
  double reach;
};

Farthest farthestFrom(const Vec3d& center, const Ball* balls, int count) {
  Farthest farthest{0, -1};
  for (int i = 0; i < count; ++i) {
    const double squared = squaredNorm(balls[i].center - center);
    // The square root is taken only for a new farthest ball.
    const double slack = farthest.reach - balls[i].radius;
    if (slack < 0 || squared > slack * slack) {
      const double reach = std::sqrt(squared) + balls[i].radius;
      if (reach > farthest.reach) farthest = {i, reach};
    }
  }
  return farthest;
}

bool encloses(const Ball& outer, const Ball& inner) {
  return norm(inner.center - outer.center) + inner.radius <= outer.radius * (1 + kOutTolerance);
}

/// The minimum enclosing sphere of the start's balls and one more, which is in the new basis.
/// Subsets are tried from small to large. The first one whose least sphere encloses the rest is the
/// basis. Rounding may let no subset pass, for instance among nearly collinear centres. Then the
/// result is the sphere that must grow least to enclose all.
std::optional<EnclosingSphere> withBall(const Ball* balls, const Basis& start, int entering) {
  std::array<Ball, 5> all;
  int all_count = 0;
  all[0] = balls[entering];
  for (++all_count; all_count <= start.size; ++all_count) {
    const auto i = static_cast<std::size_t>(all_count);
    all[i] = balls[start.ball[i - 1]];
  }

  std::optional<EnclosingSphere> best;
  for (int size = 0; size <= std::min(start.size, 3); ++size) {
    for (unsigned long subset = 0; subset < (1ul << start.size); ++subset) {
      const std::bitset<4> kept(subset);
      if (kept.count() != static_cast<std::size_t>(size)) continue;
      Basis basis{{entering}, 1};
      for (std::size_t i = 0; i < start.ball.size(); ++i) {
        if (kept[i]) basis.ball[static_cast<std::size_t>(basis.size++)] = start.ball[i];
      }
      const Ball* members[4];
      for (std::size_t i = 0; i < 4; ++i) members[i] = &balls[basis.ball[i]];

      const std::optional<SupportSphere> support = supportSphere(members, basis.size);
      if (!support) continue;
      const Vec3d& center = support->ball.center;
      const double reach = farthestFrom(center, all.data(), all_count).reach;
      // The rounding of the centre grows with its distance from the origin.
      const double rounding = kOutTolerance * support->ball.radius + 4 * kEps * maxNorm(center);
      if (support->isLeast() && reach <= support->ball.radius + rounding) {
        return EnclosingSphere{support->ball, basis};
      }
      if (!best || reach < best->ball.radius) best = EnclosingSphere{{center, reach}, basis};
    }
  }
  return best;
}

}  // namespace

bool SupportSphere::isLeast() const {
  return *std::min_element(weight.begin(), weight.end()) >= -kWeightTolerance;
}

std::optional<SupportSphere> supportSphere(const Ball* const* balls, int count) {
  assert(count >= 1 && count <= 4);
  // Coordinates are relative to the first ball's centre. Tangency to ball i is |x - q_i| = rho -
  // r_i. The same for ball 0, subtracted, makes it linear: q_i . x = b_i + rho a_i. With x = f +
  // rho e in the span of the q_i, tangency to ball 0 is a quadratic equation for rho.
  const Ball& base = *balls[0];
  if (count == 1) return SupportSphere{base, {1, 0, 0, 0}};

  const int n = count - 1;
  Vec3d q[3];
  double a[3] = {}, b[3] = {}, gram[3][3] = {};
  double largest_radius = base.radius;
  for (int i = 0; i < n; ++i) {
    const Ball& ball = *balls[i + 1];
    q[i] = ball.center - base.center;
    a[i] = ball.radius - base.radius;
    b[i] = (squaredNorm(q[i]) - a[i] * (ball.radius + base.radius)) / 2;
    largest_radius = std::max(largest_radius, ball.radius);
    for (int j = 0; j <= i; ++j) gram[i][j] = gram[j][i] = dot(q[i], q[j]);
  }
  if (!solveSpd(gram, b, a, n)) return std::nullopt;
  Vec3d f{0, 0, 0}, e{0, 0, 0};
  for (int i = 0; i < n; ++i) {
    f = f + b[i] * q[i];
    e = e + a[i] * q[i];
  }

  // (1 - |e|^2) rho^2 - 2 (r_0 + e.f) rho + r_0^2 - |f|^2 = 0
  const double quadratic = 1 - squaredNorm(e);
  const double half_linear = base.radius + dot(e, f);
  const double constant = base.radius * base.radius - squaredNorm(f);
  double root[2];
  if (std::fabs(quadratic) < kOutTolerance) {
    if (half_linear == 0) return std::nullopt;
    root[0] = root[1] = constant / (2 * half_linear);
  } else {
    const double discriminant = half_linear * half_linear - quadratic * constant;
    if (discriminant < 0) return std::nullopt;
    // The root without cancellation first, then the other from the product of both.
    const double sum = half_linear + std::copysign(std::sqrt(discriminant), half_linear);
    root[0] = sum / quadratic;
    root[1] = sum == 0 ? root[0] : constant / sum;
    if (root[0] > root[1]) std::swap(root[0], root[1]);
  }
  const double least = largest_radius * (1 - kOutTolerance);
  const double rho = root[0] >= least ? root[0] : root[1];
  if (!(rho >= least) || !std::isfinite(rho)) return std::nullopt;

  SupportSphere support{{base.center + f + rho * e, rho}, {1, 0, 0, 0}};
  for (int i = 0; i < n; ++i) {
    const double weight = b[i] + rho * a[i];
    support.weight[static_cast<std::size_t>(i) + 1] = weight;
    support.weight[0] -= weight;
  }
  return support;
}

EnclosingSphere enclosingSphere(const Ball* balls, int count, const Basis& start) {
  assert(count > 0);
  const int first = start.size > 0 ? start.ball[0] : 0;
  EnclosingSphere sphere{balls[first], {{first}, 1}};
  for (int i = 1; i < start.size; ++i) {
    const int entering = start.ball[static_cast<std::size_t>(i)];
    if (encloses(sphere.ball, balls[entering])) continue;
    if (auto grown = withBall(balls, sphere.basis, entering)) sphere = *grown;
  }
  Farthest farthest = farthestFrom(sphere.ball.center, balls, count);
  while (farthest.reach > sphere.ball.radius * (1 + kOutTolerance)) {
    const auto grown = withBall(balls, sphere.basis, farthest.ball);
    // The radius of the basis grows strictly, so no basis comes twice. If rounding has stopped it,
    // the sphere is the least to working precision.
    if (!grown || !(grown->ball.radius > sphere.ball.radius)) break;
    sphere = *grown;
    farthest = farthestFrom(sphere.ball.center, balls, count);
  }
  sphere.ball.radius = std::max(farthest.reach, sphere.ball.radius) * (1 + 16 * kEps);
  return sphere;
}

}  // namespace fcl_fibers::geometry
