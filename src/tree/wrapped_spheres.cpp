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
/// escaped: the cage grows to enclose it. This is far below what rounding to float adds. It is far
/// above rounding in double, by which a leaf that touches its cage from inside would always make it
/// be recomputed.
constexpr double kEscape = 0x1p-30;

}  // namespace

template <int A>
void WrappedSpheres<A>::reserve(const Topology<kArity>& topology) {
  leaf_balls_.resize(topology.leaves.size());
  cages_.resize(topology.nodes.size());
}

template <int A>
bool WrappedSpheres<A>::fitLeaf(std::int32_t slot, const geometry::Segment& segment, double padding,
                                std::vector<Pack>& /*packs*/) {
  const Ball ball = Ball::around(segment, padding);
  Ball& kept = leaf_balls_[static_cast<std::size_t>(slot)];
  const bool differs = !(kept == ball);
  kept = ball;
  return differs;
}

template <int A>
void WrappedSpheres<A>::fitNode(const Topology<kArity>& topology, std::size_t index,
                                std::vector<Pack>& packs) {
  const Node& node = topology.nodes[index];
  Pack& pack = packs[index];
  auto leaf = static_cast<std::size_t>(node.leaf_begin);
  for (int lane = 0; lane < node.child_count; ++lane) {
    const Link child = node.children[static_cast<std::size_t>(lane)];
    const auto below = static_cast<std::size_t>(child.isLeaf() ? 0 : child.node());
    const Ball& ball = child.isLeaf() ? leaf_balls_[leaf] : cages_[below].ball;
    pack.set(lane, Sphere::around(ball));
    leaf = child.isLeaf() ? leaf + 1 : static_cast<std::size_t>(topology.nodes[below].leaf_end);
  }

  EnclosingSphere& cage = cages_[index];
  if (keepsCage(topology, node, cage)) return;
  cage = enclosingSphere(leaf_balls_.data() + node.leaf_begin, node.leaf_end - node.leaf_begin,
                         cage.basis);
  ++cages_recomputed_;
}

/// Moves the cage along with its basis. Returns false if it is no longer the minimum enclosing
/// sphere, because a leaf has escaped or a smaller sphere suffices.
template <int A>
bool WrappedSpheres<A>::keepsCage(const Topology<kArity>& topology, const Node& node,
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
  if (!encloses(topology, node, support->ball.center, limit, reach)) return false;
  cage.ball = {support->ball.center, reach * (1 + 16 * kEps)};
  return true;
}

/// Whether all leaves below the node are within `limit` of `center`; raises `reach` to the
/// farthest. If the cage of a child is within, so are its leaves. If the cage sticks out, although
/// perhaps no leaf does (section 2.2, Fig. 4), the children are tested.
template <int A>
bool WrappedSpheres<A>::encloses(const Topology<kArity>& topology, const Node& node,
                                 const Vec3d& center, double limit, double& reach) const {
  auto leaf = static_cast<std::size_t>(node.leaf_begin);
  for (int lane = 0; lane < node.child_count; ++lane) {
    const Link child = node.children[static_cast<std::size_t>(lane)];
    const auto below = static_cast<std::size_t>(child.isLeaf() ? 0 : child.node());
    const Ball& ball = child.isLeaf() ? leaf_balls_[leaf] : cages_[below].ball;
    const double far_side = norm(ball.center - center) + ball.radius;
    if (far_side <= limit) {
      reach = std::max(reach, far_side);
    } else if (child.isLeaf() || !encloses(topology, topology.nodes[below], center, limit, reach)) {
      return false;
    }
    leaf = child.isLeaf() ? leaf + 1 : static_cast<std::size_t>(topology.nodes[below].leaf_end);
  }
  return true;
}

template <int A>
std::size_t WrappedSpheres<A>::memoryUsage() const {
  return leaf_balls_.capacity() * sizeof(Ball) + cages_.capacity() * sizeof(EnclosingSphere);
}

template class WrappedSpheres<2>;
template class WrappedSpheres<8>;

}  // namespace fcl_fibers::tree
