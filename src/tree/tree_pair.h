// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <type_traits>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/frame.h"
#include "geometry/posed_change.h"
#include "tree/bvh.h"
#include "tree/moving_tree.h"
#include "tree/segment_range.h"

namespace fcl_fibers::tree {

/// The boxes of a mesh's triangles. Its leaves are numbers of triangles.
using MeshTree = LayeredBoxTree<8>;

/// Takes volumes of segments into a frame that may be turned. Around a leaf it is as tight there as
/// the volume is in its own frame, whatever the rotation.
class PosedSegments : public geometry::PosedChange<geometry::Box> {
 public:
  PosedSegments(const geometry::AffineMap& map, double growth, const SegmentRange& segments,
                double padding)
      : PosedChange(map, growth), segments_(segments), padding_(padding) {}

  template <class Volume>
  FCL_FIBERS_ALWAYS_INLINE geometry::Box ofLeaf(SegmentId id, const Volume& volume) const {
    const geometry::Segment segment = segments_[id];
    return segment.isBox() ? (*this)(volume) : ofCapsule(segment, padding_);
  }

  FCL_FIBERS_ALWAYS_INLINE void prefetchLeaf(SegmentId id) const { segments_.prefetch(id); }

 private:
  SegmentRange segments_;
  double padding_;
};

/// Takes boxes into another frame. Most frames are not turned, and need no product of matrices.
/// Only leaves that are segments are asked for by ofLeaf().
class BoxChange {
 public:
  BoxChange(const geometry::FrameChange& straight) : straight_(straight) {}
  BoxChange(const PosedSegments& turned) : straight_(1, {0, 0, 0}, 0), turned_(turned) {}

  bool isIdentity() const { return !turned_ && straight_.isIdentity(); }
  double scale() const { return turned_ ? turned_->scale() : straight_.scale(); }
  FCL_FIBERS_ALWAYS_INLINE geometry::Box operator()(const geometry::Box& box) const {
    return turned_ ? turn(box) : straight_(box);
  }
  FCL_FIBERS_ALWAYS_INLINE geometry::Box ofLeaf(SegmentId id, const geometry::Box& box) const {
    return turned_ ? turnLeaf(id, box) : straight_(box);
  }

  /// @pre it is not turned
  const geometry::FrameChange& straight() const { return straight_; }
  const std::optional<PosedSegments>& turned() const { return turned_; }

 private:
  __attribute__((noinline)) geometry::Box turn(const geometry::Box& box) const {
    return (*turned_)(box);
  }
  __attribute__((noinline)) geometry::Box turnLeaf(SegmentId id, const geometry::Box& box) const {
    return turned_->ofLeaf(id, box);
  }

  geometry::FrameChange straight_;
  std::optional<PosedSegments> turned_;
};

/// The change of volumes of one tree into the frame of another, for two types of volumes.
template <class From, class To>
using ChangeBetween = std::conditional_t<
    std::is_same_v<From, To>,
    std::conditional_t<std::is_same_v<From, geometry::Box>, BoxChange, geometry::FrameChange>,
    std::conditional_t<std::is_same_v<To, geometry::Box>, PosedSegments,
                       geometry::PosedChange<To>>>;

/// Two trees and the changes between their frames. Their groups are independent.
template <class TreeA, class TreeB = TreeA>
struct TreePair {
  using BToA = ChangeBetween<typename TreeB::Volume, typename TreeA::Volume>;
  using AToB = ChangeBetween<typename TreeA::Volume, typename TreeB::Volume>;

  /// Whether the trees need no change.
  bool isInOneFrame() const {
    return meets == nullptr && b_to_a.isIdentity() && a_to_b.isIdentity();
  }

  const TreeA& a;
  const TreeB& b;
  BToA b_to_a;
  AToB a_to_b;
  /// If it is not null, a segment of A meets B only if the categories of its slot and these meet.
  /// See Topology.
  const Categories* meets = nullptr;
  Categories categories = kAllCategories;
};

inline const Categories* meetsOf(const parallel::UnwrittenVector<Categories>& by_slot) {
  return by_slot.empty() ? nullptr : by_slot.data();
}

/// A tree of segments, and the tree of a mesh at a place.
template <class Tree>
using MeshPair = TreePair<Tree, MeshTree>;

/// @param growth      length by which the volumes of the mesh grow, in the frame of the segments
/// @param segments    of the leaves of a; a box among them counts by its volume
/// @param categories  of the mesh
template <class Tree>
MeshPair<Tree> meshPair(const Tree& a, const MeshTree& b, const geometry::AffineMap& b_to_a,
                        double growth, const SegmentRange& segments, Categories categories) {
  using geometry::FrameChange;
  if constexpr (std::is_same_v<Tree, LayeredBoxTree<Tree::kArity>>) {
    if (!b_to_a.turns()) {
      const double scale = b_to_a.column[0].x;
      return {a,
              b,
              FrameChange(scale, b_to_a.shift, growth),
              FrameChange(1 / scale, (-1 / scale) * b_to_a.shift, growth / scale),
              meetsOf(a.meets()),
              categories};
    }
  }
  const geometry::PosedChange<typename Tree::Volume> posed(b_to_a, growth);
  // The inverse stretches most where the map stretches least.
  const PosedSegments back(b_to_a.inverse(), growth / posed.scale(), segments, a.padding());
  if constexpr (std::is_same_v<Tree, LayeredBoxTree<Tree::kArity>>) {
    return {a,
            b,
            PosedSegments(b_to_a, growth, segments, a.padding()),
            back,
            meetsOf(a.meets()),
            categories};
  } else {
    return {a, b, posed, back, meetsOf(a.meets()), categories};
  }
}

/// A step of a tree of segments and a step of the tree of a mesh, in one frame.
template <int Arity>
using MovingMeshPair = TreePair<MovingTree<Arity>, MovingTree<MeshTree::kArity>>;

/// @param growth      length by which the volumes of the mesh grow
/// @param categories  of the mesh
template <int Arity>
MovingMeshPair<Arity> movingMeshPair(const MovingTree<Arity>& a,
                                     const MovingTree<MeshTree::kArity>& b, double growth,
                                     Categories categories) {
  const geometry::FrameChange grown(1, {0, 0, 0}, growth);
  return {a, b, grown, grown, meetsOf(a.meets()), categories};
}

}  // namespace fcl_fibers::tree
