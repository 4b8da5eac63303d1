// SPDX-License-Identifier: BSD-3-Clause
#include "found_pairs.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>

namespace fcl_fibers::tools {
namespace {

/// Pairs a segment, on average, that no sensible radius gives.
constexpr std::size_t kManyPairs = 20;

/// @param search  calls its argument with each pair until that returns true, and returns whether
///                that ended it
template <typename Search>
FoundPairs collect(const FiberTree& tree, const FiberPolylines& scene, std::size_t limit,
                   bool has_other, Search&& search) {
  FoundPairs found;
  found.complete = !search([&](const SegmentPair& pair) {
    if (found.pairs.size() == limit) return true;
    found.pairs.push_back(pair);
    return false;
  });
  std::sort(found.pairs.begin(), found.pairs.end(), [](const SegmentPair& p, const SegmentPair& q) {
    return p.a != q.a ? p.a < q.a : p.b < q.b;
  });
  found.touching.resize(scene.segmentCount());
  std::vector<unsigned char> fibers(scene.fiberCount());
  const auto mark = [&](std::int32_t point) {
    // A fiber has one segment less than points.
    const std::size_t fiber = tree.fiberSegment(point).fiber;
    found.touching[static_cast<std::size_t>(point) - fiber] = 1;
    fibers[fiber] = 1;
  };
  for (const SegmentPair& pair : found.pairs) {
    mark(pair.a);
    if (!has_other) mark(pair.b);
  }
  const auto count = [](const std::vector<unsigned char>& flags) {
    return static_cast<std::size_t>(std::count(flags.begin(), flags.end(), 1));
  };
  found.touching_segments = count(found.touching);
  found.touching_fibers = count(fibers);
  return found;
}

}  // namespace

FoundPairs findPairs(const FiberTree& tree, const FiberPolylines& scene, std::size_t limit) {
  return collect(tree, scene, limit, false, [&](auto&& visit) { return tree.visitPairs(visit); });
}

FoundPairs findPairsBetween(const FiberTree& tree, const FiberPolylines& scene,
                            const FiberTree& other, std::size_t limit) {
  return collect(tree, scene, limit, true,
                 [&](auto&& visit) { return tree.visitPairs(other, visit); });
}

void warnOfMany(const FoundPairs& found, const FiberTree& tree, const std::string& scene) {
  if (!found.complete) {
    std::fprintf(stderr,
                 "fcl_fibers: warning: %s: the search ended after %zu pairs, so the answer is "
                 "incomplete. The radius is probably too large; `fcl_fibers info` tells the radius "
                 "at which contact begins. --limit N allows N pairs.\n",
                 scene.c_str(), found.pairs.size());
  } else if (tree.options().report == Report::kCapsules &&
             found.pairs.size() > kManyPairs * tree.segmentCount()) {
    std::fprintf(stderr,
                 "fcl_fibers: warning: %s: there are more than %zu pairs for each segment. The "
                 "radius is probably too large; `fcl_fibers info` tells the radius at which "
                 "contact begins.\n",
                 scene.c_str(), kManyPairs);
  }
}

}  // namespace fcl_fibers::tools
