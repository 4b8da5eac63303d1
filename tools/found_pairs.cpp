// SPDX-License-Identifier: BSD-3-Clause
#include "found_pairs.h"

#include <algorithm>
#include <cstdint>

namespace fcl_fibers::tools {

FoundPairs findPairs(const FiberTree& tree, const FiberPolylines& scene) {
  FoundPairs found;
  tree.findPairs(found.pairs);
  std::sort(found.pairs.begin(), found.pairs.end(), [](const SegmentPair& p, const SegmentPair& q) {
    return p.a != q.a ? p.a < q.a : p.b < q.b;
  });
  found.touching.resize(scene.segmentCount());
  for (const SegmentPair& pair : found.pairs) {
    for (const std::int32_t point : {pair.a, pair.b}) {
      // A fiber has one segment less than points.
      const auto first = static_cast<std::size_t>(point);
      found.touching[first - tree.fiberSegment(point).fiber] = 1;
    }
  }
  found.touching_segments =
      static_cast<std::size_t>(std::count(found.touching.begin(), found.touching.end(), 1));
  return found;
}

}  // namespace fcl_fibers::tools
