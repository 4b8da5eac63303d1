// SPDX-License-Identifier: BSD-3-Clause
#include "tools/trade/judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <tuple>
#include <utility>

#include "tools/along_fibers.h"
#include "tools/trade/distances.h"

namespace fcl_fibers::tools::trade {
namespace {

constexpr std::size_t kPiece = 64;     ///< segments
constexpr double kBand = 1e-9;         ///< of the radii, within which rounding may decide
constexpr double kEpsilon = 0x1p-48;   ///< of the coordinates, within which rounding may decide
constexpr double kParallel = 1e-3;     ///< sine, below which the place of a contact is not told
constexpr double kMeeting = 1e-3;      ///< of the radii, within which axes have no normal
constexpr double kShortest = 0x1p-30;  ///< part of a step
constexpr int kMostInstants = 10000;   ///< of a step in which a pair is looked at
constexpr double kConeTests = 1000;    ///< tests of two boxes that take as long as one of cones
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vector vectorOf(const Point& p) { return {p[0], p[1], p[2]}; }
Point pointOf(const Vector& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Axis axisOf(const FiberPolylines& fibers, std::size_t i) {
  const Real from = fibers.radiusAt(i, 0), to = fibers.radiusAt(i, 1);
  return {vectorOf(fibers.points[i]), vectorOf(fibers.points[i + 1]), from, to - from};
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

  Axis axisAt(std::size_t i, Real time) const {
    const Axis start = axisOf(scene_.fibers, i);
    if (!scene_.isStep()) return start;
    const Axis end = axisOf(scene_.end.front(), i);
    return {between(start.from, end.from, time), between(start.to, end.to, time),
            start.radius + time * (end.radius - start.radius),
            start.taper + time * (end.taper - start.taper)};
  }
  Box boxOf(std::size_t i) const {
    Box box;
    for (const double time : {0.0, 1.0}) {
      const Axis axis = axisAt(i, time);
      const auto add = [&](const Vector& p, Real radius) {
        box.add(pointOf(p), (1 + kBand) * static_cast<double>(radius) + rounding_);
      };
      add(axis.from, axis.radius);
      add(axis.to, axis.radius + axis.taper);
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

  /// Whether the part of a fiber, or of joined ones, between two segments is too short to turn
  /// back.
  /// @param fiber  of both, or null
  bool isAlong(const std::size_t* fiber, SegmentPair pair, Real radii) {
    constexpr double kHalfCircle = 1.5707963267948966;
    const double too_short = kHalfCircle * static_cast<double>(radii);
    const auto isNear = [&](const NearAlong& near) {
      return near.numbers_apart <= 1 || near.length_between <= too_short;
    };
    std::optional<NearAlong> near;
    if (fiber != nullptr) near = along_.near(*fiber, pair);
    if (along_.hasBranches() && !(near && isNear(*near))) {
      near = along_.nearAcross(pair, too_short, 1);
    }
    if (!near || !isNear(*near)) return false;
    verdict_.has_pairs_along = verdict_.has_pairs_along || near->numbers_apart > 1;
    return true;
  }

  /// @param fiber  of both, or null
  void comparePair(std::size_t i, std::size_t j, const std::size_t* fiber) {
    Touch touch{static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)};
    const Axis a = axisAt(i, 1), b = axisAt(j, 1);
    const Real radii = a.most() + b.most(), band = kBand * radii + rounding_;
    std::optional<bool> touches;
    if (scene_.isStep()) {
      touches = firstTouch(i, j, band, touch.time);
    } else {
      const Real gap = gapAbove(a, b, band);
      if (std::abs(gap) > band) touches = gap < 0;
    }
    if (touches == false) return;
    if (isAlong(fiber, {touch.a, touch.b}, radii)) return;
    if (!touches) {
      verdict_.open.push_back(touch);
      return;
    }
    setContact(axisAt(i, touch.time), axisAt(j, touch.time), touch);
    verdict_.contacts.push_back(touch);
  }

  /// The gap of two segments, or a lower bound of it that is more than `enough`.
  Real gapAbove(const Axis& a, const Axis& b, Real enough) {
    const Real least = closest(a, b).distance - a.most() - b.most();
    if ((a.taper == 0 && b.taper == 0) || least > enough) return least;
    tests_ += kConeTests;
    return gapOf(a, b).gap;
  }

  static void setContact(const Axis& a, const Axis& b, Touch& touch) {
    setContact(gapOf(a, b), touch);
    const Vector u = a.to - a.from, v = b.to - b.from;
    touch.is_at_one_place = norm(cross(u, v)) > kParallel * norm(u) * norm(v);
  }
  /// Returns the normal, too.
  static Vector setContact(const Gap& gap, Touch& touch) {
    touch.distance = static_cast<double>(gap.gap);
    const Vector way = gap.q - gap.p;
    const Real distance = norm(way);
    Vector normal{};
    if (distance > kMeeting * (gap.radius_p + gap.radius_q)) normal = (1 / distance) * way;
    touch.normal = pointOf(normal);
    touch.place = pointOf(0.5L * (gap.p + gap.radius_p * normal + gap.q - gap.radius_q * normal));
    return normal;
  }

  /// When two segments first touch in the step. The gap changes no faster than the fastest end of
  /// one moves beside an end of the other, so what is apart far enough is apart for some time
  /// before and after it. The rest is halved again and again, the earliest first.
  std::optional<bool> firstTouch(std::size_t i, std::size_t j, Real band, double& time) {
    // A lower bound where that is above `enough`.
    const auto gapAt = [&](Real at, Real enough) {
      ++tests_;
      return gapAbove(axisAt(i, at), axisAt(j, at), enough);
    };
    const Axis a = axisAt(i, 0), a_end = axisAt(i, 1), b = axisAt(j, 0), b_end = axisAt(j, 1);
    Real speed = 0;
    for (const Vector& p : {a_end.from - a.from, a_end.to - a.to}) {
      for (const Vector& q : {b_end.from - b.from, b_end.to - b.to}) {
        speed = std::max(speed, norm(p - q));
      }
    }
    // The radii at the ends of one change beside those at the ends of the other.
    const Real from_a = a_end.radius - a.radius, from_b = b_end.radius - b.radius;
    const Real to_a = from_a + a_end.taper - a.taper, to_b = from_b + b_end.taper - b.taper;
    speed += std::max({std::abs(from_a + from_b), std::abs(from_a + to_b), std::abs(to_a + from_b),
                       std::abs(to_a + to_b)});
    time = 0;
    if (gapAt(0, 0) < -band) return true;
    std::vector<std::pair<double, double>> rest = {{0, 1}};
    bool is_open = false, touches = gapAt(1, 0) < -band;
    time = 1;
    for (int instants = 0; !rest.empty(); ++instants) {
      is_open = is_open || instants == kMostInstants;
      if (instants == kMostInstants) break;
      const auto [from, to] = rest.back();
      rest.pop_back();
      const double middle = 0.5 * (from + to), half = middle - from;
      const Real gap = gapAt(middle, speed * half + band);
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
      Gap best{kInfinity, {}, {}, 0, 0};
      for (const Triangle* triangle : near) {
        if (boxes_[i].isApart(triangle->box)) continue;
        if (axis.taper != 0) {
          if (closest(axis, triangle->corners).distance - axis.most() > best.gap) continue;
          tests_ += 3 * kConeTests;
        }
        const Gap found = gapOf(axis, triangle->corners);
        if (found.gap < best.gap) best = found;
      }
      const Real band = kBand * axis.most() + rounding_;
      if (!(best.gap <= band)) continue;
      Touch touch{static_cast<std::int32_t>(i), kAMesh};
      const Vector normal = setContact(best, touch), along = axis.to - axis.from;
      // Along a triangle or an edge many places are right.
      touch.is_at_one_place = std::abs(dot(normal, along) + axis.taper) > kParallel * norm(along);
      (best.gap < -band ? verdict_.contacts : verdict_.open).push_back(touch);
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

Verdict judge(const Scene& scene, double most_tests, const std::function<void(double)>& tell) {
  return Judge(scene, most_tests).run(tell);
}

}  // namespace fcl_fibers::tools::trade
