// SPDX-License-Identifier: BSD-3-Clause
#include "tree.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include <pybind11/stl.h>

namespace fcl_fibers::python {
namespace {

FiberTreeOptions treeOptions(bool capsules, bool bundle, bool boxes, int ignored_neighbors,
                             double ignored_arc_length, double margin, int threads) {
  FiberTreeOptions options;
  options.report = capsules ? Report::kCapsules : Report::kVolumes;
  options.topology = bundle ? Topology::kBundle : Topology::kSuperThread;
  options.volumes =
      boxes ? FiberTreeOptions::Volumes::kLayeredBoxes : FiberTreeOptions::Volumes::kWrappedSpheres;
  options.ignored_neighbors = ignored_neighbors;
  options.ignored_arc_length = ignored_arc_length;
  options.margin = margin;
  options.threads = threads;
  return options;
}

PointSums sumsOf(const py::object& sums) {
  if (sums.is_none()) return {};
  py::array array = py::reinterpret_borrow<py::array>(sums);
  const auto points = static_cast<std::size_t>(array.shape(0));
  return py::isinstance<py::array_t<float>>(array)
             ? PointSums(static_cast<float*>(array.mutable_data()), points)
             : PointSums(static_cast<double*>(array.mutable_data()), points);
}

/// Asks a question that holds nothing. A query takes a copy of a mesh, so that the program may move
/// the mesh meanwhile.
template <class Question, class Partner>
py::array ask(const Tree& tree, Partner partner, std::size_t limit) {
  return tree.find(Question{}, partner, limit);
}

template <class Partner>
void accumulate(const Tree& tree, const py::array& contacts, const py::array& forces,
                Partner partner, const py::object& sums, const py::object& partner_sums) {
  tree.accumulate(contacts, forces, partner, sumsOf(sums), sumsOf(partner_sums));
}

}  // namespace

void addTree(py::module_& module) {
  using Vector = std::array<double, 3>;
  py::class_<CapsuleShape>(module, "CapsuleShape").def(py::init<Vector, Vector, double>());
  py::class_<SphereShape>(module, "SphereShape").def(py::init<Vector, double>());
  py::class_<BoxShape>(module, "BoxShape")
      .def(py::init([](Vector low, Vector high, std::array<double, 9> rotation, Vector position) {
        return BoxShape{low, high, {rotation, position}};
      }));
  py::class_<HalfSpaceShape>(module, "HalfSpaceShape").def(py::init<Vector, double>());
  py::class_<PlaneShape>(module, "PlaneShape").def(py::init<Vector, double>());
  using Other = Tree::Other;
  using MeshCopy = TriangleMesh;
  py::class_<Tree>(module, "Tree")
      .def(py::init([](bool capsules, bool bundle, bool boxes, int ignored_neighbors,
                       double ignored_arc_length, double margin, int threads) {
        return std::make_unique<Tree>(treeOptions(capsules, bundle, boxes, ignored_neighbors,
                                                  ignored_arc_length, margin, threads));
      }))
      .def("build", &Tree::build)
      .def("update", py::overload_cast<FiberNumbers>(&Tree::update))
      .def("update", py::overload_cast<FiberNumbers, FiberNumbers>(&Tree::update))
      .def_property_readonly("numbers", &Tree::numbers)
      .def_property_readonly("offsets", &Tree::offsets)
      .def("pairs", [](const Tree& tree, Other other, int order,
                       std::size_t limit) { return tree.pairs(Order(order), other, limit); })
      .def("pairs", [](const Tree& tree, MeshCopy mesh, int order,
                       std::size_t limit) { return tree.pairs(Order(order), mesh, limit); })
      .def("pairs", [](const Tree& tree, const Shape& shape, int order,
                       std::size_t limit) { return tree.pairs(Order(order), shape, limit); })
      .def("moving_pairs", &ask<MovingPairs, Other>)
      .def("visit_pairs", &Tree::visitPairs)
      .def("contacts",
           [](const Tree& tree, Other other, int order, std::size_t limit, bool bare) {
             return bare ? tree.contacts<BareContact>(other, Order(order), limit, bareType())
                         : tree.contacts<Contact>(other, Order(order), limit, contactType());
           })
      .def("contacts",
           [](const Tree& tree, MeshCopy mesh, int order, std::size_t limit, bool) {
             return tree.contactsWith(mesh, Order(order), limit, meshContactType());
           })
      .def("contacts",
           [](const Tree& tree, const Shape& shape, int order, std::size_t limit, bool) {
             return tree.contactsWith(shape, Order(order), limit, shapeContactType());
           })
      .def("accumulate", &accumulate<Other>)
      .def("accumulate", &accumulate<MeshCopy>)
      .def("layout", &Tree::layout)
      .def("closest", py::overload_cast<Other>(&Tree::closest, py::const_))
      .def("closest", [](const Tree& tree, MeshCopy mesh) { return tree.closest(mesh); })
      .def("impacts", &ask<Impacts, Other>)
      .def("impacts", &ask<Impacts, Shape>)
      .def("impacts",
           [](const Tree& tree, MeshCopy start, MeshCopy end, std::size_t limit) {
             return tree.find(Impacts{}, MeshStep{start, end}, limit);
           })
      .def("impact_contacts", [](const Tree& tree, const py::array& impacts,
                                 Other other) { return tree.impactContacts(impacts, other); })
      .def("impact_contacts",
           [](const Tree& tree, const py::array& impacts, MeshCopy start, MeshCopy end) {
             return tree.impactContacts(impacts, MeshStep{start, end}, meshImpactType(),
                                        meshContactType());
           })
      .def("impact_contacts",
           [](const Tree& tree, const py::array& impacts, const Shape& shape) {
             return tree.impactContacts(impacts, shape, shapeImpactType(), shapeContactType());
           })
      .def("safe_step", [](const Tree& tree, Other other) { return tree.safeStep(other); })
      .def("safe_step", [](const Tree& tree, const Shape& shape) { return tree.safeStep(shape); })
      .def("safe_step",
           [](const Tree& tree, MeshCopy start, MeshCopy end) {
             return tree.safeStep(MeshStep{start, end});
           })
      .def("touching_segments",
           [](const Tree& tree, MeshCopy mesh) { return tree.find(TouchingSegments{}, mesh); })
      .def("nearest", [](const Tree& tree, Other other,
                         double distance) { return tree.find(Nearest{distance}, other); })
      .def("nearest", [](const Tree& tree, MeshCopy mesh,
                         double distance) { return tree.find(Nearest{distance}, mesh); })
      .def("segments", &Tree::segments)
      .def("fiber_segments", &Tree::fiberSegments)
      .def("volumes", &Tree::volumes)
      .def_property_readonly("fiber_count", &Tree::count<&FiberTree::fiberCount>)
      .def_property_readonly("segment_count", &Tree::count<&FiberTree::segmentCount>)
      .def_property_readonly("memory_usage", &Tree::count<&FiberTree::memoryUsage>);
  module.attr("contact_types") =
      py::make_tuple(bareType(), contactType(), shapeContactType(), meshContactType());
  module.def("fiber_pairs", [](const py::array& contacts) {
    return toArray(fiberPairs(Borrowed<Contact>(contacts)), fiberPairType());
  });
}

}  // namespace fcl_fibers::python
