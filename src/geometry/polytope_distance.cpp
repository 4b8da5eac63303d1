// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/polytope_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "geometry/double_double.h"
#include "geometry/least_distance.h"
#include "geometry/polytope_vertices.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// Bounds the rounding of a difference, and of its product with a unit vector, in double for a pair
/// of size m: 7 eps m of the difference, 16 eps m of the least product.
double roundingFor(double m) { return 64 * kEps * m; }

enum class Verdict { kWithin, kApart, kOpen };

/// The search for the shortest of the differences between the points of an axis and those of a
/// polytope, which fill a polytope themselves: Gilbert, Johnson and Keerthi, 1988. At each step a
/// mean of up to four of its corners bounds the distance from above. The corner that is least along
/// that mean bounds it from below, whatever the mean is, and joins them. So it does not matter for
/// an answer how exactly a mean is the shortest of its corners.
template <typename T>
class DifferenceSearch {
 public:
  /// @param m  see sizeOfPair()
  DifferenceSearch(const Segment& axis, const Obstacle& polytope, double m)
      : polytope_(polytope),
        ends_{difference<T>(axis.a, polytope.point), difference<T>(axis.b, polytope.point)},
        half_exponent_(halfExponentOf(polytope)),
        rounding_(T(roundingFor(m)) * T(std::is_same_v<T, double> ? 1.0 : 0x1p-52)) {}

  /// Starts with the corner that is nearest to the origin along the way between the middles.
  void start() {
    const PolytopeVertices& all = *polytope_.vertices;
    const Vec3<T> middle = T(0.5) * (posed(all[0]) + posed(all[all.count() / 2]));
    mean_ = T(0.5) * (ends_[0] + ends_[1]) - middle;
    if (!(squaredNorm(mean_) > T(0))) mean_ = {T(1), T(0), T(0)};
    take(leastAlongMean());
    shorten();
  }
  /// Starts at the corners with which a search in less precision has ended.
  void startAt(const DifferenceSearch<double>& other) {
    for (int i = 0; i < other.count(); ++i) take(corner(other.vertex(i), other.end(i)));
    shorten();
  }

  Verdict decide(double reach) {
    const T limit = T(reach) * T(reach);
    for (int step = 0; step < kMostSteps; ++step) {
      if (squared_ <= limit) return Verdict::kWithin;
      const Corner least = leastAlongMean();
      const T slack = rounding_ * T(std::sqrt(double(squared_)));
      const T beyond = least_along_ - slack;
      if (beyond > T(0) && beyond * beyond > limit * squared_) return Verdict::kApart;
      if (squared_ - least_along_ <= slack || !joins(least)) break;
    }
    return Verdict::kOpen;
  }
  /// Goes on until rounding is all that is left to gain.
  void finish() {
    for (int step = 0; step < kMostSteps; ++step) {
      const Corner least = leastAlongMean();
      if (squared_ - least_along_ <= rounding_ * T(std::sqrt(double(squared_))) || !joins(least)) {
        break;
      }
    }
  }

  int count() const { return count_; }
  std::size_t vertex(int i) const { return corners_[i].vertex; }
  int end(int i) const { return corners_[i].end; }
  double squared() const { return double(squared_); }
  /// The least product of a difference with the mean.
  double leastAlong() const { return double(least_along_); }
  Vec3d mean() const { return {double(mean_.x), double(mean_.y), double(mean_.z)}; }
  double s() const {
    T sum(0);
    for (int i = 0; i < count_; ++i) sum = sum + (corners_[i].end == 0 ? T(0) : weight_[i]);
    return double(clampedToUnit(sum));
  }

 private:
  /// Far more than double needs for thousands of vertices.
  static constexpr int kMostSteps = 128;
  static constexpr int kMost = 4;

  /// A point of the axis less one of the polytope, each at an end.
  struct Corner {
    Vec3<T> at;
    std::size_t vertex;
    int end;
  };

  /// In a tiny scene the columns of the pose are huge and the vertices tiny, so that the mean in
  /// the polytope's own axes could overflow. Half of the exponent keeps it and its products with
  /// the vertices in range.
  static int halfExponentOf(const Obstacle& polytope) {
    const Vec3d(&v)[3] = polytope.vector;
    int exponent = 0;
    std::frexp(std::max({maxNorm(v[0]), maxNorm(v[1]), maxNorm(v[2])}), &exponent);
    return exponent / 2;
  }

  Vec3<T> posed(const Vec3d& p) const {
    const Vec3d(&v)[3] = polytope_.vector;
    const auto row = [&](double Vec3d::*axis) {
      return T(v[0].*axis) * T(p.x) + T(v[1].*axis) * T(p.y) + T(v[2].*axis) * T(p.z);
    };
    return {row(&Vec3d::x), row(&Vec3d::y), row(&Vec3d::z)};
  }
  Corner corner(std::size_t vertex, int end) const {
    return {ends_[end] - posed((*polytope_.vertices)[vertex]), vertex, end};
  }

  Corner leastAlongMean() {
    const Vec3d(&v)[3] = polytope_.vector;
    const double down = std::ldexp(1.0, -half_exponent_), up = std::ldexp(1.0, half_exponent_);
    const auto across = [&](const Vec3d& column) {
      const Vec3d c = down * column;
      return T(c.x) * mean_.x + T(c.y) * mean_.y + T(c.z) * mean_.z;
    };
    const Vec3<T> along{across(v[0]), across(v[1]), across(v[2])};
    T most;
    const std::size_t vertex = furthest(*polytope_.vertices, along, most);
    most = T(up) * most;
    const T a = dot(mean_, ends_[0]), b = dot(mean_, ends_[1]);
    const int end = b < a ? 1 : 0;
    least_along_ = (end == 0 ? a : b) - most;
    return corner(vertex, end);
  }
  static std::size_t furthest(const PolytopeVertices& vertices, const Vec3<double>& along,
                              double& most) {
    const PolytopeVertices::Extreme found = vertices.furthest(along);
    most = found.product;
    return found.vertex;
  }
  static std::size_t furthest(const PolytopeVertices& vertices, const Vec3<DoubleDouble>& along,
                              DoubleDouble& most) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < vertices.count(); ++i) {
      const Vec3d p = vertices[i];
      const DoubleDouble product = along.x * p.x + along.y * p.y + along.z * p.z;
      if (i > 0 && product <= most) continue;
      most = product;
      found = i;
    }
    return found;
  }

  void take(const Corner& corner) { corners_[count_++] = corner; }

  /// Takes one more corner.
  /// @return whether that has made the mean shorter
  bool joins(const Corner& corner) {
    if (count_ == kMost) return false;  // The origin is within the four.
    const T before = squared_;
    take(corner);
    shorten();
    return squared_ < before;
  }

  /// Makes the mean the shortest of its corners, and drops those that have no weight. Rounding may
  /// spoil the weights of some corners. Then the shortest mean of fewer of them counts.
  void shorten() {
    int best = 0;
    T weight[kMost], best_weight[kMost] = {};
    for (int set = 1; set < 1 << count_; ++set) {
      int chosen[kMost] = {}, size = 0;
      for (int i = 0; i < count_; ++i) {
        if ((set >> i & 1) != 0) chosen[size++] = i;
      }
      if (!weigh(chosen, size, weight)) continue;
      const Vec3<T>& base = corners_[chosen[0]].at;
      Vec3<T> mean = base;
      for (int i = 1; i < size; ++i) {
        mean = mean + weight[i] * (corners_[chosen[i]].at - base);
      }
      const T squared = squaredNorm(mean);
      if (best != 0 && !(squared < squared_)) continue;
      best = set;
      mean_ = mean;
      squared_ = squared;
      std::copy_n(weight, size, best_weight);
    }
    int kept = 0;
    for (int i = 0; i < count_; ++i) {
      if ((best >> i & 1) == 0) continue;
      corners_[kept] = corners_[i];
      weight_[kept] = best_weight[kept];
      ++kept;
    }
    count_ = kept;
  }

  /// The weights of the shortest mean of the line, plane or space through some corners.
  /// @return whether it is between them for certain
  bool weigh(const int (&chosen)[kMost], int size, T (&weight)[kMost]) const {
    const Vec3<T>& base = corners_[chosen[0]].at;
    const Vec3<T> to_origin = T(-1) * base;
    Vec3<T> way[kMost];
    for (int i = 1; i < size; ++i) way[i] = corners_[chosen[i]].at - base;
    T divisor(1), rest;
    if (size == 2) {
      divisor = squaredNorm(way[1]);
      weight[1] = dot(to_origin, way[1]);
    } else if (size == 3) {
      const Vec3<T> normal = cross(way[1], way[2]);
      divisor = squaredNorm(normal);
      weight[1] = dot(cross(to_origin, way[2]), normal);
      weight[2] = dot(cross(way[1], to_origin), normal);
    } else if (size == 4) {
      const Vec3<T> normal = cross(way[2], way[3]);
      divisor = dot(way[1], normal);
      weight[1] = dot(to_origin, normal);
      weight[2] = dot(to_origin, cross(way[3], way[1]));
      weight[3] = dot(to_origin, cross(way[1], way[2]));
      if (divisor < T(0)) {
        divisor = T(-1) * divisor;
        for (int i = 1; i < size; ++i) weight[i] = T(-1) * weight[i];
      }
    }
    if (!(divisor > T(0))) return false;
    rest = T(1);
    for (int i = 1; i < size; ++i) {
      weight[i] = weight[i] / divisor;
      if (!(weight[i] > T(0))) return false;
      rest = rest - weight[i];
    }
    weight[0] = rest;
    return rest > T(0);
  }

  const Obstacle& polytope_;
  const Vec3<T> ends_[2];    ///< of the axis, relative to the polytope's point
  const int half_exponent_;  ///< of the columns of the pose
  const T rounding_;
  Corner corners_[kMost];
  T weight_[kMost] = {};
  int count_ = 0;
  Vec3<T> mean_;
  T squared_, least_along_;
};

bool isWellScaled(double m) { return m > 0x1p-150 && m < 0x1p150; }

}  // namespace

double sizeOfPair(const Segment& axis, const Obstacle& polytope) {
  return norm1(axis.a - polytope.point) + norm1(axis.b - polytope.point) +
         2 * norm1(reachOfVectors(polytope));
}

double scaleOfPair(const Segment& axis, const Obstacle& polytope) {
  const double m = sizeOfPair(axis, polytope);
  if (isWellScaled(m)) return 1;
  if (!(m > 0 && std::isfinite(m))) return 0;
  return scaleForSize(m, std::max({maxNorm(axis.a), maxNorm(axis.b), maxNorm(polytope.point),
                                   norm1(reachOfVectors(polytope))}));
}

bool polytopeWithin(const Segment& axis, const Obstacle& polytope, double reach) {
  const double scale = scaleOfPair(axis, polytope);
  if (scale == 0) return true;
  if (scale != 1) {
    // The scaled reach must not overflow either.
    return polytopeWithin({scale * axis.a, scale * axis.b, 0}, scaled(polytope, scale),
                          std::min(scale * reach, 0x1p150));
  }
  const double m = sizeOfPair(axis, polytope);
  if (!(reach < m)) return true;
  DifferenceSearch<double> rough(axis, polytope, m);
  rough.start();
  const Verdict verdict = rough.decide(reach);
  if (verdict != Verdict::kOpen) return verdict == Verdict::kWithin;
  DifferenceSearch<DoubleDouble> fine(axis, polytope, m);
  fine.startAt(rough);
  return fine.decide(reach) != Verdict::kApart;
}

NearestToPolytope nearestToPolytope(const Segment& axis, const Obstacle& polytope, double certain) {
  const double m = sizeOfPair(axis, polytope);
  const auto nearestOf = [&](const auto& search) -> NearestToPolytope {
    const double distance = std::sqrt(search.squared());
    if (distance == 0) return {search.s(), 0, {0, 0, 0}, 0};
    return {search.s(), distance, (1 / distance) * search.mean(), search.leastAlong() / distance};
  };
  DifferenceSearch<double> rough(axis, polytope, m);
  rough.start();
  rough.finish();
  const NearestToPolytope nearest = nearestOf(rough);
  // Rounding would show in the direction of what is near.
  constexpr double kNear = 0x1p-16;
  if (nearest.distance > kNear * m && nearest.distance - nearest.least_along <= certain * m) {
    return nearest;
  }
  DifferenceSearch<DoubleDouble> fine(axis, polytope, m);
  fine.startAt(rough);
  fine.finish();
  return nearestOf(fine);
}

}  // namespace fcl_fibers::geometry
