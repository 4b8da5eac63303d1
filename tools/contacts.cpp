// SPDX-License-Identifier: BSD-3-Clause
#include "contacts.h"

#include <algorithm>
#include <cstdint>

namespace fcl_fibers::tools {

namespace {

bool areNeighborsAcrossTheEnd(const FiberSegment& a, const FiberSegment& b, int ignored,
                              const scenes::FiberScene& scene) {
  if (a.fiber != b.fiber || !scene.isClosed(a.fiber)) return false;
  const std::size_t segments = scene.point_begin[a.fiber + 1] - scene.point_begin[a.fiber] - 1;
  return a.segment + segments - b.segment <= static_cast<std::size_t>(ignored);
}

}  // namespace

Contacts findContacts(const FiberTree& tree, const scenes::FiberScene& scene) {
  std::vector<SegmentPair> found;
  tree.findPairs(found);
  std::sort(found.begin(), found.end(), [](const SegmentPair& p, const SegmentPair& q) {
    return p.a != q.a ? p.a < q.a : p.b < q.b;
  });
  Contacts contacts;
  contacts.touching.resize(scene.segmentCount());
  contacts.pairs.reserve(found.size());
  for (const SegmentPair& pair : found) {
    const FiberSegment ends[] = {tree.fiberSegment(pair.a), tree.fiberSegment(pair.b)};
    if (areNeighborsAcrossTheEnd(ends[0], ends[1], tree.options().ignored_neighbors, scene)) {
      continue;
    }
    for (const FiberSegment& end : ends) {
      // A fiber has one segment less than points.
      contacts.touching[scene.point_begin[end.fiber] - end.fiber + end.segment] = 1;
    }
    contacts.pairs.emplace_back(ends[0], ends[1]);
  }
  contacts.touching_segments =
      static_cast<std::size_t>(std::count(contacts.touching.begin(), contacts.touching.end(), 1));
  return contacts;
}

}  // namespace fcl_fibers::tools
