// SPDX-License-Identifier: BSD-3-Clause
#include "tools/trade/judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <tuple>
#include <utility>

#include "tools/along_fibers.h"

namespace fcl_fibers::tools::trade {
namespace {

constexpr std::size_t kPiece = 64;     ///< segments
constexpr double kBand = 1e-9;         ///< of the radii, within which rounding may decide
constexpr double kEpsilon = 0x1p-48;   ///< of the coordinates, likewise
constexpr double kParallel = 1e-3;     ///< sine, below which the place of a contact is not told
constexpr double kMeeting = 1e-3;      ///< of the radii, within which axes have no normal
constexpr double kShortest = 0x1p-30;  ///< part of a step
constexpr int kMostInstants = 10000;   ///< of a step in which a pair is looked at
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vector operator-(const Vector& p, const Vector& q) {
  return {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
}
Vector operator+(const Vector& p, const Vector& q) {
  return {p[0] + q[0], p[1] + q[1], p[2] + q[2]};
}
Vector operator*(Real s, const Vector& p) { return {s * p[0], s * p[1], s * p[2]}; }
Real dot(const Vector& p, const Vector& q) { return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]; }
Real norm(const Vector& p) { return std::sqrt(dot(p, p)); }
Vector cross(const Vector& p, const Vector& q) {
  return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
}
Vector between(const Vector& from, const Vector& to, Real time) {
  return from + time * (to - from);
}
Vector vectorOf(const Point& p) { return {p[0], p[1], p[2]}; }
Point pointOf(const Vector& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Vector onAxis(const Vector& from, const Vector& to, const Vector& x) {
  const Vector along = to - from;
  const Real squared = dot(along, along);
  if (!(squared > 0)) return from;
  return from + std::clamp<Real>(dot(along, x - from) / squared, 0, 1) * along;
}

void keepNearer(Closest& best, const Vector& p, const Vector& q) {
  const Real distance = norm(p - q);
  if (distance < best.distance) best = {distance, p, q};
}

/// A box, also around what moves.
struct Box {
  Point low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};

  void add(const Point& p, double radius) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k] - radius);
      high[k] = std::max(high[k], p[k] + radius);
    }
  }
  void add(const Box& box) {
    add(box.low, 0);
    add(box.high, 0);
  }
  bool isApart(const Box& other) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (low[k] > other.high[k] || other.low[k] > high[k]) return true;
    }
    return false;
  }
};

/// Segments of one fiber, by their first points.
struct Piece {
  std::size_t fiber, begin, end;
  Box box;
};

class Judge {
 public:
  Judge(const Scene& scene, double most_tests)
      : scene_(scene), along_(scene.fibers), most_tests_(most_tests) {
    const FiberPolylines& fibers = scene.fibers;
    boxes_.resize(fibers.points.size());
    verdict_.sample.resize(fibers.points.size());
    addRounding(fibers.points);
    for (const FiberPolylines& end : scene.end) addRounding(end.points);
    for (const MeshFile& mesh : scene.meshes) addRounding(mesh.points);
    for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
      const std::size_t last = fibers.point_begin[f] + fibers.segmentCount(f);
      for (std::size_t i = fibers.point_begin[f]; i < last; i += kPiece) {
        pieces_.push_back({f, i, std::min(i + kPiece, last), {}});
        for (std::size_t j = i; j < pieces_.back().end; ++j) {
          boxes_[j] = boxOf(j);
          pieces_.back().box.add(boxes_[j]);
        }
      }
    }
    for (const MeshFile& mesh : scene.meshes) {
      for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
        Box box;
        std::array<Vector, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
          const Point& corner = mesh.points[static_cast<std::size_t>(mesh.triangles[t + k])];
          corners[k] = vectorOf(corner);
          box.add(corner, 0);
        }
        triangles_.push_back({corners, box});
      }
    }
  }

  Verdict run(const std::function<void(double)>& tell) {
    std::vector<std::size_t> order(pieces_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    // Not std::shuffle, whose order differs from library to library.
    std::mt19937_64 random(1);
    for (std::size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[static_cast<std::size_t>(random() % i)]);
    }
    std::vector<std::uint8_t> is_done(pieces_.size());
    for (const std::size_t i : order) {
      if (tests_ > most_tests_) break;
      if (scene_.meshes.empty()) {
        for (std::size_t j = 0; j < pieces_.size(); ++j) {
          if (is_done[j] == 0) comparePieces(pieces_[i], pieces_[j]);
        }
      } else {
        compareWithMeshes(pieces_[i]);
      }
      is_done[i] = 1;
      ++verdict_.judged_pieces;
      std::fill(verdict_.sample.begin() + static_cast<std::ptrdiff_t>(pieces_[i].begin),
                verdict_.sample.begin() + static_cast<std::ptrdiff_t>(pieces_[i].end),
                verdict_.judged_pieces);
      tell(std::max(tests_ / most_tests_, static_cast<double>(verdict_.judged_pieces) /
                                              static_cast<double>(pieces_.size())));
    }
    verdict_.pieces = pieces_.size();
    std::sort(verdict_.contacts.begin(), verdict_.contacts.end());
    std::sort(verdict_.open.begin(), verdict_.open.end());
    return std::move(verdict_);
  }

 private:
  struct Triangle {
    std::array<Vector, 3> corners;
    Box box;
  };

  void addRounding(const std::vector<Point>& points) {
    for (const Point& point : points) {
      for (const double x : point) rounding_ = std::max(rounding_, kEpsilon * std::abs(x));
    }
  }

  static Axis axisOf(const FiberPolylines& fibers, std::size_t i) {
    return {vectorOf(fibers.points[i]), vectorOf(fibers.points[i + 1]), fibers.radiusAt(i)};
  }
  Axis axisAt(std::size_t i, Real time) const {
    const Axis start = axisOf(scene_.fibers, i);
    if (!scene_.isStep()) return start;
    const Axis end = axisOf(scene_.end.front(), i);
    return {between(start.from, end.from, time), between(start.to, end.to, time),
            start.radius + time * (end.radius - start.radius)};
  }
  Box boxOf(std::size_t i) const {
    Box box;
    for (const double time : {0.0, 1.0}) {
      const Axis axis = axisAt(i, time);
      const double radius = (1 + kBand) * static_cast<double>(axis.radius) + rounding_;
      box.add(pointOf(axis.from), radius);
      box.add(pointOf(axis.to), radius);
    }
    return box;
  }

  void comparePieces(const Piece& p, const Piece& q) {
    ++tests_;
    if (p.box.isApart(q.box)) return;
    tests_ += static_cast<double>((p.end - p.begin) * (q.end - q.begin));
    for (std::size_t i = p.begin; i < p.end; ++i) {
      for (std::size_t j = p.begin == q.begin ? i + 1 : q.begin; j < q.end; ++j) {
        if (boxes_[i].isApart(boxes_[j])) continue;
        const bool is_one_fiber = p.fiber == q.fiber;
        comparePair(std::min(i, j), std::max(i, j), is_one_fiber ? &p.fiber : nullptr);
      }
    }
  }

  /// Whether the part of a fiber between two segments is too short to turn back.
  bool isAlong(std::size_t fiber, std::size_t i, std::size_t j, Real radii) {
    const NearAlong near =
        along_.near(fiber, {static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)});
    constexpr double kHalfCircle = 1.5707963267948966;
    if (near.numbers_apart > 1 && !(near.length_between <= kHalfCircle * radii)) return false;
    verdict_.has_pairs_along = verdict_.has_pairs_along || near.numbers_apart > 1;
    return true;
  }

  /// @param fiber  of both, or null
  void comparePair(std::size_t i, std::size_t j, const std::size_t* fiber) {
    Touch touch{static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)};
    const Axis a = axisAt(i, 1), b = axisAt(j, 1);
    const Real radii = a.radius + b.radius, band = kBand * radii + rounding_;
    std::optional<bool> touches;
    if (scene_.isStep()) {
      touches = firstTouch(i, j, band, touch.time);
    } else {
      const Real gap = closest(a, b).distance - radii;
      if (std::abs(gap) > band) touches = gap < 0;
    }
    if (touches == false) return;
    if (fiber != nullptr && isAlong(*fiber, i, j, radii)) return;
    if (!touches) {
      verdict_.open.push_back(touch);
      return;
    }
    setContact(axisAt(i, touch.time), axisAt(j, touch.time), touch);
    verdict_.contacts.push_back(touch);
  }

  static void setContact(const Axis& a, const Axis& b, Touch& touch) {
    const Closest points = closest(a, b);
    const Real radii = a.radius + b.radius;
    touch.distance = static_cast<double>(points.distance - radii);
    Vector normal{};
    if (points.distance > kMeeting * radii) {
      normal = (1 / points.distance) * (points.q - points.p);
    }
    touch.normal = pointOf(normal);
    touch.place = pointOf(0.5L * (points.p + a.radius * normal + points.q - b.radius * normal));
    const Vector u = a.to - a.from, v = b.to - b.from;
    touch.is_at_one_place = norm(cross(u, v)) > kParallel * norm(u) * norm(v);
  }

  /// When two segments first touch in the step. The gap changes no faster than the fastest end of
  /// one moves beside an end of the other, so what is apart far enough is apart for some time
  /// before and after it. The rest is halved again and again, the earliest first.
  std::optional<bool> firstTouch(std::size_t i, std::size_t j, Real band, double& time) {
    const auto gapAt = [&](Real at) {
      const Axis a = axisAt(i, at), b = axisAt(j, at);
      ++tests_;
      return closest(a, b).distance - a.radius - b.radius;
    };
    const Axis a = axisAt(i, 0), a_end = axisAt(i, 1), b = axisAt(j, 0), b_end = axisAt(j, 1);
    Real speed = 0;
    for (const Vector& p : {a_end.from - a.from, a_end.to - a.to}) {
      for (const Vector& q : {b_end.from - b.from, b_end.to - b.to}) {
        speed = std::max(speed, norm(p - q));
      }
    }
    speed += std::abs(a_end.radius - a.radius + b_end.radius - b.radius);
    time = 0;
    if (gapAt(0) < -band) return true;
    std::vector<std::pair<double, double>> rest = {{0, 1}};
    bool is_open = false, touches = gapAt(1) < -band;
    time = 1;
    for (int instants = 0; !rest.empty(); ++instants) {
      is_open = is_open || instants == kMostInstants;
      if (instants == kMostInstants) break;
      const auto [from, to] = rest.back();
      rest.pop_back();
      const double middle = 0.5 * (from + to), half = middle - from;
      const Real gap = gapAt(middle);
      if (gap > speed * half + band) continue;
      if (gap < -band) {
        touches = true;
        time = middle;
        rest.clear();
        if (half > kShortest) rest.emplace_back(from, middle);
        continue;
      }
      if (half < kShortest) {
        is_open = true;
        continue;
      }
      rest.emplace_back(middle, to);
      rest.emplace_back(from, middle);
    }
    if (touches) return true;
    if (is_open) return std::nullopt;
    return false;
  }

  void compareWithMeshes(const Piece& piece) {
    std::vector<const Triangle*> near;
    for (const Triangle& triangle : triangles_) {
      if (!piece.box.isApart(triangle.box)) near.push_back(&triangle);
    }
    tests_ += static_cast<double>(triangles_.size() + (piece.end - piece.begin) * near.size());
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
      const Axis axis = axisOf(scene_.fibers, i);
      Closest best{kInfinity, {}, {}};
      const Triangle* nearest = nullptr;
      for (const Triangle* triangle : near) {
        if (boxes_[i].isApart(triangle->box)) continue;
        const Closest found = closest(axis, triangle->corners);
        if (found.distance < best.distance) {
          best = found;
          nearest = triangle;
        }
      }
      if (nearest == nullptr) continue;
      const Real gap = best.distance - axis.radius, band = kBand * axis.radius + rounding_;
      if (gap > band) continue;
      Vector normal{};
      if (best.distance > kMeeting * axis.radius) {
        normal = (1 / best.distance) * (best.q - best.p);
      }
      const Vector place = 0.5L * (best.p + axis.radius * normal + best.q);
      Touch touch{static_cast<std::int32_t>(i), kAMesh, static_cast<double>(gap), pointOf(normal),
                  pointOf(place)};
      // Along a triangle or an edge many places are right.
      touch.is_at_one_place =
          std::abs(dot(normal, axis.to - axis.from)) > kParallel * norm(axis.to - axis.from);
      (gap < -band ? verdict_.contacts : verdict_.open).push_back(touch);
    }
  }

  const Scene& scene_;
  AlongFibers along_;
  double most_tests_, tests_ = 0, rounding_ = 0;
  std::vector<Box> boxes_;  ///< by first point
  std::vector<Piece> pieces_;
  std::vector<Triangle> triangles_;
  Verdict verdict_;
};

}  // namespace

bool operator<(const Touch& a, const Touch& b) { return std::tie(a.a, a.b) < std::tie(b.a, b.b); }

Closest closest(const Axis& a, const Axis& b) {
  Closest best{kInfinity, a.from, b.from};
  for (const Vector& p : {a.from, a.to}) keepNearer(best, p, onAxis(b.from, b.to, p));
  for (const Vector& q : {b.from, b.to}) keepNearer(best, onAxis(a.from, a.to, q), q);
  const Vector along = b.to - b.from, normal = cross(a.to - a.from, along);
  const Real squared = dot(normal, normal);
  if (squared > 0) {
    const Real s = dot(cross(b.from - a.from, along), normal) / squared;
    if (s > 0 && s < 1) {
      const Vector q = onAxis(b.from, b.to, between(a.from, a.to, s));
      keepNearer(best, onAxis(a.from, a.to, q), q);
    }
  }
  return best;
}

Closest closest(const Axis& axis, const std::array<Vector, 3>& triangle) {
  Closest best{kInfinity, axis.from, triangle[0]};
  const Vector normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const Real squared = dot(normal, normal);
  // Whether the foot of a point on the plane is in the triangle.
  const auto isInside = [&](const Vector& x) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector &p = triangle[k], &q = triangle[(k + 1) % 3];
      if (dot(cross(q - p, x - p), normal) < 0) return false;
    }
    return true;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const Closest edge = closest(axis, Axis{triangle[k], triangle[(k + 1) % 3], 0});
    if (edge.distance < best.distance) best = edge;
  }
  if (!(squared > 0)) return best;
  const Real from = dot(axis.from - triangle[0], normal), to = dot(axis.to - triangle[0], normal);
  for (const auto& [end, height] : {std::pair(axis.from, from), std::pair(axis.to, to)}) {
    if (isInside(end)) keepNearer(best, end, end - (height / squared) * normal);
  }
  if ((from < 0) != (to < 0)) {
    const Vector crossing = between(axis.from, axis.to, from / (from - to));
    if (isInside(crossing)) best = {0, crossing, crossing};
  }
  return best;
}

Verdict judge(const Scene& scene, double most_tests, const std::function<void(double)>& tell) {
  return Judge(scene, most_tests).run(tell);
}

}  // namespace fcl_fibers::tools::trade
