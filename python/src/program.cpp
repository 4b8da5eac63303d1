// SPDX-License-Identifier: BSD-3-Clause
//
// The commands of the program and its page. They are in a module of their own, so that programs
// which look for contacts do not load them.
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "errors.h"
#include "lock.h"
#include "polylines.h"
#include "tools/program.h"

namespace fcl_fibers::python {
namespace {

int run(const std::vector<std::string>& arguments) {
  tools::ProgramParts parts;
  parts.name = "python -m fcl_fibers";
  return tools::runProgram(arguments, parts);
}

tools::MeshFile meshOf(const py::array& points, const py::array& triangles) {
  const auto* const corners = requireArray<std::int32_t>("triangles", triangles, 3);
  const auto count = static_cast<std::size_t>(points.shape(0));
  const auto triangle_count = static_cast<std::size_t>(triangles.shape(0));
  const MeshArrays<double> arrays{requireArray<double>("points", points, 3), count, corners,
                                  triangle_count};
  tools::MeshFile mesh{"mesh", {}, {corners, corners + 3 * triangle_count}, TriangleMesh(arrays)};
  mesh.points.resize(count);
  for (std::size_t i = 0; i < 3 * count; ++i) mesh.points[i / 3][i % 3] = arrays.points[i];
  return mesh;
}

std::string page(const std::string& title, const FiberNumbers& numbers, const FiberLayout& layout,
                 const py::object& starts_at, const py::object& ends_at, int ignored_neighbors,
                 double margin, int threads, int depth, std::size_t most_points,
                 const std::string& up,
                 const std::vector<std::pair<py::array, py::array>>& meshes) {
  FiberPolylines fibers = polylinesOf(numbers, layout);
  fibers.starts_at = numbersOf<std::int32_t>("starts_at", starts_at);
  fibers.ends_at = numbersOf<std::int32_t>("ends_at", ends_at);
  std::vector<tools::MeshFile> shown;
  for (const auto& [points, triangles] : meshes) shown.push_back(meshOf(points, triangles));
  tools::Request request;
  request.tree.ignored_neighbors = ignored_neighbors;
  request.tree.margin = margin;
  request.tree.threads = threads;
  request.depth = depth;
  request.points = most_points;
  request.up = up;
  const Unlocked unlocked;
  // The program tells its progress in one place.
  static std::mutex mutex;
  const std::lock_guard<std::mutex> alone(mutex);
  return tools::pageOf(title, fibers, request, shown);
}

}  // namespace

PYBIND11_MODULE(_program, module) {
  py::module_::import("fcl_fibers._core");  // has the types that page() takes
  translateErrors();
  module.def("run", &run);
  module.def("page", &page);
}

}  // namespace fcl_fibers::python
