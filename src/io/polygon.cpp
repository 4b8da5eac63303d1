// SPDX-License-Identifier: BSD-3-Clause
#include "io/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

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
template <std::size_t kCount>
bool isOnRight(const Sides& side, const PlanePoint& p, const PlanePoint& q,
               const std::array<PlanePoint, kCount>& shape) {
  return std::all_of(shape.begin(), shape.end(),
                     [&](const PlanePoint& point) { return side(p, q, point) <= 0; });
}

/// Whether an edge of the counterclockwise triangle has the shape on its outer side. If none has,
/// the line of an edge of the shape parts the two, or they overlap.
template <std::size_t kCount>
bool isBeyondAnEdge(const Sides& side, const Triangle& triangle,
                    const std::array<PlanePoint, kCount>& shape) {
  const auto& [a, b, c] = triangle;
  return isOnRight(side, a, b, shape) || isOnRight(side, b, c, shape) ||
         isOnRight(side, c, a, shape);
}

struct Range {
  double low, high;
};

template <std::size_t kCount>
Range rangeOf(const std::array<PlanePoint, kCount>& shape, std::size_t axis) {
  Range range = {shape[0][axis], shape[0][axis]};
  for (const PlanePoint& point : shape) {
    range = {std::min(range.low, point[axis]), std::max(range.high, point[axis])};
  }
  return range;
}

bool areApart(const Range& a, const Range& b) { return a.high <= b.low || b.high <= a.low; }

/// Whether the segment meets the inside of the counterclockwise triangle.
bool enters(const Sides& side, const PlanePoint& p, const PlanePoint& q, const Triangle& triangle) {
  const std::array<PlanePoint, 2> segment = {p, q};
  for (const std::size_t axis : {0U, 1U}) {
    if (areApart(rangeOf(segment, axis), rangeOf(triangle, axis))) return false;
  }
  return !isBeyondAnEdge(side, triangle, segment) && !isOnRight(side, p, q, triangle) &&
         !isOnRight(side, q, p, triangle);
}

/// Whether the insides of two counterclockwise triangles meet.
bool overlaps(const Sides& side, const Triangle& a, const Triangle& b) {
  return !isBeyondAnEdge(side, a, b) && !isBeyondAnEdge(side, b, a);
}

double distance(const std::vector<Point>& points, std::int32_t from, std::int32_t to) {
  const Point &a = points[static_cast<std::size_t>(from)],
              &b = points[static_cast<std::size_t>(to)];
  return std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
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
std::vector<Point> seenFromFirst(const std::vector<Point>& points,
                                 const std::vector<std::int32_t>& corners) {
  const auto pointAt = [&](std::size_t i) -> const Point& {
    return points[static_cast<std::size_t>(corners[i])];
  };
  double largest = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (const double x : pointAt(i)) largest = std::max(largest, std::fabs(x));
  }
  int exponent = 0;
  std::frexp(largest, &exponent);
  std::vector<Point> seen(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      seen[i][k] = std::ldexp(pointAt(i)[k], -exponent) - std::ldexp(pointAt(0)[k], -exponent);
    }
  }
  return seen;
}

/// Of a polygon, by axis: what tells how it lies in space.
struct Areas {
  Point area = {};      ///< twice the area as it projects along the axis
  Point size = {};      ///< the same of its parts, without signs
  Point products = {};  ///< of which these are differences
};

Areas areasOf(const std::vector<Point>& seen) {
  Areas areas;
  for (std::size_t i = 1; i + 1 < seen.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double left = seen[i][(k + 1) % 3] * seen[i + 1][(k + 2) % 3];
      const double right = seen[i][(k + 2) % 3] * seen[i + 1][(k + 1) % 3];
      areas.area[k] += left - right;
      areas.size[k] += std::fabs(left - right);
      areas.products[k] += std::fabs(left) + std::fabs(right);
    }
  }
  return areas;
}

/// The axis nearest to the polygon's normal. If the parts of the area cancel, those of a flat
/// polygon still are along its normal.
std::size_t axisOf(const Areas& areas) {
  const auto largest = [](const Point& numbers) {
    const auto found = std::max_element(numbers.begin(), numbers.end(), [](double x, double y) {
      return std::fabs(x) < std::fabs(y);
    });
    return static_cast<std::size_t>(found - numbers.begin());
  };
  const std::size_t of_area = largest(areas.area), of_size = largest(areas.size);
  return std::fabs(areas.area[of_area]) > 0x1p-10 * areas.size[of_size] ? of_area : of_size;
}

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double norm(const Point& p) { return std::hypot(p[0], p[1], p[2]); }

/// Whether a quadrangle is farther from flat than a thousandth of its size. Then its edges do not
/// cross in space, even if they seem to.
bool isTwisted(const std::vector<Point>& seen) {
  const Point &a = seen[1], &b = seen[2], &c = seen[3], normal = cross(a, b);
  const double area = std::max({norm(normal), norm(cross(b, c)), norm(cross(c, a))});
  const double volume = normal[0] * c[0] + normal[1] * c[1] + normal[2] * c[2];
  return std::fabs(volume) > 0x1p-10 * area * std::max({norm(a), norm(b), norm(c)});
}

/// As they project along an axis onto a plane in which it points to the reader.
std::vector<PlanePoint> projected(const std::vector<Point>& points,
                                  const std::vector<std::int32_t>& corners, std::size_t axis) {
  std::vector<PlanePoint> places;
  places.reserve(corners.size());
  for (const std::int32_t corner : corners) {
    const Point& point = points[static_cast<std::size_t>(corner)];
    places.push_back({point[(axis + 1) % 3], point[(axis + 2) % 3]});
  }
  return places;
}

}  // namespace

void PolygonCutter::project(const std::vector<Point>& points,
                            const std::vector<std::int32_t>& corners,
                            const std::vector<Point>& seen) {
  const Areas areas = areasOf(seen);
  const std::size_t axis = axisOf(areas);
  std::vector<PlanePoint> places = projected(points, corners, axis);
  const double rounding = static_cast<double>(corners.size() + 8) *
                          std::numeric_limits<double>::epsilon() * areas.products[axis];
  int sign = 0;
  if (std::fabs(areas.area[axis]) > rounding) {
    sign = areas.area[axis] > 0 ? 1 : -1;
  } else {
    sign = areaSign(places);
    // Products of numbers of very different sizes vanish.
    for (std::size_t other = 0; sign == 0 && areas.size[axis] == 0 && other < 3; ++other) {
      places = projected(points, corners, other);
      sign = areaSign(places);
    }
  }
  corners_.clear();
  std::array<Range, 2> ranges = {Range{places[0][0], places[0][0]}, {places[0][1], places[0][1]}};
  double largest = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (const std::size_t k : {0U, 1U}) {
      ranges[k] = {std::min(ranges[k].low, places[i][k]), std::max(ranges[k].high, places[i][k])};
      largest = std::max(largest, std::fabs(places[i][k]));
    }
    if (sign < 0) std::swap(places[i][0], places[i][1]);
    corners_.push_back({corners[i], places[i]});
  }
  const double extent = std::max(ranges[0].high - ranges[0].low, ranges[1].high - ranges[1].low);
  tolerance_ = std::min(0x1p-20 * largest, 0x1p-10 * extent);
}

bool PolygonCutter::isTwoWay(const Corner& from, const Corner& to) const {
  return edges_.count({to.place, from.place}) > 0;
}

bool PolygonCutter::isDoubtful(std::size_t corner) const {
  const Corner& at = corners_[corner];
  return isTwoWay(corners_[at.last], at) && isTwoWay(at, corners_[at.next]);
}

void PolygonCutter::readTurn(std::size_t corner) {
  Corner& at = corners_[corner];
  at.turn = side_(corners_[at.last].place, at.place, corners_[at.next].place);
  if (at.turn > 0 || at.is_blocker) return;
  at.is_blocker = true;
  blockers_.push_back(corner);
}

PolygonCutter::Ear PolygonCutter::earAt(std::size_t corner) {
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
    if (enters(side_, corners_[blocker.last].place, place, triangle) ||
        enters(side_, place, corners_[blocker.next].place, triangle)) {
      return Ear::kNone;
    }
    if (ear == Ear::kFree && place != a && place != c && side_(a, c, place) == 0 &&
        isBetween(a, place, c)) {
      ear = Ear::kTouched;
    }
  }
  return ear;
}

void PolygonCutter::readEar(std::size_t corner) {
  Corner& at = corners_[corner];
  if (at.ear != Ear::kNone) ears_.erase({at.ear, at.length, corner});
  at.ear = earAt(corner);
  if (at.ear == Ear::kNone) return;
  at.length = distance(*points_, corners_[at.last].point, corners_[at.next].point);
  ears_.emplace(at.ear, at.length, corner);
}

/// Short new edges make triangles that are no needles. Only what becomes of a corner's neighbors
/// changes what its triangle is, so each triangle is looked at a few times.
bool PolygonCutter::takeOffEars(double tolerance) {
  side_ = Sides(tolerance);
  blockers_.clear();
  ears_.clear();
  triangles_.clear();
  edges_.clear();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    Corner& at = corners_[i];
    at = {at.point, at.place};
    at.last = (i == 0 ? corners_.size() : i) - 1;
    at.next = i + 1 == corners_.size() ? 0 : i + 1;
    edges_.emplace(at.place, corners_[at.next].place);
  }
  for (std::size_t i = 0; i < corners_.size(); ++i) readTurn(i);
  for (std::size_t i = 0; i < corners_.size(); ++i) readEar(i);
  while (triangles_.size() + 2 < corners_.size()) {
    if (ears_.empty()) return false;
    const auto [ear, length, corner] = *ears_.begin();
    ears_.erase(ears_.begin());
    Corner& at = corners_[corner];
    if ((ear == Ear::kFree || ear == Ear::kTouched) && isDoubtful(corner)) {
      at.ear = Ear::kDoubtful;
      ears_.emplace(at.ear, length, corner);
      continue;
    }
    Corner &a = corners_[at.last], &c = corners_[at.next];
    at.ear = Ear::kNone;
    at.turn = 1;  // It blocks no more.
    triangles_.push_back({at.last, corner, at.next});
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

bool PolygonCutter::overlap() const {
  struct Boxed {
    Triangle triangle;
    Range x, y;
  };
  std::vector<Boxed> boxed;
  for (const auto& [a, b, c] : triangles_) {
    const Triangle triangle = {corners_[a].place, corners_[b].place, corners_[c].place};
    if (side_(triangle[0], triangle[1], triangle[2]) == 0) continue;
    boxed.push_back({triangle, rangeOf(triangle, 0), rangeOf(triangle, 1)});
  }
  std::sort(boxed.begin(), boxed.end(),
            [](const Boxed& p, const Boxed& q) { return p.x.low < q.x.low; });
  for (auto p = boxed.begin(); p != boxed.end(); ++p) {
    for (auto q = std::next(p); q != boxed.end() && q->x.low < p->x.high; ++q) {
      if (!areApart(p->y, q->y) && overlaps(side_, p->triangle, q->triangle)) return true;
    }
  }
  return false;
}

bool PolygonCutter::cut(const std::vector<Point>& points, std::vector<std::int32_t>& corners,
                        std::vector<std::int32_t>& triangles) {
  leaveOutRepetitions(corners);
  if (corners.size() == 3) {
    triangles.insert(triangles.end(), corners.begin(), corners.end());
    return true;
  }
  points_ = &points;
  const std::vector<Point> seen = seenFromFirst(points, corners);
  project(points, corners, seen);
  if (!takeOffEars(0) && !takeOffEars(tolerance_)) {
    if (seen.size() > 4 || !isTwisted(seen)) return false;
    const bool is_first_shorter =
        distance(points, corners[0], corners[2]) < distance(points, corners[1], corners[3]);
    const std::size_t i = is_first_shorter ? 0 : 1;
    triangles_ = {{i, i + 1, i + 2}, {i + 2, (i + 3) % 4, i}};
  }
  for (const std::array<std::size_t, 3>& triangle : triangles_) {
    for (const std::size_t corner : triangle) triangles.push_back(corners_[corner].point);
  }
  return true;
}

}  // namespace fcl_fibers::io
