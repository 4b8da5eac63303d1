// SPDX-License-Identifier: BSD-3-Clause
#include "support/mesh_models.h"

#include <cmath>
#include <stdexcept>
#include <type_traits>

// BVH_model.h calls a function that it does not declare.
#include <fcl/math/bv/utility.h>

#include <fcl/geometry/bvh/BVH_model.h>

namespace fcl_fibers::test {
namespace {

template <class T>
struct Volume {
  using Type = T;
};

/// Calls visit(model) with a null pointer to a model of this type, one of modelTypes().
template <typename S, class F>
auto visitType(fcl::NODE_TYPE type, F&& visit) {
  const auto with = [&](auto volume) {
    return visit(static_cast<fcl::BVHModel<typename decltype(volume)::Type>*>(nullptr));
  };
  if (type == fcl::BV_AABB) return with(Volume<fcl::AABB<S>>());
  if (type == fcl::BV_OBBRSS) return with(Volume<fcl::OBBRSS<S>>());
  if constexpr (std::is_same_v<S, double>) {
    if (type == fcl::BV_OBB) return with(Volume<fcl::OBB<S>>());
    if (type == fcl::BV_RSS) return with(Volume<fcl::RSS<S>>());
    if (type == fcl::BV_kIOS) return with(Volume<fcl::kIOS<S>>());
    if (type == fcl::BV_KDOP16) return with(Volume<fcl::KDOP<S, 16>>());
    if (type == fcl::BV_KDOP18) return with(Volume<fcl::KDOP<S, 18>>());
    if (type == fcl::BV_KDOP24) return with(Volume<fcl::KDOP<S, 24>>());
  }
  throw std::logic_error("Tests have no such models.");
}

template <typename S, class F>
auto visitModel(fcl::CollisionGeometry<S>& geometry, F&& visit) {
  return visitType<S>(geometry.getNodeType(), [&](auto* model) {
    return visit(static_cast<std::remove_pointer_t<decltype(model)>&>(geometry));
  });
}

template <typename S>
std::vector<fcl::Vector3<S>> rounded(const std::vector<Eigen::Vector3d>& points) {
  std::vector<fcl::Vector3<S>> result;
  for (const Eigen::Vector3d& p : points) result.push_back(p.cast<S>());
  return result;
}

template <class Model>
void addTriangles(Model& model, const MeshShape& shape) {
  std::vector<fcl::Triangle> triangles;
  for (const auto& t : shape.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  model.beginModel();
  model.addSubModel(rounded<typename Model::S>(shape.points), triangles);
}

}  // namespace

MeshShape blob(double radius, double waves, std::size_t around, std::size_t rows) {
  const double pi = std::acos(-1.0);
  MeshShape shape;
  const auto add = [&](double polar, double angle) {
    const double r =
        radius * (1 + waves * std::sin(5 * polar) * std::cos(3 * angle) * std::sin(polar));
    shape.points.emplace_back(r * std::sin(polar) * std::cos(angle),
                              r * std::sin(polar) * std::sin(angle), r * std::cos(polar));
  };
  add(0, 0);
  for (std::size_t row = 1; row < rows; ++row) {
    for (std::size_t i = 0; i < around; ++i) {
      add(pi * static_cast<double>(row) / static_cast<double>(rows),
          2 * pi * static_cast<double>(i) / static_cast<double>(around));
    }
  }
  add(pi, 0);
  const std::size_t last = shape.points.size() - 1;
  const auto at = [&](std::size_t row, std::size_t i) {
    return 1 + (row - 1) * around + i % around;
  };
  for (std::size_t i = 0; i < around; ++i) {
    shape.triangles.push_back({0, at(1, i), at(1, i + 1)});
    for (std::size_t row = 1; row + 1 < rows; ++row) {
      shape.triangles.push_back({at(row, i), at(row + 1, i), at(row + 1, i + 1)});
      shape.triangles.push_back({at(row, i), at(row + 1, i + 1), at(row, i + 1)});
    }
    shape.triangles.push_back({last, at(rows - 1, i + 1), at(rows - 1, i)});
  }
  return shape;
}

template <typename S>
std::vector<fcl::NODE_TYPE> modelTypes() {
  if (std::is_same_v<S, float>) return {fcl::BV_AABB, fcl::BV_OBBRSS};
  return {fcl::BV_AABB,   fcl::BV_OBB,    fcl::BV_RSS,    fcl::BV_kIOS,
          fcl::BV_OBBRSS, fcl::BV_KDOP16, fcl::BV_KDOP18, fcl::BV_KDOP24};
}

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeModel(fcl::NODE_TYPE type, const MeshShape& shape) {
  const auto geometry =
      visitType<S>(type, [](auto* model) -> std::shared_ptr<fcl::CollisionGeometry<S>> {
        return std::make_shared<std::remove_pointer_t<decltype(model)>>();
      });
  visitModel(*geometry, [&](auto& model) {
    addTriangles(model, shape);
    model.endModel();
    model.computeLocalAABB();
  });
  return geometry;
}

std::shared_ptr<fcl::CollisionGeometry<double>> makeUnfinishedModel(const MeshShape& shape) {
  const auto model = std::make_shared<fcl::BVHModel<fcl::AABB<double>>>();
  addTriangles(*model, shape);
  return model;
}

std::shared_ptr<fcl::CollisionGeometry<double>> makeCloud(const MeshShape& shape) {
  const auto model = std::make_shared<fcl::BVHModel<fcl::AABB<double>>>();
  model->beginModel();
  model->addSubModel(shape.points);
  model->endModel();
  model->computeLocalAABB();
  return model;
}

template <typename S>
void movePoints(fcl::CollisionGeometry<S>& geometry,
                const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& move) {
  visitModel(geometry, [&](auto& model) {
    std::vector<fcl::Vector3<S>> points(model.vertices, model.vertices + model.num_vertices);
    for (auto& p : points) p = move(p.template cast<double>()).template cast<S>();
    model.beginReplaceModel();
    model.replaceSubModel(points);
    model.endReplaceModel();
    model.computeLocalAABB();
  });
}

template <typename S>
ModelArrays<S> arraysOf(fcl::CollisionGeometry<S>& geometry) {
  return visitModel(geometry, [](auto& model) -> ModelArrays<S> {
    return {model.vertices, model.tri_indices, model.num_tris};
  });
}

#define FCL_FIBERS_INSTANTIATE(S)                                                                  \
  template std::vector<fcl::NODE_TYPE> modelTypes<S>();                                            \
  template std::shared_ptr<fcl::CollisionGeometry<S>> makeModel(fcl::NODE_TYPE, const MeshShape&); \
  template void movePoints(fcl::CollisionGeometry<S>&,                                             \
                           const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>&);         \
  template ModelArrays<S> arraysOf(fcl::CollisionGeometry<S>&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::test
