// SPDX-License-Identifier: BSD-3-Clause
#include "index/mesh_index.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "geometry/rounding.h"
#include "tree/bundle.h"

namespace fcl_fibers::index {

using geometry::MeshPoint;
using geometry::Segment;
using geometry::TriangleIndices;
using geometry::Vec3d;

MeshIndex::MeshIndex(std::vector<MeshPoint> points, std::vector<TriangleIndices> triangles)
    : points_(std::move(points)), triangles_(std::move(triangles)) {
  chooseFrame();
  tree::Fibers one_each;
  std::vector<tree::Middle> middles;
  one_each.ids.reserve(triangles_.size());
  one_each.begin.reserve(triangles_.size() + 1);
  middles.reserve(triangles_.size());
  for (TriangleId id = 0; id < static_cast<TriangleId>(triangles_.size()); ++id) {
    one_each.ids.push_back(id);
    one_each.endFiber();
    middles.push_back(tree::middleOf(boxOf(id, points_, frame_)));
  }
  tree_ = MeshTree(tree::bundle(one_each, middles));
  fit(tree_, points_, frame_, nullptr);
}

MeshTree MeshIndex::posedTree(const std::vector<MeshPoint>& points,
                              const geometry::AffineMap& posing,
                              parallel::Executor* executor) const {
  std::vector<MeshPoint> posed(points.size());
  constexpr std::size_t kGrain = 4096;
  parallel::forRanges(executor, points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d p = posing(toVec3d(points[i]));
      posed[i] = {{p.x, p.y, p.z, 0}};
    }
  });
  MeshTree tree = tree_;
  fit(tree, posed, geometry::Frame(), executor);
  return tree;
}

geometry::Triangle MeshIndex::triangle(TriangleId id) const {
  const TriangleIndices& t = triangles_[static_cast<std::size_t>(id)];
  const auto point = [this](std::int32_t i) {
    return toVec3d(points_[static_cast<std::size_t>(i)]);
  };
  return {point(t.a), point(t.b), point(t.c)};
}

namespace {

const MeshPoint& at(const std::vector<MeshPoint>& points, std::int32_t i) {
  return points[static_cast<std::size_t>(i)];
}

}  // namespace

/// The box of a triangle, as the index of segments knows boxes.
FCL_FIBERS_ALWAYS_INLINE Segment MeshIndex::boxOf(TriangleId id,
                                                  const std::vector<MeshPoint>& points,
                                                  const geometry::Frame& frame) const {
  const TriangleIndices& t = triangles_[static_cast<std::size_t>(id)];
  const MeshPoint &a = at(points, t.a), &b = at(points, t.b), &c = at(points, t.c);
  MeshPoint low, high;
  // The fourth number is there so that compilers compare whole vectors.
  for (int k = 0; k < 4; ++k) {
    low.numbers[k] = std::min(std::min(a.numbers[k], b.numbers[k]), c.numbers[k]);
    high.numbers[k] = std::max(std::max(a.numbers[k], b.numbers[k]), c.numbers[k]);
  }
  return Segment::box(frame.fromWorld(toVec3d(low)), frame.fromWorld(toVec3d(high)));
}

bool MeshIndex::hasTrianglesOf(const MeshIndex& other) const {
  const auto same = [](const TriangleIndices& p, const TriangleIndices& q) {
    return p.a == q.a && p.b == q.b && p.c == q.c;
  };
  return this == &other || (points_.size() == other.points_.size() &&
                            std::equal(triangles_.begin(), triangles_.end(),
                                       other.triangles_.begin(), other.triangles_.end(), same));
}

void MeshIndex::chooseFrame() {
  frame_ = {};
  reach_ = 0;
  if (points_.empty()) return;
  Vec3d low = toVec3d(points_[0]), high = low;
  for (const MeshPoint& point : points_) {
    low = min(low, toVec3d(point));
    high = max(high, toVec3d(point));
  }
  reach_ = std::max(maxNorm(low), maxNorm(high));
  frame_.origin = 0.5 * low + 0.5 * high;
  const double size = maxNorm(0.5 * high - 0.5 * low);
  if (size > 0) frame_.scale = std::ldexp(1.0, std::clamp(50 - std::ilogb(size), -1000, 1000));
}

void MeshIndex::fit(MeshTree& tree, const std::vector<MeshPoint>& points,
                    const geometry::Frame& frame, parallel::Executor* executor) const {
  const auto read = [&](const TriangleId* ids, int count, int ahead,
                        geometry::SegmentBlock& block) {
    for (int i = count; i < count + ahead; ++i) {
      const TriangleIndices& next = triangles_[static_cast<std::size_t>(ids[i])];
      for (const std::int32_t corner : {next.a, next.b, next.c})
        __builtin_prefetch(&at(points, corner));
    }
    for (int i = 0; i < count; ++i) block.set(i, boxOf(ids[i], points, frame));
    return geometry::firstOfBlock(count);
  };
  tree.startRefit(/*padding=*/0);
  std::atomic<bool> changed{false};
  constexpr std::size_t kGrain = 16;
  parallel::forRanges(executor, tree.chunkCount(), kGrain, [&](std::size_t begin, std::size_t end) {
    bool some_changed = false;
    for (std::size_t chunk = begin; chunk < end; ++chunk) {
      some_changed |= tree.fitChunk(chunk, read);
    }
    if (some_changed) changed = true;
  });
  tree.fitAboveChunks(changed, read);
}

std::size_t MeshIndex::memoryUsage() const {
  return sizeof(*this) + points_.capacity() * sizeof(MeshPoint) +
         triangles_.capacity() * sizeof(TriangleIndices) + tree_.memoryUsage();
}

bool isInsideOut(const MeshIndex& mesh) {
  return faceInward(mesh.triangles(), [&](std::int32_t i) {
    return mesh.frame().fromWorld(toVec3d(mesh.points()[static_cast<std::size_t>(i)]));
  });
}

namespace {

struct Leak {
  TriangleId triangle = -1;
  std::int32_t from = -1, to = -1;  ///< the edge
};

Leak findLeak(const std::vector<TriangleIndices>& triangles) {
  struct Edge {
    std::int32_t low, high;
    TriangleId triangle;
    bool ascends;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const TriangleIndices& t = triangles[i];
    const std::int32_t corners[4] = {t.a, t.b, t.c, t.a};
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(corners[k], corners[k + 1]);
      edges.push_back({low, high, static_cast<TriangleId>(i), corners[k] < corners[k + 1]});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) {
    return std::tie(p.low, p.high, p.triangle) < std::tie(q.low, q.high, q.triangle);
  });
  Leak leak;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    while (end < edges.size() && edges[end].low == edges[i].low &&
           edges[end].high == edges[i].high) {
      ++end;
    }
    const Edge& edge = edges[i];
    const bool is_shared =
        end - i == 2 && edge.low != edge.high && edge.ascends != edges[i + 1].ascends;
    if (!is_shared && (leak.triangle < 0 || edge.triangle < leak.triangle)) {
      leak = {edge.triangle, edge.ascends ? edge.low : edge.high,
              edge.ascends ? edge.high : edge.low};
    }
    i = end;
  }
  return leak;
}

/// Returns for each point the first one that lies at the same place.
std::vector<std::int32_t> firstAtPlace(const std::vector<MeshPoint>& points) {
  std::vector<std::int32_t> order(points.size()), first(points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](std::int32_t i) {
    const Vec3d p = toVec3d(points[static_cast<std::size_t>(i)]);
    return std::tuple(p.x, p.y, p.z);
  };
  std::sort(order.begin(), order.end(), [&](std::int32_t i, std::int32_t j) {
    return std::tuple(place(i), i) < std::tuple(place(j), j);
  });
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool is_first = k == 0 || place(order[k]) != place(order[k - 1]);
    first[static_cast<std::size_t>(order[k])] =
        is_first ? order[k] : first[static_cast<std::size_t>(order[k - 1])];
  }
  return first;
}

}  // namespace

TriangleId firstLeak(const std::vector<TriangleIndices>& triangles) {
  return findLeak(triangles).triangle;
}

std::string leakProblem(const std::vector<MeshPoint>& points,
                        const std::vector<TriangleIndices>& triangles) {
  const Leak leak = findLeak(triangles);
  const std::string edge = "the edge from point " + std::to_string(leak.from) + " to point " +
                           std::to_string(leak.to) + " of triangle " +
                           std::to_string(leak.triangle);
  // Files often repeat the points of each triangle, or those at a seam.
  const std::vector<std::int32_t> first = firstAtPlace(points);
  const auto merged = [&](std::int32_t i) { return first[static_cast<std::size_t>(i)]; };
  std::vector<TriangleIndices> shared = triangles;
  for (TriangleIndices& t : shared) t = {merged(t.a), merged(t.b), merged(t.c)};
  const TriangleId other_leak = findLeak(shared).triangle;
  if (other_leak < 0 || other_leak > leak.triangle) {
    return edge +
           " is shared with no other triangle, because points that lie at the same place are "
           "not one point; merge such points";
  }
  return edge +
         " is not that of exactly one other triangle in the opposite direction; close the "
         "mesh";
}

}  // namespace fcl_fibers::index
