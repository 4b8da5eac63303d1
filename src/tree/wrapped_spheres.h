// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/enclosing_sphere.h"
#include "geometry/segment_block.h"
#include "parallel/executor.h"
#include "tree/bvh_node.h"

namespace fcl_fibers::tree {

/// The hierarchy whose nodes keep their cage, the minimum enclosing sphere of the spheres of all
/// segments below, and the one to four of these that determine it. A refit is the cascade
/// verification of Guibas et al. (2002): Sobottka, Varnik and Weber, 2005, section 3.1.
template <int A>
class WrappedSpheres {
 public:
  using Volume = geometry::Sphere;
  static constexpr int kArity = A;
  using Pack = Volume::Pack<kArity>;
  using Nodes = parallel::UnwrittenVector<BvhNode<Pack, kArity>>;

  // See LayeredBoxes.

  struct Leaves {
    bool changed = false;  ///< whether any leaf of the chunk has changed
  };

  void reserve(std::size_t leaves, std::size_t nodes, parallel::Executor* executor);
  void startRefit() { is_recomputed_.assign(cages_.size(), 0); }
  /// Segments that are not present keep their spheres.
  void fitLeaves(const geometry::SegmentBlock& segments, geometry::BlockMask present, int count,
                 double padding, std::int32_t leaf, Leaves& leaves, int first);
  bool fitChunk(Nodes& nodes, std::int32_t begin, std::int32_t end, const Leaves& leaves);
  void fitChunkAbove(Nodes& nodes, std::int32_t begin, std::int32_t end);
  bool placeLeaves(Nodes& nodes, const std::int32_t* slots, const geometry::SegmentBlock& segments,
                   int count, double padding);
  bool fitLeaf(Nodes& nodes, std::int32_t node, int lane, std::int32_t leaf,
               const geometry::Segment& segment, double padding);
  bool holds(const typename Nodes::value_type&, int /*lane*/, std::int32_t leaf,
             const geometry::Segment& segment, double padding) const {
    return leaf_balls_[static_cast<std::size_t>(leaf)] == geometry::Ball::around(segment, padding);
  }
  void fitNode(Nodes& nodes, std::size_t index);
  Volume nodeVolume(const Nodes&, std::size_t index) const {
    return Volume::around(cages_[index].ball);
  }
  std::size_t memoryUsage() const;

  /// The cage of a node. Its basis counts from the first leaf of the node.
  const geometry::EnclosingSphere& cage(std::size_t node) const { return cages_[node]; }
  /// The spheres of the segments in the order of Topology::leaves.
  const parallel::UnwrittenVector<geometry::Ball>& leafBalls() const { return leaf_balls_; }

  /// The number of cages that the last refit recomputed. The others passed the verification, or
  /// nothing below them moved.
  std::size_t cagesRecomputed() const {
    return static_cast<std::size_t>(std::count(is_recomputed_.begin(), is_recomputed_.end(), 1));
  }

 private:
  using Node = typename Nodes::value_type;

  bool replaceLeaf(std::int32_t leaf, const geometry::Ball& ball);
  bool keepsCage(const Nodes& nodes, const Node& node, geometry::EnclosingSphere& cage) const;
  bool encloses(const Nodes& nodes, const Node& node, const geometry::Vec3d& center, double limit,
                double& reach) const;

  parallel::UnwrittenVector<geometry::Ball> leaf_balls_;
  parallel::UnwrittenVector<geometry::EnclosingSphere> cages_;
  std::vector<std::uint8_t> is_recomputed_;  ///< by node: whether the last refit recomputed it
};

extern template class WrappedSpheres<2>;
extern template class WrappedSpheres<8>;

}  // namespace fcl_fibers::tree
