// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>

#include "arrays.h"
#include "query.h"

namespace fcl_fibers::python {

/// A FiberTree with the arrays that it was built from, which contacts are computed from. Queries
/// release the interpreter's lock.
class Tree {
 public:
  explicit Tree(const FiberTreeOptions& options) : tree_(options) {}

  void build(FiberNumbers numbers, FiberLayout layout);
  void update(FiberNumbers numbers);
  void update(FiberNumbers start, FiberNumbers end);

  py::array pairs(const Tree* other) const;
  py::array pairs(const TriangleMesh& mesh) const;
  py::array movingPairs(const Tree* other) const;
  /// Calls visit(array of at most `block` pairs) until it returns a true value.
  bool visitPairs(const py::function& visit, const Tree* other, std::size_t block) const;
  py::array contacts(const Tree* other) const;
  py::array contacts(const TriangleMesh& mesh) const;

  py::array impacts(const Tree* other) const;
  py::array impacts(const TriangleMesh& start, const TriangleMesh& end) const;
  py::array impactContacts(const py::array& impacts, const Tree* other) const;
  py::array impactContacts(const py::array& impacts, const TriangleMesh& start,
                           const TriangleMesh& end) const;
  double safeStep(const Tree* other) const;
  double safeStep(const TriangleMesh& start, const TriangleMesh& end) const;

  py::array touching(const TriangleMesh& mesh) const;
  py::array nearest(const TriangleMesh& mesh, double distance) const;
  py::array overlaps(const CapsuleShape& capsule) const;
  py::array overlaps(const BoxShape& box) const;

  /// Returns (segments, 2): fiber and number along it.
  py::array fiberSegments(const py::array& segments) const;
  /// Returns centers, half extents, offsets into segments, and segments.
  py::tuple volumes(int depth) const;

  const FiberTree& tree() const { return tree_; }
  const FiberNumbers& numbers() const { return numbers_; }  ///< of the last build or update
  py::array offsets() const;                                ///< of the last build

 private:
  const Tree& partner(const Tree* other) const { return other != nullptr ? *other : *this; }
  template <class Question, class Partner>
  auto query(const Question& question, const Partner& partner) const;
  template <class Question>
  auto query(const Question& question, const Tree* other) const;

  FiberTree tree_;
  FiberLayout layout_{{0}, {}, {}, {}, {}};
  FiberNumbers numbers_ = noFibers();
  std::optional<FiberNumbers> start_;  ///< of the step, if there is one
  mutable Users users_;
  mutable std::size_t pairs_before_ = 0;  ///< of the last query; the next may find as many

  static FiberNumbers noFibers();
  const FiberNumbers& startOfStep() const;
};

}  // namespace fcl_fibers::python
