// SPDX-License-Identifier: BSD-3-Clause
#include "index/triangle_filter.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "geometry/touch.h"
#include "geometry/triangle_distance.h"

namespace fcl_fibers::index {

using geometry::Segment;
using geometry::Triangle;
using tree::Pair;
using tree::SegmentId;

namespace {

/// The segments that were found to touch last, because pairs of one segment follow soon after each
/// other.
class RecentSegments {
 public:
  RecentSegments() { ids_.fill(-1); }
  bool has(SegmentId id) const { return ids_[entry(id)] == id; }
  void add(SegmentId id) { ids_[entry(id)] = id; }

 private:
  static constexpr std::size_t kEntries = 512;
  static std::size_t entry(SegmentId id) { return static_cast<std::size_t>(id) % kEntries; }
  std::array<SegmentId, kEntries> ids_;
};

}  // namespace

double TriangleFilter::error(const Segment& segment) const {
  return std::max(endPointError(segment), error_) + triangles_.error;
}

bool TriangleFilter::touches(const Pair& pair) const {
  const Segment segment = segments_[pair.a];
  const Triangle triangle = triangles_[pair.b];
  if (!segment.isBox()) return geometry::touch(segment, triangle, margin_, error(segment));
  const Segment box = Segment::box(min(min(triangle.a, triangle.b), triangle.c),
                                   max(max(triangle.a, triangle.b), triangle.c));
  return geometry::boxesTouch(segment, box, margin_ + std::max(error_, 0.0) + triangles_.error);
}

std::size_t TriangleFilter::keepTouching(Pair* pairs, std::size_t count) const {
  constexpr std::size_t kAhead = 8;
  const auto& points = triangles_.mesh.points();
  const auto& corners = triangles_.mesh.triangles();
  RecentSegments touching;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) {
      const Pair& ahead = pairs[i + kAhead];
      segments_.prefetch(ahead.a);
      const std::int32_t corner = corners[static_cast<std::size_t>(ahead.b)].a;
      __builtin_prefetch(&points[static_cast<std::size_t>(corner)]);
    }
    const Pair pair = pairs[i];
    if ((once_ && touching.has(pair.a)) || !touches(pair)) continue;
    if (once_) touching.add(pair.a);
    pairs[kept++] = pair;
  }
  return kept;
}

}  // namespace fcl_fibers::index
