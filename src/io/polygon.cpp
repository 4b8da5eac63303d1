// SPDX-License-Identifier: BSD-3-Clause
#include "io/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include "io/orientation.h"
#include "io/vectors.h"

namespace fcl_fibers::io {
namespace {

using Triangle = std::array<PlanePoint, 3>;

/// Whether b is between a and c, or at one of them. @pre the three are on a line
bool isBetween(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  const auto along = [&](std::size_t k) {
    return std::min(a[k], c[k]) <= b[k] && b[k] <= std::max(a[k], c[k]);
  };
  return along(0) && along(1);
}

/// Whether all points of the shape are on the right of the line from p to q, or on it.
template <typename Shape>
bool isOnRight(const PlanePoint& p, const PlanePoint& q, const Shape& shape, double tolerance) {
  return std::all_of(shape.begin(), shape.end(), [&](const PlanePoint& point) {
    return orientation(p, q, point, tolerance) <= 0;
  });
}

/// Whether an edge of the counterclockwise triangle has the shape on its outer side. If none has,
/// the line of an edge of the shape parts the two, or they overlap.
template <typename Shape>
bool isBeyondAnEdge(const Triangle& triangle, const Shape& shape, double tolerance) {
  const auto& [a, b, c] = triangle;
  return isOnRight(a, b, shape, tolerance) || isOnRight(b, c, shape, tolerance) ||
         isOnRight(c, a, shape, tolerance);
}

struct Box {
  PlanePoint low, high;
};

template <typename Shape>
Box boxOf(const Shape& shape) {
  Box box = {shape[0], shape[0]};
  for (const PlanePoint& point : shape) {
    for (const std::size_t k : {0U, 1U}) {
      box.low[k] = std::min(box.low[k], point[k]);
      box.high[k] = std::max(box.high[k], point[k]);
    }
  }
  return box;
}

bool areApart(const Box& a, const Box& b) {
  const auto apart = [&](std::size_t k) { return a.high[k] <= b.low[k] || b.high[k] <= a.low[k]; };
  return apart(0) || apart(1);
}

/// Whether the segment meets the inside of the counterclockwise triangle.
bool enters(const PlanePoint& p, const PlanePoint& q, const Triangle& triangle, double tolerance) {
  const std::array<PlanePoint, 2> segment = {p, q};
  return !areApart(boxOf(segment), boxOf(triangle)) &&
         !isBeyondAnEdge(triangle, segment, tolerance) && !isOnRight(p, q, triangle, tolerance) &&
         !isOnRight(q, p, triangle, tolerance);
}

/// The corners of one round.
void leaveOutRepetitions(std::vector<std::int32_t>& corners) {
  for (std::size_t period = 3; period <= corners.size() / 2; ++period) {
    if (corners.size() % period != 0) continue;
    const auto second = corners.begin() + static_cast<std::ptrdiff_t>(period);
    if (!std::equal(second, corners.end(), corners.begin())) continue;
    corners.resize(period);
    return;
  }
}

/// The corners seen from the first one, in a unit in which products neither overflow nor vanish.
std::vector<Point> seenFromFirst(const std::vector<Point>& places) {
  double largest = 0;
  for (const Point& place : places) {
    for (const double x : place) largest = std::max(largest, std::fabs(x));
  }
  int exponent = 0;
  std::frexp(largest, &exponent);
  std::vector<Point> seen = places;
  for (Point& point : seen) {
    for (std::size_t k = 0; k < 3; ++k) {
      point[k] = std::ldexp(point[k], -exponent) - std::ldexp(places[0][k], -exponent);
    }
  }
  return seen;
}

std::size_t largestOf(const Point& numbers) {
  const auto found = std::max_element(numbers.begin(), numbers.end(), [](double x, double y) {
    return std::fabs(x) < std::fabs(y);
  });
  return static_cast<std::size_t>(found - numbers.begin());
}

/// Whether a quadrangle is farther from flat than a thousandth of its size. Then its edges do not
/// cross in space, even if they seem to.
bool isTwisted(const std::vector<Point>& seen) {
  const Point &a = seen[1], &b = seen[2], &c = seen[3], normal = cross(a, b);
  const double area = std::max({norm(normal), norm(cross(b, c)), norm(cross(c, a))});
  return std::fabs(dot(normal, c)) > 0x1p-10 * area * std::max({norm(a), norm(b), norm(c)});
}

/// As they project along an axis onto a plane in which it points to the reader.
std::vector<PlanePoint> projected(const std::vector<Point>& points, std::size_t axis) {
  std::vector<PlanePoint> places;
  places.reserve(points.size());
  for (const Point& point : points) {
    places.push_back({point[(axis + 1) % 3], point[(axis + 2) % 3]});
  }
  return places;
}

/// What the triangle of a corner and its neighbors is, in the order in which it is taken off.
enum class Ear {
  kSpur,      ///< no area; the polygon goes back on its own line
  kFree,      ///< nothing touches the new edge
  kTouched,   ///< another corner is on the new edge
  kDoubtful,  ///< both edges are passed backward, too, so it may be outside of the polygon
  kStraight,  ///< no area; the corner is on the line of its neighbors
  kNone
};

struct Corner {
  PlanePoint place;  ///< so projected that the polygon runs counterclockwise
  std::size_t last = 0, next = 0;
  int turn = 0;  ///< 1 to the left, 0 straight on or back, -1 to the right
  bool is_blocker = false;
  Ear ear = Ear::kNone;
  double length = 0;  ///< of the new edge
};

class PolygonCutter {
 public:
  /// @param points  the corners of the polygon
  explicit PolygonCutter(const std::vector<Point>& points) : points_(points) { project(); }

  /// Returns the corners of each triangle, which are none if the polygon crosses itself.
  std::vector<std::size_t> cut() {
    if (takeOffEars(0) || takeOffEars(rounded_)) return triangles_;
    if (points_.size() > 4 || !isTwisted(seen_)) return {};
    const bool is_first_shorter =
        distance(points_[0], points_[2]) < distance(points_[1], points_[3]);
    if (is_first_shorter) return {0, 1, 2, 2, 3, 0};
    return {1, 2, 3, 3, 0, 1};
  }

 private:
  void project() {
    // By axis, twice the area as it projects along the axis, the same of its parts without signs,
    // and of the products whose differences they are.
    Point area{}, size{}, products{};
    for (std::size_t i = 1; i + 1 < seen_.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double left = seen_[i][(k + 1) % 3] * seen_[i + 1][(k + 2) % 3];
        const double right = seen_[i][(k + 2) % 3] * seen_[i + 1][(k + 1) % 3];
        area[k] += left - right;
        size[k] += std::fabs(left - right);
        products[k] += std::fabs(left) + std::fabs(right);
      }
    }
    // The axis nearest to the normal. If the parts of the area cancel, those of a flat polygon
    // still are along its normal.
    std::size_t axis = largestOf(area);
    const std::size_t of_size = largestOf(size);
    if (!(std::fabs(area[axis]) > 0x1p-10 * size[of_size])) axis = of_size;
    std::vector<PlanePoint> places = projected(points_, axis);
    const double rounding = static_cast<double>(points_.size() + 8) *
                            std::numeric_limits<double>::epsilon() * products[axis];
    int sign = 0;
    if (std::fabs(area[axis]) > rounding) {
      sign = area[axis] > 0 ? 1 : -1;
    } else {
      sign = areaSign(places);
      // Products of numbers of very different sizes vanish.
      for (std::size_t other = 0; sign == 0 && size[axis] == 0 && other < 3; ++other) {
        places = projected(points_, other);
        sign = areaSign(places);
      }
    }
    const auto [low, high] = boxOf(places);
    const double largest = std::max({-low[0], -low[1], high[0], high[1]});
    rounded_ = std::min(0x1p-20 * largest, 0x1p-10 * std::max(high[0] - low[0], high[1] - low[1]));
    for (PlanePoint& place : places) {
      if (sign < 0) std::swap(place[0], place[1]);
      corners_.push_back({place});
    }
  }

  bool isTwoWay(const Corner& from, const Corner& to) const {
    return edges_.count({to.place, from.place}) > 0;
  }

  void readTurn(std::size_t corner) {
    Corner& at = corners_[corner];
    at.turn = orientation(corners_[at.last].place, at.place, corners_[at.next].place, tolerance_);
    if (at.turn > 0 || at.is_blocker) return;
    at.is_blocker = true;
    blockers_.push_back(corner);
  }

  Ear earAt(std::size_t corner) {
    const Corner& at = corners_[corner];
    const Triangle triangle = {corners_[at.last].place, at.place, corners_[at.next].place};
    const auto& [a, b, c] = triangle;
    if (at.turn < 0) return Ear::kNone;
    if (at.turn == 0) return b != a && b != c && isBetween(a, b, c) ? Ear::kStraight : Ear::kSpur;
    Ear ear = isTwoWay(corners_[at.last], corners_[at.next]) ? Ear::kTouched : Ear::kFree;
    for (std::size_t i = 0; i < blockers_.size();) {
      Corner& blocker = corners_[blockers_[i]];
      if (blocker.turn > 0) {  // or it has been taken off
        blocker.is_blocker = false;
        blockers_[i] = blockers_.back();
        blockers_.pop_back();
        continue;
      }
      ++i;
      const PlanePoint& place = blocker.place;
      if (enters(corners_[blocker.last].place, place, triangle, tolerance_) ||
          enters(place, corners_[blocker.next].place, triangle, tolerance_)) {
        return Ear::kNone;
      }
      if (ear == Ear::kFree && place != a && place != c &&
          orientation(a, c, place, tolerance_) == 0 && isBetween(a, place, c)) {
        ear = Ear::kTouched;
      }
    }
    return ear;
  }

  void readEar(std::size_t corner) {
    Corner& at = corners_[corner];
    if (at.ear != Ear::kNone) ears_.erase({at.ear, at.length, corner});
    at.ear = earAt(corner);
    if (at.ear == Ear::kNone) return;
    at.length = distance(points_[at.last], points_[at.next]);
    ears_.emplace(at.ear, at.length, corner);
  }

  /// Short new edges make triangles that are no needles. Only what becomes of a corner's neighbors
  /// changes what its triangle is, so each triangle is looked at a few times.
  bool takeOffEars(double tolerance) {
    tolerance_ = tolerance;
    blockers_.clear();
    ears_.clear();
    triangles_.clear();
    edges_.clear();
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      Corner& at = corners_[i];
      at = {at.place};
      at.last = (i == 0 ? corners_.size() : i) - 1;
      at.next = i + 1 == corners_.size() ? 0 : i + 1;
      edges_.emplace(at.place, corners_[at.next].place);
    }
    for (std::size_t i = 0; i < corners_.size(); ++i) readTurn(i);
    for (std::size_t i = 0; i < corners_.size(); ++i) readEar(i);
    while (triangles_.size() / 3 + 2 < corners_.size()) {
      if (ears_.empty()) return false;
      const auto [ear, length, corner] = *ears_.begin();
      ears_.erase(ears_.begin());
      Corner& at = corners_[corner];
      if ((ear == Ear::kFree || ear == Ear::kTouched) && isTwoWay(corners_[at.last], at) &&
          isTwoWay(at, corners_[at.next])) {
        at.ear = Ear::kDoubtful;
        ears_.emplace(at.ear, length, corner);
        continue;
      }
      Corner &a = corners_[at.last], &c = corners_[at.next];
      at.ear = Ear::kNone;
      at.turn = 1;  // It blocks no more.
      triangles_.insert(triangles_.end(), {at.last, corner, at.next});
      edges_.erase(edges_.find({a.place, at.place}));
      edges_.erase(edges_.find({at.place, c.place}));
      edges_.emplace(a.place, c.place);
      a.next = at.next;
      c.last = at.last;
      for (const std::size_t neighbor : {at.last, at.next}) readTurn(neighbor);
      for (const std::size_t neighbor : {at.last, at.next}) readEar(neighbor);
    }
    return !overlap();
  }

  bool overlap() const {
    std::vector<std::pair<Box, Triangle>> boxed;
    for (std::size_t i = 0; i < triangles_.size(); i += 3) {
      const auto place = [&](std::size_t k) { return corners_[triangles_[i + k]].place; };
      const Triangle triangle = {place(0), place(1), place(2)};
      if (orientation(triangle[0], triangle[1], triangle[2], tolerance_) == 0) continue;
      boxed.emplace_back(boxOf(triangle), triangle);
    }
    std::sort(boxed.begin(), boxed.end(),
              [](const auto& p, const auto& q) { return p.first.low[0] < q.first.low[0]; });
    for (auto p = boxed.begin(); p != boxed.end(); ++p) {
      const auto& [box, triangle] = *p;
      for (auto q = std::next(p); q != boxed.end() && q->first.low[0] < box.high[0]; ++q) {
        if (!areApart(box, q->first) && !isBeyondAnEdge(triangle, q->second, tolerance_) &&
            !isBeyondAnEdge(q->second, triangle, tolerance_)) {
          return true;
        }
      }
    }
    return false;
  }

  const std::vector<Point>& points_;
  std::vector<Point> seen_ = seenFromFirst(points_);
  std::vector<Corner> corners_;
  double tolerance_ = 0;  ///< of orientations
  /// The same for corners that are rounded, but less than the size of the polygon.
  double rounded_ = 0;
  /// The corners that do not turn left. An edge that enters the triangle of another corner begins
  /// or ends at one of them.
  std::vector<std::size_t> blockers_;
  std::multiset<std::pair<PlanePoint, PlanePoint>> edges_;  ///< from, to
  std::set<std::tuple<Ear, double, std::size_t>> ears_;     ///< and `length`, corner
  std::vector<std::size_t> triangles_;                      ///< three corners each
};

}  // namespace

bool cutPolygon(const std::vector<Point>& points, std::vector<std::int32_t>& corners,
                std::vector<std::int32_t>& triangles) {
  leaveOutRepetitions(corners);
  if (corners.size() == 3) {
    triangles.insert(triangles.end(), corners.begin(), corners.end());
    return true;
  }
  std::vector<Point> places;
  places.reserve(corners.size());
  for (const auto corner : corners) places.push_back(points[static_cast<std::size_t>(corner)]);
  const std::vector<std::size_t> cut = PolygonCutter(places).cut();
  for (const std::size_t corner : cut) triangles.push_back(corners[corner]);
  return !cut.empty();
}

}  // namespace fcl_fibers::io
