// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_GEOMETRY_VEC3_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_GEOMETRY_VEC3_LANES_INL_H
#undef FCL_FIBERS_GEOMETRY_VEC3_LANES_INL_H
#else
#define FCL_FIBERS_GEOMETRY_VEC3_LANES_INL_H
#endif

#include "geometry/pair_block.h"
#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

// What the tests of many pairs at a time share.

namespace hn = hwy::HWY_NAMESPACE;

/// With AVX2 these are two vectors: one computes while the other waits.
using Float = simd::HWY_NAMESPACE::Lanes<PairBlock::kGroup>;

/// @tparam Row  a number for each pair
template <class Row>
struct Vec3Rows {
  Row x, y, z;
};
using Vec3Lanes = Vec3Rows<Float>;
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row dot(const Vec3Rows<Row>& a, const Vec3Rows<Row>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
FCL_FIBERS_ALWAYS_INLINE Vec3Lanes operator-(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
FCL_FIBERS_ALWAYS_INLINE Vec3Lanes cross(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// By how much the tangent plane of a convex function falls from x to the end of [0, 1] that lies
/// downhill.
FCL_FIBERS_ALWAYS_INLINE Float fall(const Float& slope, const Float& x) {
  return max(slope * x, slope * (x - Float::all(1)));
}

/// Four numbers for each pair of a block: a vector and something else.
class Quads {
 public:
  /// @return the fourth
  FCL_FIBERS_ALWAYS_INLINE Float get(int first, Vec3Lanes& vector) const {
    Float fourth;
    Float::loadInterleaved(numbers_ + 4 * first, vector.x, vector.y, vector.z, fourth);
    return fourth;
  }
  /// Stores the numbers [k, k + width of d) of a pair. Beyond float's range the conversion gives
  /// infinity or the largest float. Its square is out of the range that the tests ask for.
  template <class Tag>
  FCL_FIBERS_ALWAYS_INLINE void set(Tag /*d*/, int pair, int k, const hn::Vec<Tag>& numbers,
                                    const hn::Vec<Tag>& unit) {
    const hn::Rebind<float, Tag> f;
    hn::StoreU(hn::DemoteTo(f, hn::Mul(numbers, unit)), f, numbers_ + 4 * pair + k);
  }

 private:
  alignas(64) float numbers_[4 * PairBlock::kCapacity];
};

/// Whether a pair whose squared lengths have this sum is decided. Otherwise products may overflow
/// or vanish, and then the bounds do not hold.
FCL_FIBERS_ALWAYS_INLINE Float::Truth isInRange(const Float& squares) {
  return (Float::all(0x1p-40f) <= squares) & (squares <= Float::all(0x1p40f));
}

struct VerdictLanes {
  Float::Truth touching, apart;
};

/// Collects the verdicts decide(i) of the groups of pairs that begin at i.
template <class F>
FCL_FIBERS_ALWAYS_INLINE PairBlock::Verdict verdictOfGroups(int count, F&& decide) {
  PairBlock::Verdict verdict;
  for (int i = 0; i < count; i += PairBlock::kGroup) {
    const VerdictLanes lanes = decide(i);
    verdict.touching |= std::uint64_t{lanes.touching.mask()} << i;
    verdict.apart |= std::uint64_t{lanes.apart.mask()} << i;
  }
  return verdict;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
