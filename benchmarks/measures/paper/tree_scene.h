// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contenders/contender.h"
#include "geometry/segment.h"
#include "tree/bundle.h"
#include "tree/bvh.h"
#include "tree/topology.h"

namespace fcl_fibers::benchmarks {

/// Fibers where they are now, as the trees read them, without managers and their frames in between.
struct TreeScene {
  explicit TreeScene(const MovingFibers& moving) {
    for (const Capsule& c : moving.capsules()) {
      segments.push_back(
          {{c.from.x(), c.from.y(), c.from.z()}, {c.to.x(), c.to.y(), c.to.z()}, c.radius});
    }
    for (const MovingFibers::Fiber& fiber : moving.fibers()) {
      for (const Object* object : fiber.objects) {
        fibers.ids.push_back(static_cast<tree::SegmentId>(MovingFibers::index(object)));
      }
      fibers.endFiber();
    }
  }

  std::vector<tree::Middle> middles() const {
    std::vector<tree::Middle> middles;
    for (const tree::SegmentId id : fibers.ids) {
      middles.push_back(tree::middleOf(segments[static_cast<std::size_t>(id)]));
    }
    return middles;
  }

  std::vector<geometry::Segment> segments;
  tree::Fibers fibers;
};

/// Calls visit(tree) with the tree that a contender of ours builds over fibers.
template <class F>
void withTree(const Contender& contender, const MovingFibers& fibers, F&& visit) {
  const TreeScene scene(fibers);
  const auto with = [&](auto&& tree) {
    tree.refit(scene.segments, 0);
    visit(tree);
  };
  const bool spheres = contender.manager == "WrappedSphereTree";
  if (contender.variant == "super_thread") {
    const auto topology = superThread(scene.fibers);
    spheres ? with(tree::WrappedSphereTree<2>(topology)) : with(tree::LayeredBoxTree<2>(topology));
  } else {
    const auto topology = bundle(scene.fibers, scene.middles());
    spheres ? with(tree::WrappedSphereTree<8>(topology)) : with(tree::LayeredBoxTree<8>(topology));
  }
}

}  // namespace fcl_fibers::benchmarks
