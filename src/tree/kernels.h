// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>

#include "simd/lanes.h"
#include "tree/bvh.h"
#include "tree/moving_tree.h"
#include "tree/search.h"
#include "tree/tree_pair.h"

namespace fcl_fibers::tree {

/// A place in a node or in two, with a lower bound of a distance, as one number that orders places
/// by their distances.
class Place {
 public:
  Place() = default;
  FCL_FIBERS_ALWAYS_INLINE Place(float distance, int number) {
    std::uint32_t bits;  // have the order of the distances, because these are not negative
    std::memcpy(&bits, &distance, sizeof(bits));
    key_ = std::uint64_t{bits} << 32 | static_cast<std::uint32_t>(number);
  }
  int number() const { return static_cast<int>(static_cast<std::uint32_t>(key_)); }
  float distance() const {
    const auto bits = static_cast<std::uint32_t>(key_ >> 32);
    float distance;
    std::memcpy(&distance, &bits, sizeof(bits));
    return distance;
  }
  friend bool operator<(Place a, Place b) { return a.key_ < b.key_; }

 private:
  std::uint64_t key_;
};

/// What is compiled for each instruction set: tests of all children of a node, and the searches
/// that consist of little else.
template <class Tree>
struct Kernels {
  using Pack = typename Tree::Pack;
  using Volume = typename Tree::Volume;
  static constexpr bool kMoves = std::is_same_v<Volume, geometry::MovingBox>;
  using Mesh = std::conditional_t<kMoves, MovingTree<MeshTree::kArity>, MeshTree>;

  /// overlaps() of volume-inl.h
  simd::LaneMask (*overlaps)(const Pack& pack, const Volume& volume);
  /// Finds those of the lanes that may be no farther than `limit` from a volume, and adds a place
  /// with the number first + lane for each to `count` places. Returns how many there are then. Null
  /// if the tree moves.
  /// @param in_order  whether places are kept in order, which pays for few
  int (*nearer)(const Pack& pack, const Volume& volume, simd::LaneMask lanes, float limit,
                int first, Place* places, int count, bool in_order);

  /// visitOverlaps() of search.h
  ///@{
  Visit (*within)(const Tree& tree, const TraversalTask& task, PairBuffer& out);
  Visit (*between)(const TreePair<Tree>& trees, const TraversalTask& task, PairBuffer& out);
  Visit (*with_mesh)(const TreePair<Tree, Mesh>& trees, const TraversalTask& task, PairBuffer& out);
  Visit (*with_volume)(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                       PairBuffer& out);
  ///@}

  /// visitNearest() of search.h, for binary trees that do not move. Two children are tested so fast
  /// that a call of nearer() for each test would take several per cent more.
  ///@{
  Visit (*nearest)(const Tree& tree, double limit, NearestVisitor& visitor);
  Visit (*nearest_between)(const TreePair<Tree>& trees, double limit, NearestVisitor& visitor);
  Visit (*nearest_to_volume)(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                             double limit, NearestVisitor& visitor);
  ///@}
};

/// The kernels for the instruction set in use (simd/dispatch.h).
template <class Tree>
const Kernels<Tree>& kernels();
template <>
const Kernels<LayeredBoxTree<2>>& kernels();
template <>
const Kernels<LayeredBoxTree<8>>& kernels();
template <>
const Kernels<WrappedSphereTree<2>>& kernels();
template <>
const Kernels<WrappedSphereTree<8>>& kernels();
template <>
const Kernels<MovingTree<2>>& kernels();
template <>
const Kernels<MovingTree<8>>& kernels();

/// Visits the pairs between two slots one by one, in place of a kernel that has no room for more.
template <class Trees>
Visit visitOneByOne(const Trees& trees, std::int32_t a_slot, std::int32_t b_slot, PairBuffer& out);

}  // namespace fcl_fibers::tree
