// SPDX-License-Identifier: BSD-3-Clause
#include "tree/wrapped_spheres.h"

#include <algorithm>
#include <limits>

namespace fcl_fibers::tree {

using geometry::Ball;
using geometry::EnclosingSphere;
using geometry::Sphere;
using geometry::SupportSphere;
using geometry::Vec3d;

namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// A leaf that leaves its cage by less than this, relative to the radius, does not count as
/// escaped: the cage grows to enclose it. The number is far below what rounding to float adds. It
/// is far above rounding in double. Without it, that rounding would make a cage be recomputed
/// whenever a leaf touches it from inside.
constexpr double kEscape = 0x1p-30;

}  // namespace

template <int A>
void WrappedSpheres<A>::reserve(std::size_t leaves, std::size_t nodes,
                                parallel::Executor* executor) {
  constexpr std::size_t kRange = 1 << 14;
  const auto fill = [executor](auto& all, const auto& value) {
    parallel::forRanges(executor, all.size(), kRange, [&](std::size_t begin, std::size_t end) {
      std::fill(all.data() + begin, all.data() + end, value);
    });
  };
  leaf_balls_.resize(leaves);
  cages_.resize(nodes);
  // NaN differs from every ball, so that the first refit fits all nodes.
  fill(leaf_balls_, Ball{{0, 0, 0}, std::numeric_limits<double>::quiet_NaN()});
  fill(cages_, EnclosingSphere{});
}

template <int A>
void WrappedSpheres<A>::fitLeaves(const geometry::SegmentBlock& segments,
                                  geometry::BlockMask present, int count, double padding,
                                  std::int32_t leaf, Leaves& leaves, int /*first*/) {
  for (int i = 0; i < count; ++i) {
    if ((present >> i & 1u) == 0) continue;
    leaves.changed |= replaceLeaf(leaf + i, Ball::around(segments[i], padding));
  }
}

template <int A>
bool WrappedSpheres<A>::fitChunk(Nodes& nodes, std::int32_t begin, std::int32_t end,
                                 const Leaves& leaves) {
  if (leaves.changed) fitChunkAbove(nodes, begin, end);
  return leaves.changed;
}

template <int A>
void WrappedSpheres<A>::fitChunkAbove(Nodes& nodes, std::int32_t begin, std::int32_t end) {
  for (std::int32_t i = end; i-- > begin;) fitNode(nodes, static_cast<std::size_t>(i));
}

template <int A>
bool WrappedSpheres<A>::placeLeaves(Nodes& nodes, const std::int32_t* slots,
                                    const geometry::SegmentBlock& segments, int count,
                                    double padding) {
  bool changed = false;
  for (int i = 0; i < count; ++i) {
    if (slots[i] < 0) continue;
    const Node& node = nodes[static_cast<std::size_t>(slots[i] / kArity)];
    const std::int32_t leaf = leafAt(nodes.data(), node, slots[i] % kArity);
    changed |= replaceLeaf(leaf, Ball::around(segments[i], padding));
  }
  return changed;
}

template <int A>
bool WrappedSpheres<A>::fitLeaf(Nodes& /*nodes*/, std::int32_t /*node*/, int /*lane*/,
                                std::int32_t leaf, const geometry::Segment& segment,
                                double padding) {
  return replaceLeaf(leaf, Ball::around(segment, padding));
}

template <int A>
bool WrappedSpheres<A>::replaceLeaf(std::int32_t leaf, const Ball& ball) {
  Ball& kept = leaf_balls_[static_cast<std::size_t>(leaf)];
  const bool differs = !(kept == ball);
  kept = ball;
  return differs;
}

template <int A>
void WrappedSpheres<A>::fitNode(Nodes& nodes, std::size_t index) {
  Node& node = nodes[index];
  auto leaf = static_cast<std::size_t>(node.leaf_begin);
  for (int lane = 0; lane < node.child_count; ++lane) {
    const Link child = node.children[static_cast<std::size_t>(lane)];
    const auto below = static_cast<std::size_t>(child.isLeaf() ? 0 : child.node());
    const Ball& ball = child.isLeaf() ? leaf_balls_[leaf] : cages_[below].ball;
    node.pack.set(lane, Sphere::around(ball));
    leaf = child.isLeaf() ? leaf + 1 : static_cast<std::size_t>(nodes[below].leaf_end);
  }

  EnclosingSphere& cage = cages_[index];
  if (keepsCage(nodes, node, cage)) return;
  cage = enclosingSphere(leaf_balls_.data() + node.leaf_begin, node.leaf_end - node.leaf_begin,
                         cage.basis);
  is_recomputed_[index] = 1;
}

/// Moves the cage along with its basis. Returns false if it is no longer the minimum enclosing
/// sphere, because a leaf has escaped or a smaller sphere suffices.
template <int A>
bool WrappedSpheres<A>::keepsCage(const Nodes& nodes, const Node& node,
                                  EnclosingSphere& cage) const {
  if (cage.basis.size == 0) return false;
  const Ball* members[4] = {};
  for (std::size_t i = 0; i < 4; ++i) {
    members[i] = &leaf_balls_[static_cast<std::size_t>(node.leaf_begin + cage.basis.ball[i])];
  }
  const auto support = geometry::supportSphere(members, cage.basis.size);
  if (!support || !support->isLeast()) return false;
  const double limit = support->ball.radius * (1 + kEscape);
  double reach = support->ball.radius;
  if (!encloses(nodes, node, support->ball.center, limit, reach)) return false;
  cage.ball = {support->ball.center, reach * (1 + 16 * kEps)};
  return true;
}

/// Whether all leaves below the node are within `limit` of `center`. It raises `reach` to the
/// farthest leaf. If the cage of a child is within the limit, so are its leaves. If the cage sticks
/// out, its children are tested, because perhaps no leaf sticks out (section 2.2, Fig. 4).
template <int A>
bool WrappedSpheres<A>::encloses(const Nodes& nodes, const Node& node, const Vec3d& center,
                                 double limit, double& reach) const {
  auto leaf = static_cast<std::size_t>(node.leaf_begin);
  for (int lane = 0; lane < node.child_count; ++lane) {
    const Link child = node.children[static_cast<std::size_t>(lane)];
    const auto below = static_cast<std::size_t>(child.isLeaf() ? 0 : child.node());
    const Ball& ball = child.isLeaf() ? leaf_balls_[leaf] : cages_[below].ball;
    const double far_side = norm(ball.center - center) + ball.radius;
    if (far_side <= limit) {
      reach = std::max(reach, far_side);
    } else if (child.isLeaf() || !encloses(nodes, nodes[below], center, limit, reach)) {
      return false;
    }
    leaf = child.isLeaf() ? leaf + 1 : static_cast<std::size_t>(nodes[below].leaf_end);
  }
  return true;
}

template <int A>
std::size_t WrappedSpheres<A>::memoryUsage() const {
  return leaf_balls_.capacity() * sizeof(Ball) + cages_.capacity() * sizeof(EnclosingSphere) +
         is_recomputed_.capacity();
}

template class WrappedSpheres<2>;
template class WrappedSpheres<8>;

}  // namespace fcl_fibers::tree
