// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/polytope_vertices.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/polytope_vertices.cpp"
#include <hwy/foreach_target.h>

#include "geometry/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

using EightDoubles = simd::HWY_NAMESPACE::Lanes<PolytopeVertices::kLanes, double>;

/// Writes for each lane the largest product and the block that it is in.
void furthestOfLanes(const PolytopeVertices::Block* blocks, std::size_t count,
                     const Vec3d& direction, double (&product)[PolytopeVertices::kLanes],
                     double (&block)[PolytopeVertices::kLanes]) {
  using L = EightDoubles;
  const L x = L::all(direction.x), y = L::all(direction.y), z = L::all(direction.z);
  L most = L::all(-std::numeric_limits<double>::infinity()), at = L::all(0);
  for (std::size_t i = 0; i < count; ++i) {
    const L along = x * L::load(blocks[i].x) + y * L::load(blocks[i].y) + z * L::load(blocks[i].z);
    at = choose(most < along, L::all(static_cast<double>(i)), at);
    most = max(most, along);
  }
  most.store(product);
  at.store(block);
}

template <typename T>
bool findsSame(const PolytopeVertices::Block* blocks, std::size_t count, const T* points) {
  const Doubles d;
  constexpr std::size_t kStep = hn::MaxLanes(Doubles());
  auto same = hn::Eq(hn::Zero(d), hn::Zero(d));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < PolytopeVertices::kLanes; k += kStep) {
      const Points p = Points::load(points + 3 * (PolytopeVertices::kLanes * i + k));
      same = hn::And(same, hn::And(hn::Eq(p.x, hn::Load(d, blocks[i].x + k)),
                                   hn::And(hn::Eq(p.y, hn::Load(d, blocks[i].y + k)),
                                           hn::Eq(p.z, hn::Load(d, blocks[i].z + k)))));
    }
  }
  return hn::AllTrue(d, same);
}

/// Whether full blocks are copies of points.
bool areCopies(const PolytopeVertices::Block* blocks, std::size_t count,
               const PointsOfProgram& points) {
  return points.doubles != nullptr ? findsSame(blocks, count, points.doubles)
                                   : findsSame(blocks, count, points.floats);
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(areCopies);
HWY_EXPORT(furthestOfLanes);

PolytopeVertices::PolytopeVertices(const PointsOfProgram& points)
    : blocks_((points.count + kLanes - 1) / kLanes), count_(points.count), largest_{0, 0, 0} {
  for (std::size_t i = 0; i < kLanes * blocks_.size(); ++i) {
    const Vec3d p = points[std::min(i, count_ - 1)];
    Block& block = blocks_[i / kLanes];
    block.x[i % kLanes] = p.x;
    block.y[i % kLanes] = p.y;
    block.z[i % kLanes] = p.z;
    largest_ = max(largest_, abs(p));
  }
}

bool PolytopeVertices::isCopyOf(const PointsOfProgram& points) const {
  if (points.count != count_) return false;
  simd::readEnvironment();
  const std::size_t full = count_ / kLanes;
  bool is_same = HWY_DYNAMIC_DISPATCH(areCopies)(blocks_.data(), full, points);
  for (std::size_t i = kLanes * full; i < count_; ++i) is_same &= points[i] == (*this)[i];
  return is_same;
}

PolytopeVertices::Extreme PolytopeVertices::furthest(const Vec3d& direction) const {
  simd::readEnvironment();
  double product[kLanes], block[kLanes];
  HWY_DYNAMIC_DISPATCH(furthestOfLanes)(blocks_.data(), blocks_.size(), direction, product, block);
  const auto lane = static_cast<std::size_t>(std::max_element(product, product + kLanes) - product);
  return {product[lane], kLanes * static_cast<std::size_t>(block[lane]) + lane};
}

}  // namespace fcl_fibers::geometry
#endif
