// SPDX-License-Identifier: BSD-3-Clause
//
// The part of the package fcl_fibers that is in C++. Python's part has checked shapes and types and
// has the documentation.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/export_geometry.h>
#include <fcl_fibers/io/fiber_file.h>
#include <fcl_fibers/io/mesh_file.h>
#include <fcl_fibers/triangle_mesh.h>
#include <fcl_fibers/version.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "errors.h"
#include "lock.h"
#include "polylines.h"
#include "tree.h"

namespace fcl_fibers::python {
namespace {

FiberLayout layoutOf(const py::array& offsets, const py::object& ends, const py::object& closed,
                     const py::object& groups, const py::object& meets,
                     const py::object& root_segments, const py::object& categories,
                     const py::object& starts_at, const py::object& ends_at) {
  FiberLayout layout;
  const auto* const begin = requireArray<std::int64_t>("offsets", offsets);
  layout.begin.assign(begin, begin + offsets.size());
  const std::vector<std::int64_t> end = numbersOf<std::int64_t>("ends", ends);
  layout.end.assign(end.begin(), end.end());
  layout.closed = numbersOf<std::uint8_t>("closed", closed);
  layout.groups = numbersOf<std::int32_t>("groups", groups);
  layout.meets = numbersOf<std::uint32_t>("meets", meets);
  layout.categories = numbersOf<std::uint32_t>("categories", categories);
  layout.root_segments = numbersOf<std::int32_t>("root_segments", root_segments);
  layout.starts_at = numbersOf<std::int32_t>("starts_at", starts_at);
  layout.ends_at = numbersOf<std::int32_t>("ends_at", ends_at);
  return layout;
}

/// Calls use(MeshArrays<float or double>) without the interpreter's lock.
template <class Use>
auto withMesh(const py::array& points, const py::array& triangles, Use&& use) {
  const auto* const corners = requireArray<std::int32_t>("triangles", triangles, 3);
  const auto count = static_cast<std::size_t>(points.shape(0));
  const auto triangle_count = static_cast<std::size_t>(triangles.shape(0));
  const bool is_float = py::isinstance<py::array_t<float>>(points);
  const float* const floats = is_float ? requireArray<float>("points", points, 3) : nullptr;
  const double* const doubles = is_float ? nullptr : requireArray<double>("points", points, 3);
  const Unlocked unlocked;
  if (is_float) return use(MeshArrays<float>{floats, count, corners, triangle_count});
  return use(MeshArrays<double>{doubles, count, corners, triangle_count});
}

/// Returns the four arrays of Fibers of Python's side, what they hold besides, and the warnings.
py::tuple readFile(const std::string& path, std::optional<double> radius, int segments_per_span,
                   std::string radius_from, std::string groups_from) {
  io::FiberFileOptions options;
  options.radius = radius;
  options.segments_per_span = segments_per_span;
  options.radius_from = std::move(radius_from);
  options.groups_from = std::move(groups_from);
  io::FiberFile file;
  {
    const Unlocked unlocked;
    file = io::readFibers(path, options);
  }
  FiberPolylines& fibers = file.fibers;
  const py::dtype number = py::dtype::of<double>();
  py::object radii = py::none(), closed = py::none();
  if (file.has_radius) {
    radii = fibers.radii.empty() ? py::object(py::float_(fibers.radius))
                                 : py::object(toArray(std::move(fibers.radii), number));
  }
  if (!fibers.closed.empty()) closed = toArray(std::move(fibers.closed), py::dtype::of<bool>());
  std::vector<std::int64_t> offsets(fibers.point_begin.begin(), fibers.point_begin.end());
  const auto orNone = [](auto& numbers) -> py::object {
    if (numbers.empty()) return py::none();
    using Number = typename std::decay_t<decltype(numbers)>::value_type;
    return toArray(std::move(numbers), py::dtype::of<Number>());
  };
  return py::make_tuple(
      py::make_tuple(toArray(std::move(fibers.points), number, 3),
                     toArray(std::move(offsets), py::dtype::of<std::int64_t>()), radii, closed),
      py::make_tuple(orNone(fibers.starts_at), orNone(fibers.ends_at), orNone(fibers.samples),
                     orNone(fibers.types), orNone(fibers.groups), orNone(file.group_values)),
      std::move(file.warnings));
}

py::tuple readMeshFile(const std::string& path) {
  io::MeshFile mesh;
  {
    const Unlocked unlocked;
    mesh = io::readMesh(path);
  }
  return py::make_tuple(
      toArray(std::move(mesh.points), py::dtype::of<double>(), 3),
      toArray(std::move(mesh.triangles), py::dtype::of<std::int32_t>()).attr("reshape")(-1, 3));
}

void writeFile(const std::string& path, const FiberNumbers& numbers, const FiberLayout& layout,
               bool hair, const py::object& starts_at, const py::object& ends_at,
               const py::object& samples, const py::object& types) {
  FiberPolylines fibers = polylinesOf(numbers, layout);
  fibers.starts_at = numbersOf<std::int32_t>("starts_at", starts_at);
  fibers.ends_at = numbersOf<std::int32_t>("ends_at", ends_at);
  fibers.samples = numbersOf<std::int64_t>("samples", samples);
  fibers.types = numbersOf<std::int64_t>("types", types);
  const Unlocked unlocked;
  hair ? io::writeHair(path, fibers) : io::exportFibers(path, fibers);
}

void addFibers(py::module_& module) {
  py::class_<FiberLayout>(module, "Layout")
      .def(py::init(&layoutOf), py::arg("offsets"), py::arg("ends"), py::arg("closed"),
           py::arg("groups"), py::arg("meets"), py::arg("root_segments"), py::arg("categories"),
           py::arg("starts_at"), py::arg("ends_at"));
  py::class_<FiberNumbers>(module, "Numbers")
      .def(py::init([](py::array points, py::array radii, int radii_are) {
             return FiberNumbers{std::move(points), std::move(radii), radii_are};
           }),
           py::arg("points"), py::arg("radii"), py::arg("radii_are"))
      .def_readonly("points", &FiberNumbers::points)
      .def_readonly("radii", &FiberNumbers::radii)
      .def_readonly("radii_are", &FiberNumbers::radii_are);

  module.def(
      "root_segments", [](const FiberNumbers& numbers, const FiberLayout& layout, double length) {
        return toArray(withArrays(numbers, layout,
                                  [&](const auto& fibers) { return rootSegments(fibers, length); }),
                       py::dtype::of<std::int32_t>());
      });
}

void addMesh(py::module_& module) {
  py::class_<TriangleMesh>(module, "Mesh")
      .def(py::init([](const py::array& points, const py::array& triangles, bool solid) {
        const auto kind = solid ? TriangleMesh::Kind::kSolid : TriangleMesh::Kind::kSurface;
        return withMesh(points, triangles, [&](const auto& arrays) {
          return std::make_unique<TriangleMesh>(arrays, kind);
        });
      }))
      .def("update",
           [](TriangleMesh& mesh, const py::array& points, const py::array& triangles) {
             // The mesh itself stays as it is while another thread copies it.
             TriangleMesh changed = mesh;
             withMesh(points, triangles, [&](const auto& arrays) { changed.update(arrays); });
             // Another thread may have placed it meanwhile.
             changed.setPose(mesh.pose());
             changed.setCategories(mesh.categories());
             changed.setMeets(mesh.meets());
             mesh = std::move(changed);
           })
      .def("set_pose",
           [](TriangleMesh& mesh, const std::array<double, 9>& rotation,
              const std::array<double, 3>& position) {
             mesh.setPose({rotation, position});
           })
      .def("pose",
           [](const TriangleMesh& m) { return std::pair(m.pose().rotation, m.pose().position); })
      .def_property("categories", &TriangleMesh::categories, &TriangleMesh::setCategories)
      .def_property("meets", &TriangleMesh::meets, &TriangleMesh::setMeets)
      .def_property_readonly(
          "solid",
          [](const TriangleMesh& mesh) { return mesh.kind() == TriangleMesh::Kind::kSolid; })
      .def("copy", [](const TriangleMesh& mesh) { return TriangleMesh(mesh); })
      .def_property_readonly("point_count", &TriangleMesh::pointCount)
      .def_property_readonly("triangle_count", &TriangleMesh::triangleCount)
      .def_property_readonly("memory_usage", &TriangleMesh::memoryUsage);
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.attr("version") = FCL_FIBERS_VERSION;
  module.attr("pybind11_version") = py::make_tuple(PYBIND11_VERSION_MAJOR, PYBIND11_VERSION_MINOR);
  translateErrors();
  addMesh(module);
  addFibers(module);
  addTree(module);
  addLivePairs(module);
  module.def("read", &readFile);
  module.def("read_mesh", &readMeshFile);
  module.def("write", &writeFile);
}

}  // namespace fcl_fibers::python
