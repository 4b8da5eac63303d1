// SPDX-License-Identifier: BSD-3-Clause
#include "page_contacts.h"

#include <algorithm>
#include <cstdint>

namespace fcl_fibers::tools {
namespace {

struct DeepPair {
  SegmentPair pair;
  double depth;
};

bool deeper(const DeepPair& p, const DeepPair& q) { return p.depth > q.depth; }

double relativeDepth(const FiberPolylines& scene, SegmentPair pair, const Contact& contact) {
  const double radii = scene.radiusAt(static_cast<std::size_t>(pair.a)) +
                       scene.radiusAt(static_cast<std::size_t>(pair.b));
  return radii > 0 ? std::max(-contact.distance / radii, 0.0) : 0;
}

}  // namespace

PageContacts findPageContacts(const FiberTree& tree, const FiberPolylines& scene,
                              std::size_t most_pairs, std::size_t most_markers) {
  PageContacts found;
  found.touching.resize(scene.segmentCount());
  const FiberArrays<double> arrays = fiberArrays(scene);
  std::vector<DeepPair> pairs;
  const auto keepDeepest = [&] {
    if (pairs.size() <= most_markers) return;
    const auto end = pairs.begin() + static_cast<std::ptrdiff_t>(most_markers);
    std::nth_element(pairs.begin(), end, pairs.end(), deeper);
    pairs.erase(end, pairs.end());
  };
  found.stopped = tree.visitPairs([&](SegmentPair pair) {
    if (found.count == most_pairs) return true;
    ++found.count;
    const Contact contact = capsuleContact(arrays, pair);
    // A fiber has one segment less than points.
    found.touching[static_cast<std::size_t>(pair.a) - contact.a.fiber] = 1;
    found.touching[static_cast<std::size_t>(pair.b) - contact.b.fiber] = 1;
    pairs.push_back({pair, relativeDepth(scene, pair, contact)});
    if (pairs.size() == 2 * most_markers) keepDeepest();
    return false;
  });
  keepDeepest();
  std::sort(pairs.rbegin(), pairs.rend(), deeper);
  found.markers.reserve(pairs.size());
  for (const DeepPair& deep : pairs) {
    found.markers.push_back({capsuleContact(arrays, deep.pair), deep.depth});
  }
  return found;
}

}  // namespace fcl_fibers::tools
