// SPDX-License-Identifier: BSD-3-Clause
#include "page_contacts.h"

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <utility>

#include "first_of.h"

namespace fcl_fibers::tools {
namespace {

struct DeepPair {
  FoundPair pair;
  double depth;
};

bool isDeeper(const DeepPair& p, const DeepPair& q) {
  return std::tie(q.depth, p.pair.a, p.pair.mesh, p.pair.b) <
         std::tie(p.depth, q.pair.a, q.pair.mesh, q.pair.b);
}

/// The deepest last.
template <typename ContactOf>
std::vector<Marker> markersOf(FirstOf<DeepPair>& deepest, ContactOf&& contactOf) {
  const std::vector<DeepPair> pairs = deepest.take();
  std::vector<Marker> markers;
  markers.reserve(pairs.size());
  std::for_each(pairs.rbegin(), pairs.rend(), [&](const DeepPair& deep) {
    markers.push_back({contactOf(deep.pair), deep.depth});
  });
  return markers;
}

}  // namespace

PageContacts findPageContacts(const PairSearch& search, std::size_t most_markers) {
  FoundPairs all = findPairs(search);
  PageContacts found;
  found.stopped = !all.complete;
  found.touching = std::move(all.touching);
  const auto contactIn = [&](const FoundPair& pair) {
    return contactOf(pair, search.scene, nullptr, *search.meshes);
  };
  FirstOf<DeepPair> pairs(most_markers, isDeeper), mesh_pairs(most_markers, isDeeper);
  for (const FoundPair& pair : all.pairs) {
    const FoundContact contact = contactIn(pair);
    const double depth = std::max(-contact.distance, 0.0);
    if (pair.mesh != kNoMesh) {
      ++found.mesh_count;
      mesh_pairs.add({pair, depth});
    } else {
      ++found.count;
      const double radii = search.scene.radiusAt(static_cast<std::size_t>(pair.a), contact.s) +
                           search.scene.radiusAt(static_cast<std::size_t>(pair.b), contact.t);
      pairs.add({pair, radii > 0 ? depth / radii : 0});
    }
  }
  found.markers = markersOf(pairs, contactIn);
  found.mesh_markers = markersOf(mesh_pairs, contactIn);
  return found;
}

PageContacts takeImpacts(const StepScene& step, const StepImpacts& all, double until,
                         std::size_t most_markers, std::size_t& first) {
  PageContacts found;
  found.stopped = !all.isComplete(until);
  found.touching.resize(step.start.points.size());
  for (; first < all.impacts.size() && all.impacts[first].time <= until; ++first) {
    const Impact& impact = all.impacts[first];
    const FoundContact contact(contactOf(step, impact));
    ++found.count;
    for (const std::int32_t point : {impact.pair.a, impact.pair.b}) {
      found.touching[static_cast<std::size_t>(point)] = 1;
    }
    if (found.markers.size() < most_markers) found.markers.push_back({contact, 0, impact.time});
  }
  return found;
}

}  // namespace fcl_fibers::tools
