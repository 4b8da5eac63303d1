// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/bvh_triangles.h"

#include <fcl/geometry/bvh/BVH_model.h>

namespace fcl_fibers::broadphase {
namespace {

template <class Bv>
auto read(const fcl::CollisionGeometry<typename Bv::S>& geometry) {
  const auto& model = static_cast<const fcl::BVHModel<Bv>&>(geometry);
  BvhTriangles<typename Bv::S> found;
  found.is_finished = model.build_state == fcl::BVH_BUILD_STATE_PROCESSED ||
                      model.build_state == fcl::BVH_BUILD_STATE_UPDATED;
  found.points = model.vertices;
  found.triangles = model.tri_indices;
  found.point_count = static_cast<std::size_t>(model.num_vertices);
  found.triangle_count =
      model.tri_indices == nullptr ? 0 : static_cast<std::size_t>(model.num_tris);
  return found;
}

}  // namespace

template <typename S>
BvhTriangles<S> trianglesOf(const fcl::CollisionGeometry<S>& model) {
  switch (model.getNodeType()) {
    case fcl::BV_AABB:
      return read<fcl::AABB<S>>(model);
    case fcl::BV_OBB:
      return read<fcl::OBB<S>>(model);
    case fcl::BV_RSS:
      return read<fcl::RSS<S>>(model);
    case fcl::BV_kIOS:
      return read<fcl::kIOS<S>>(model);
    case fcl::BV_OBBRSS:
      return read<fcl::OBBRSS<S>>(model);
    case fcl::BV_KDOP16:
      return read<fcl::KDOP<S, 16>>(model);
    case fcl::BV_KDOP18:
      return read<fcl::KDOP<S, 18>>(model);
    default:
      return read<fcl::KDOP<S, 24>>(model);
  }
}

template <typename S>
std::string BvhTriangles<S>::problem() const {
  constexpr std::size_t kMost = std::size_t{1} << 27;
  if (!is_finished) {
    return "its mesh is empty or unfinished; add triangles and call endModel(), endReplaceModel() "
           "or endUpdateModel()";
  }
  if (point_count > kMost || triangle_count > kMost) {
    return "its mesh has more than 2^27 points or triangles; split it";
  }
  for (std::size_t i = 0; i < point_count; ++i) {
    if (points[i].allFinite()) continue;
    return "point " + std::to_string(i) +
           " of its mesh is NaN or infinite; give it finite coordinates";
  }
  for (std::size_t t = 0; t < triangle_count; ++t) {
    const std::size_t* indices = indicesOf(triangles[t]);
    for (int corner = 0; corner < 3; ++corner) {
      if (indices[corner] < point_count) continue;
      return "triangle " + std::to_string(t) + " of its mesh has the point " +
             std::to_string(indices[corner]) + " of " + std::to_string(point_count) +
             "; give it indices of its points";
    }
  }
  return {};
}

template struct BvhTriangles<float>;
template struct BvhTriangles<double>;
template BvhTriangles<float> trianglesOf(const fcl::CollisionGeometry<float>&);
template BvhTriangles<double> trianglesOf(const fcl::CollisionGeometry<double>&);

}  // namespace fcl_fibers::broadphase
