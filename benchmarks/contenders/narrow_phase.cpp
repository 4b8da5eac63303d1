// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/narrow_phase.h"

#include <algorithm>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>

namespace fcl_fibers::benchmarks {
namespace {

struct Sampler {
  static constexpr std::size_t kBlock = 500;

  std::size_t stride;  ///< in blocks
  PairSample sample = {};

  static bool callback(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Sampler*>(data);
    if (self.sample.of++ / kBlock % self.stride == 0) self.sample.pairs.emplace_back(a, b);
    return false;
  }
};

/// The axis of a capsule from its centre.
template <typename S>
struct Axis {
  fcl::Vector3<S> center, half;
  S radius;

  explicit Axis(const fcl::CollisionObject<S>& object) {
    const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
    const fcl::Transform3<S>& pose = object.getTransform();
    center = pose.translation();
    half = capsule.lz / 2 * pose.linear().col(2);
    radius = capsule.radius;
  }
};

}  // namespace

PairSample samplePairs(const Manager& manager, std::size_t reported, std::size_t size) {
  // Fewer blocks than these say little of a scene whose parts differ.
  constexpr std::size_t kLeastBlocks = 20;
  const std::size_t blocks = std::max(kLeastBlocks, size / Sampler::kBlock);
  Sampler sampler{std::max<std::size_t>(1, reported / Sampler::kBlock / blocks)};
  manager.collide(&sampler, Sampler::callback);
  return std::move(sampler.sample);
}

NarrowPhase collide(const PairSample& sample) {
  if (sample.pairs.empty()) return {};
  std::size_t touching = 0;
  const double taken = seconds([&] {
    const fcl::CollisionRequestd request;
    for (const auto& [a, b] : sample.pairs) {
      fcl::CollisionResultd result;
      fcl::collide(a, b, request, result);
      if (result.isCollision()) ++touching;
    }
  });
  const double scale = static_cast<double>(sample.of) / static_cast<double>(sample.pairs.size());
  return {scale * taken, scale * static_cast<double>(touching)};
}

// The squared distance of two points of the axes, center + s * half with s in [-1, 1], is a convex
// parabola in (s, t). Its least value lies where both derivatives vanish, unless that is outside
// the square: then on its border, where the one of the two parameters that is cut off gives the
// other.
template <typename S>
bool capsulesTouch(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b) {
  const Axis<S> p(a), q(b);
  const fcl::Vector3<S> apart = q.center - p.center;
  const S pp = p.half.squaredNorm(), qq = q.half.squaredNorm(), pq = p.half.dot(q.half);
  const S along_p = apart.dot(p.half), along_q = apart.dot(q.half);
  const auto cut = [](S x) { return std::clamp(x, S(-1), S(1)); };
  const S determinant = pp * qq - pq * pq;
  S s = determinant > 0 ? cut((along_p * qq - along_q * pq) / determinant) : S(0);
  S t = qq > 0 ? cut((s * pq - along_q) / qq) : S(0);
  s = pp > 0 ? cut((t * pq + along_p) / pp) : S(0);
  t = qq > 0 ? cut((s * pq - along_q) / qq) : S(0);
  const S sum = p.radius + q.radius;
  return (apart + t * q.half - s * p.half).squaredNorm() <= sum * sum;
}

template <typename S>
std::size_t countTouching(const BasicManager<S>& manager) {
  std::size_t count = 0;
  manager.collide(&count, [](auto* a, auto* b, void* data) {
    *static_cast<std::size_t*>(data) += capsulesTouch(*a, *b);
    return false;
  });
  return count;
}

template bool capsulesTouch(const fcl::CollisionObject<float>&, const fcl::CollisionObject<float>&);
template bool capsulesTouch(const fcl::CollisionObject<double>&,
                            const fcl::CollisionObject<double>&);
template std::size_t countTouching(const BasicManager<float>&);
template std::size_t countTouching(const BasicManager<double>&);

}  // namespace fcl_fibers::benchmarks
