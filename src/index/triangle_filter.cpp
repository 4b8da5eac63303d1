// SPDX-License-Identifier: BSD-3-Clause
#include "index/triangle_filter.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "geometry/triangle_test.h"

namespace fcl_fibers::index {

using geometry::PairBlock;
using geometry::Segment;
using geometry::Triangle;
using geometry::TriangleIndices;
using geometry::TrianglePairs;
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

TriangleFilter::TriangleFilter(tree::SegmentRange segments, const PosedTriangles& triangles,
                               double margin, double error, bool once, double unit)
    : segments_(segments),
      triangles_(triangles),
      margin_(margin),
      error_(error),
      unit_(unit),
      once_(once) {
  const double most = std::max(segments.mostError(), error) + triangles.error;
  if (PairBlock::isSmall(unit * most)) error_of_all_ = most;
}

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

std::size_t TriangleFilter::keep(Pair* pairs, std::size_t count,
                                 std::vector<geometry::Impact>& /*impacts*/) const {
  constexpr std::size_t kAhead = TrianglePairs::kCapacity;
  const geometry::MeshPoint* const points = triangles_.mesh.points().data();
  const TriangleIndices* const corners = triangles_.mesh.triangles().data();
  TrianglePairs block(triangles_.posing, unit_);
  std::array<Pair, TrianglePairs::kCapacity> added;
  RecentSegments touching;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count;) {
    block.clear();
    for (; i < count && block.size() < TrianglePairs::kCapacity; ++i) {
      if (i + 2 * kAhead < count) __builtin_prefetch(&corners[pairs[i + 2 * kAhead].b]);
      if (i + kAhead < count) {
        const Pair& ahead = pairs[i + kAhead];
        if (ahead.a != pairs[i + kAhead - 1].a) segments_.prefetch(ahead.a);
        const TriangleIndices& t = corners[ahead.b];
        for (const std::int32_t corner : {t.a, t.b, t.c}) __builtin_prefetch(&points[corner]);
      }
      const Pair pair = pairs[i];
      if (once_ && touching.has(pair.a)) continue;
      const TriangleIndices& t = corners[pair.b];
      added[static_cast<std::size_t>(block.size())] = pair;
      block.add(segments_.capsule(pair.a), {&points[t.a], &points[t.b], &points[t.c]}, margin_,
                error_of_all_ >= 0 ? error_of_all_ : error(segments_[pair.a]));
    }
    const TrianglePairs::Verdict verdict = block.decide();
    for (int k = 0; k < block.size(); ++k) {
      if ((verdict.apart >> k & 1u) != 0) continue;
      const Pair pair = added[static_cast<std::size_t>(k)];
      if ((verdict.touching >> k & 1u) == 0 && !touches(pair)) continue;
      if (once_) touching.add(pair.a);
      pairs[kept++] = pair;
    }
  }
  return kept;
}

}  // namespace fcl_fibers::index
