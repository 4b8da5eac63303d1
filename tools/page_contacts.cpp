// SPDX-License-Identifier: BSD-3-Clause
#include "page_contacts.h"

#include <algorithm>
#include <cstdint>
#include <tuple>

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

double relativeDepth(const FiberPolylines& scene, SegmentPair pair, const Contact& contact) {
  const double radii = scene.radiusAt(static_cast<std::size_t>(pair.a)) +
                       scene.radiusAt(static_cast<std::size_t>(pair.b));
  return radii > 0 ? std::max(-contact.distance / radii, 0.0) : 0;
}

/// Notes that the segment which starts at a point is in a pair. A fiber has one segment less than
/// points.
void mark(std::int32_t point, const FiberSegment& place, PageContacts& found) {
  found.touching[static_cast<std::size_t>(point) - place.fiber] = 1;
}

}  // namespace

PageContacts findPageContacts(const FiberTree& tree, const FiberPolylines& scene,
                              const std::vector<MeshFile>& meshes, std::size_t most_pairs,
                              std::size_t most_markers) {
  PageContacts found;
  found.touching.resize(scene.segmentCount());
  const FiberArrays<double> arrays = fiberArrays(scene);
  FirstOf<DeepPair> pairs(most_markers, isDeeper), mesh_pairs(most_markers, isDeeper);
  found.stopped = tree.visit(Touching{}, [&](SegmentPair pair) {
    if (found.count == most_pairs) return true;
    ++found.count;
    const Contact contact = capsuleContact(arrays, pair);
    mark(pair.a, contact.a, found);
    mark(pair.b, contact.b, found);
    pairs.add({{pair.a, pair.b}, relativeDepth(scene, pair, contact)});
    return false;
  });
  found.markers = markersOf(pairs, [&](const FoundPair& pair) {
    return FoundContact(capsuleContact(arrays, {pair.a, pair.b}));
  });

  const auto meshContactOf = [&](const FoundPair& pair) {
    const TriangleMesh& mesh = meshes[static_cast<std::size_t>(pair.mesh)].mesh;
    return FoundContact(meshContact(arrays, mesh, {pair.a, pair.b}), pair.mesh);
  };
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const TouchingSegments touching = findTouching(tree, scene, meshes[m], most_pairs);
    found.mesh_count += touching.pairs.size();
    found.stopped = found.stopped || !touching.complete;
    for (const TrianglePair& pair : touching.pairs) {
      const FoundPair one = {pair.segment, pair.triangle, static_cast<std::int32_t>(m)};
      const FoundContact contact = meshContactOf(one);
      mark(pair.segment, contact.a, found);
      mesh_pairs.add({one, std::max(-contact.distance, 0.0)});
    }
  }
  found.mesh_markers = markersOf(mesh_pairs, meshContactOf);
  return found;
}

PageContacts takeImpacts(const StepScene& step, const StepImpacts& all, double until,
                         std::size_t most_markers, std::size_t& first) {
  PageContacts found;
  found.stopped = !all.isComplete(until);
  found.touching.resize(step.start.segmentCount());
  for (; first < all.impacts.size() && all.impacts[first].time <= until; ++first) {
    const Impact& impact = all.impacts[first];
    const FoundContact contact(contactOf(step, impact));
    ++found.count;
    mark(impact.pair.a, contact.a, found);
    mark(impact.pair.b, contact.b, found);
    if (found.markers.size() < most_markers) found.markers.push_back({contact, 0, impact.time});
  }
  return found;
}

}  // namespace fcl_fibers::tools
