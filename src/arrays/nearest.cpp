// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/nearest.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "arrays/pair_sinks.h"
#include "fibers/capsule_contact.h"
#include "fibers/options.h"
#include "geometry/segment_distance.h"
#include "geometry/triangle_distance.h"

namespace fcl_fibers::arrays {
namespace {

using geometry::FrameChange;
using geometry::Segment;
using geometry::Triangle;
using index::SegmentId;
using tree::Pair;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A distance of two surfaces, negative if they overlap, and a bound on its error.
struct Apart {
  double distance, error;
};
/// Of a pair that does not count. No comparison holds for it.
constexpr Apart kNoPair{std::numeric_limits<double>::quiet_NaN(), 0};

/// The error of closest points, and of a contact that is computed from the arrays, relative to the
/// lengths that contact.h bounds it by.
constexpr double kRounding = 0x1p-44;

/// @param error  bounds that of all end points together
Apart between(const Segment& p, const Segment& q, double error) {
  const geometry::ClosestPoints closest = closestPoints(p, q);
  const double axes = safeNorm(closest.apart);
  const double radii = p.radiusAt(closest.s) + q.radiusAt(closest.t);
  const double size = axes + norm1(p.b - p.a) + norm1(q.b - q.a) + p.radius + q.radius;
  return {axes - radii, error + kRounding * size};
}
Apart between(const Segment& p, const Triangle& t, double error) {
  const geometry::ClosestOnTriangle closest = closestPoints(p, t);
  const double axis = safeNorm(closest.apart);
  return {axis - p.radiusAt(closest.s),
          error + kRounding * (axis + norm1(p.a - t.a) + norm1(p.b - p.a) + norm1(t.b - t.a) +
                               norm1(t.c - t.a) + p.radius)};
}

/// Keeps the pairs that may be the nearest.
/// @tparam Measure  returns the Apart of two ids
template <class Measure>
class Candidates final : public index::NearestSink {
 public:
  /// @param most  the largest distance that counts
  Candidates(double most, const Measure& measure) : most_(most), measure_(measure) {}

  /// The search finds what is nearer than this, so even at distance 0 it is not 0.
  double limit() const override { return std::max(most_, 0.0) + 0x1p-900; }
  tree::Visit visit(SegmentId a, SegmentId b, double& limit) override {
    const Apart apart = measure_(a, b);
    if (apart.distance - apart.error <= most_) {
      found_.emplace_back(Pair{a, b}, apart.distance - apart.error);
      most_ = std::min(most_, apart.distance + apart.error);
      limit = this->limit();
    }
    return tree::Visit::kContinue;
  }

  template <class Visit>
  void forEach(Visit&& visit) const {
    for (const auto& [pair, least] : found_) {
      if (least <= most_) visit(pair);
    }
  }

 private:
  double most_;
  const Measure& measure_;
  std::vector<std::pair<Pair, double>> found_;  ///< with the least that the distance may be
};

/// Takes a segment to the frame of an index.
Segment taken(const std::string& call, const FrameChange& change, const Segment& segment) {
  const Segment moved = change(segment);
  if (fibers::contactProblem(moved) != nullptr) {
    fibers::throwInvalidArgument(
        call, "the coordinates of one tree overflow in the unit of the other; bring them nearer");
  }
  return moved;
}

}  // namespace

void findClosest(const std::string& call, const FiberIndex& own, const FiberIndex& other,
                 parallel::UnwrittenVector<SegmentPair>& pairs) {
  const bool is_own = &own == &other;
  const PairsOfOne counts(own.table());
  const FrameChange to_own(other->frame(), own->frame());
  const auto measure = [&](SegmentId a, SegmentId b) {
    Pair pair{a, b};
    if (is_own && !counts(pair)) return kNoPair;
    const Segment p = own->segment(a), q = taken(call, to_own, other->segment(b));
    return between(p, q, endPointError(p) + to_own.error(q));
  };
  Candidates candidates(kInfinity, measure);
  is_own ? own->search(candidates) : own->search(*other, nullptr, candidates);
  pairs.clear();
  candidates.forEach([&](Pair found) {
    if (is_own) counts(found);
    pairs.push_back({found.a, found.b});
  });
}

void findClosest(const FiberIndex& own, const index::PosedMesh& mesh,
                 parallel::UnwrittenVector<TrianglePair>& pairs) {
  const index::PosedTriangles& triangles = mesh.end();
  const auto measure = [&](SegmentId segment, index::TriangleId triangle) {
    const Segment p = own->segment(segment);
    return between(p, triangles[triangle], endPointError(p) + triangles.error());
  };
  Candidates candidates(kInfinity, measure);
  own->search(mesh, /*margin=*/0, candidates);
  pairs.clear();
  candidates.forEach([&](const Pair& found) { pairs.push_back({found.a, found.b}); });
}

tree::Visit findNearest(const std::string& call, const FiberIndex& own, const FiberIndex& other,
                        double distance, index::PairSink& sink) {
  const bool is_own = &own == &other;
  const FrameChange to_other(own->frame(), other->frame());
  const tree::SegmentIds& leaves = own->leaves();
  const PairsOfOne counts(own.table());
  const auto findOfLeaves = [&](std::size_t begin, std::size_t end, std::vector<Pair>& found) {
    for (std::size_t i = begin; i < end; ++i) {
      const SegmentId id = leaves[i];
      const Segment one = taken(call, to_other, own->segment(id));
      const double error = to_other.error(one);
      const auto measure = [&](SegmentId its, SegmentId /*second*/) {
        Pair pair{id, its};
        if (is_own && (its == id || !counts(pair))) return kNoPair;
        const Segment q = other->segment(its);
        return between(one, q, error + endPointError(q));
      };
      Candidates candidates(distance * other->frame().scale, measure);
      const tree::Group group = is_own ? own.table().groupOf(id) : tree::kNoGroup;
      other->search({one, one}, error, group, id, candidates);
      SegmentId nearest = std::numeric_limits<SegmentId>::max();
      candidates.forEach([&](const Pair& pair) { nearest = std::min(nearest, pair.a); });
      if (nearest != std::numeric_limits<SegmentId>::max()) found.push_back({id, nearest});
    }
  };
  constexpr std::size_t kGrain = 256;
  return own->findInRanges(leaves.size(), kGrain, sink, findOfLeaves);
}

}  // namespace fcl_fibers::arrays
