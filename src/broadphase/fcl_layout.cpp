// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/fcl_layout.h"

#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

namespace fcl_fibers::broadphase {
namespace {

using Object = fcl::CollisionObject<double>;

/// The constructor and the accessor run in libfcl: FCL declares CollisionObject<double> `extern
/// template`, and no member is inline.
bool readsBackItsPose() {
  // libfcl's objects may be larger than ours.
  constexpr std::size_t kAlignment = 128;
  alignas(kAlignment) unsigned char memory[sizeof(Object) + 1024] = {};
  const fcl::Vector3d position(1, 2, 3);
  auto* object =
      new (memory) Object(std::make_shared<fcl::Sphered>(0.5), fcl::Matrix3d::Identity(), position);
  using Members = ObjectMembers<double>;
  const bool is_same = Members::pose(*object).matrix().col(3).head<3>() == position &&
                       Members::box(*object).min_ == (position.array() - 0.5).matrix() &&
                       &Members::pose(*object) == &object->getTransform();
  object->~Object();
  return is_same;
}

}  // namespace

void requireLayoutOfFcl() {
  static const bool is_same = readsBackItsPose();
  if (!is_same) {
    throw std::runtime_error(
        "fcl_fibers: an object made by libfcl does not read back its pose, because its memory "
        "layout "
        "differs: fcl_fibers was compiled with Eigen's matrices aligned to " +
        std::to_string(EIGEN_MAX_STATIC_ALIGN_BYTES) +
        " bytes, and libfcl was not; add -DEIGEN_MAX_ALIGN_BYTES=16 to the CMAKE_CXX_FLAGS of "
        "fcl_fibers, beside -march=native, -mavx or a similar flag, or build FCL with the same "
        "flags");
  }
}

}  // namespace fcl_fibers::broadphase
