// SPDX-License-Identifier: BSD-3-Clause
#include "tree/mesh_search.h"

#include "geometry/posed_change.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/mesh_search.cpp"
#include <hwy/foreach_target.h>

#include "tree/queries-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

using geometry::AffineMap;
using geometry::Box;
using geometry::FrameChange;
using geometry::PosedChange;
using geometry::Segment;

/// Takes volumes of segments into the frame of a mesh. Around a leaf it is as tight there as the
/// volume is in its own frame, whatever the rotation.
class SegmentsToMesh : public PosedChange<Box> {
 public:
  SegmentsToMesh(const AffineMap& map, double growth, const SegmentRange& segments, double padding)
      : PosedChange(map, growth), segments_(segments), padding_(padding) {}

  template <class Volume>
  FCL_FIBERS_ALWAYS_INLINE Box ofLeaf(SegmentId id, const Volume& volume) const {
    const Segment segment = segments_[id];
    return segment.isBox() ? (*this)(volume) : ofCapsule(segment, padding_);
  }

  FCL_FIBERS_ALWAYS_INLINE void prefetchLeaf(SegmentId id) const { segments_.prefetch(id); }

 private:
  const SegmentRange segments_;
  const double padding_;
};

/// Calls visit(b_to_a, a_to_b) with the changes between the frames of a tree and a mesh.
template <class Tree, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withChanges(const MeshPair<Tree>& trees, F&& visit) {
  using Volume = typename Tree::Volume;
  const AffineMap& map = trees.b_to_a;
  const double growth = trees.growth + trees.error;
  if constexpr (std::is_same_v<Volume, Box>) {
    // Most meshes are not turned. Their boxes need no product of matrices.
    if (!map.turns()) {
      const double scale = map.column[0].x;
      return visit(FrameChange(scale, map.shift, growth),
                   FrameChange(1 / scale, (-1 / scale) * map.shift, growth / scale));
    }
  }
  const PosedChange<Volume> b_to_a(map, growth);
  // The inverse stretches most where the map stretches least.
  return visit(b_to_a, SegmentsToMesh(map.inverse(), growth / b_to_a.scale(), trees.segments,
                                      trees.a.padding()));
}

template <class Tree, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withBoth(const MeshPair<Tree>& trees, F&& visit) {
  return withChanges(trees, [&](const auto& b_to_a, const auto& a_to_b) HWY_ATTR {
    return withMeeting(trees.a, trees.categories,
                       [&](auto filter) HWY_ATTR { return visit(b_to_a, a_to_b, filter); });
  });
}

template <class Tree>
constexpr PairKernels<MeshPair<Tree>> kMeshKernels = {
    [](const MeshPair<Tree>& trees, TaskSink& out) HWY_ATTR {
      SplitIntoTasks query(out);
      return withBoth(trees, [&](const auto& b_to_a, const auto& a_to_b, auto filter) HWY_ATTR {
        return visitPairs(trees.a, trees.b, b_to_a, a_to_b, filter, query);
      });
    },
    [](const MeshPair<Tree>& trees, const TraversalTask& task, PairBuffer& out) HWY_ATTR {
      return withBoth(trees, [&](const auto& b_to_a, const auto& a_to_b, auto filter) HWY_ATTR {
        return overlapsOf(trees.a, trees.b, b_to_a, a_to_b, filter, task, out);
      });
    },
    [](const MeshPair<Tree>& trees, double limit, NearestVisitor& visitor) HWY_ATTR {
      VisitNearest query(limit, visitor);
      return withBoth(trees, [&](const auto& b_to_a, const auto& a_to_b, auto filter) HWY_ATTR {
        return visitPairs(trees.a, trees.b, b_to_a, a_to_b, filter, query);
      });
    },
};

const PairKernels<MeshPair<LayeredBoxTree<2>>>& meshBoxes2() {
  return kMeshKernels<LayeredBoxTree<2>>;
}
const PairKernels<MeshPair<LayeredBoxTree<8>>>& meshBoxes8() {
  return kMeshKernels<LayeredBoxTree<8>>;
}
const PairKernels<MeshPair<WrappedSphereTree<2>>>& meshSpheres2() {
  return kMeshKernels<WrappedSphereTree<2>>;
}
const PairKernels<MeshPair<WrappedSphereTree<8>>>& meshSpheres8() {
  return kMeshKernels<WrappedSphereTree<8>>;
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::tree {

HWY_EXPORT(meshBoxes2);
HWY_EXPORT(meshBoxes8);
HWY_EXPORT(meshSpheres2);
HWY_EXPORT(meshSpheres8);

template <class Tree>
const PairKernels<MeshPair<Tree>>& pairKernels(const MeshPair<Tree>& /*trees*/) {
  simd::readEnvironment();
  if constexpr (std::is_same_v<Tree, LayeredBoxTree<2>>) {
    return HWY_DYNAMIC_DISPATCH(meshBoxes2)();
  } else if constexpr (std::is_same_v<Tree, LayeredBoxTree<8>>) {
    return HWY_DYNAMIC_DISPATCH(meshBoxes8)();
  } else if constexpr (std::is_same_v<Tree, WrappedSphereTree<2>>) {
    return HWY_DYNAMIC_DISPATCH(meshSpheres2)();
  } else {
    return HWY_DYNAMIC_DISPATCH(meshSpheres8)();
  }
}

#define FCL_FIBERS_INSTANTIATE(Tree) \
  template const PairKernels<MeshPair<Tree>>& pairKernels(const MeshPair<Tree>&);
FCL_FIBERS_INSTANTIATE(LayeredBoxTree<2>)
FCL_FIBERS_INSTANTIATE(LayeredBoxTree<8>)
FCL_FIBERS_INSTANTIATE(WrappedSphereTree<2>)
FCL_FIBERS_INSTANTIATE(WrappedSphereTree<8>)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::tree
#endif
