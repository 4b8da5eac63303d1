// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/enclosing_sphere.h"
#include "tree/topology.h"

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

  static std::int32_t slot(std::int32_t /*node*/, int /*lane*/, std::int32_t leaf) { return leaf; }
  void reserve(const Topology<kArity>& topology);
  bool fitLeaf(std::int32_t slot, const geometry::Segment& segment, double padding,
               std::vector<Pack>& packs);
  bool isFitted(std::int32_t slot, const geometry::Segment& segment, double padding,
                const std::vector<Pack>&) const {
    return leaf_balls_[static_cast<std::size_t>(slot)] == geometry::Ball::around(segment, padding);
  }
  /// It is inlined because gcc otherwise takes it for a function that does nothing.
  FCL_FIBERS_ALWAYS_INLINE void prefetchLeaf(std::int32_t slot, const std::vector<Pack>&) const {
    __builtin_prefetch(&leaf_balls_[static_cast<std::size_t>(slot)], 1);
  }
  void startRefit() { cages_recomputed_ = 0; }
  void fitNode(const Topology<kArity>& topology, std::size_t index, std::vector<Pack>& packs);
  Volume nodeVolume(std::size_t index, const std::vector<Pack>&) const {
    return Volume::around(cages_[index].ball);
  }
  std::size_t memoryUsage() const;

  /// The cage of a node. Its basis counts from the first leaf of the node.
  const geometry::EnclosingSphere& cage(std::size_t node) const { return cages_[node]; }
  /// The spheres of the segments in the order of Topology::leaves.
  const std::vector<geometry::Ball>& leafBalls() const { return leaf_balls_; }

  /// The number of cages that the last refit recomputed. The others passed the verification, or
  /// nothing below them moved.
  std::size_t cagesRecomputed() const { return cages_recomputed_; }

 private:
  using Node = typename Topology<kArity>::Node;

  bool keepsCage(const Topology<kArity>& topology, const Node& node,
                 geometry::EnclosingSphere& cage) const;
  bool encloses(const Topology<kArity>& topology, const Node& node, const geometry::Vec3d& center,
                double limit, double& reach) const;

  std::vector<geometry::Ball> leaf_balls_;
  std::vector<geometry::EnclosingSphere> cages_;
  std::size_t cages_recomputed_ = 0;
};

extern template class WrappedSpheres<2>;
extern template class WrappedSpheres<8>;

}  // namespace fcl_fibers::tree
