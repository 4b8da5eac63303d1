// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <pybind11/pybind11.h>

#include "arrays.h"
#include "found.h"
#include "query.h"

namespace fcl_fibers::python {

/// Contacts that are computed between two looks at signals.
inline constexpr std::size_t kContactsAtOnce = std::size_t{1} << 18;
/// That of Python.
inline constexpr std::size_t kNoLimit = std::numeric_limits<std::int64_t>::max();

/// Returns the contacts of all pairs, which write(pairs, count, contacts) computes block by block.
template <class Found, class Pair, class Write>
Unwritten<Found> inBlocks(const std::vector<Pair>& pairs, Write&& write) try {
  Unwritten<Found> contacts(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); i += kContactsAtOnce) {
    const std::size_t count = std::min(kContactsAtOnce, pairs.size() - i);
    {
      const Unlocked unlocked;
      write(pairs.data() + i, count, contacts.data() + i);
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return contacts;
} catch (const std::bad_alloc&) {
  throw TooMany(pairs.size());
}

/// Calls use(arrays of a, arrays of b), which have one scalar type.
template <class Use>
auto withBoth(const FiberNumbers& a, const FiberLayout& a_layout, const FiberNumbers& b,
              const FiberLayout& b_layout, Use&& use) {
  if (a.isFloat() && b.isFloat()) return use(a.view<float>(a_layout), b.view<float>(b_layout));
  const FiberNumbers a_doubles = a.asDouble(), b_doubles = b.asDouble();
  return use(a_doubles.view<double>(a_layout), b_doubles.view<double>(b_layout));
}

/// A FiberTree with the arrays that it was built from, which contacts are computed from. Queries
/// release the interpreter's lock.
class Tree {
 public:
  using Other = const Tree*;  ///< null for the tree itself

  explicit Tree(const FiberTreeOptions& options) : tree_(options) {}

  void build(FiberNumbers numbers, FiberLayout layout) {
    const Change change(users_);
    withArrays(numbers, layout, [&](const auto& fibers) {
      const Unlocked unlocked;
      tree_.build(fibers);
    });
    numbers_ = std::move(numbers);
    layout_ = std::move(layout);
    start_.reset();
  }

  void update(FiberNumbers numbers) {
    const Change change(users_);
    withArrays(numbers, layout_, [&](const auto& fibers) {
      const Unlocked unlocked;
      tree_.update(fibers);
    });
    numbers_ = std::move(numbers);
    start_.reset();
  }

  void update(FiberNumbers start, FiberNumbers end) {
    const Change change(users_);
    withBoth(start, layout_, end, layout_, [&](const auto& from, const auto& to) {
      const Unlocked unlocked;
      tree_.update(from, to);
    });
    numbers_ = std::move(end);
    start_ = std::move(start);
  }

  py::array offsets() const {
    const py::dtype type = py::dtype::of<std::int64_t>();
    if (layout_.end.empty()) {
      return toArray(std::vector<std::int64_t>(layout_.begin.begin(), layout_.begin.end()), type);
    }
    std::vector<std::array<std::int64_t, 2>> offsets;
    for (std::size_t f = 0; f + 1 < layout_.end.size(); ++f) {
      offsets.push_back(
          {static_cast<std::int64_t>(layout_.begin[f]), static_cast<std::int64_t>(layout_.end[f])});
    }
    return toArray(std::move(offsets), type, 2);
  }

  /// What has an order is all there before it is handed over, so it is counted first.
  template <class Partner>
  auto pairsOf(Order order, const Partner& partner, std::size_t limit) const {
    if (order != Order::kFound && limit != kNoLimit) query(Pairs{}, partner, limit);
    return query(Pairs{order}, partner, limit);
  }

  /// What the question finds of a partner.
  template <class Question, class Partner>
  py::array find(const Question& question, const Partner& partner,
                 std::size_t limit = kNoLimit) const {
    return toNumPy(query(question, partner, limit));
  }
  template <class Partner>
  py::array pairs(Order order, const Partner& partner, std::size_t limit) const {
    return toNumPy(pairsOf(order, partner, limit));
  }

  /// Calls visit(array of at most `block` pairs) until it returns a true value.
  bool visitPairs(const py::function& visit, Other other, std::size_t block) const {
    const Query own(users_);
    const Query others(partner(other).users_);
    std::vector<SegmentPair> pairs;
    Signals signals;
    bool failed = false;
    // An exception of Python stays set while C++ returns from the query.
    const auto hand = [&] {
      const Locked lock;
      try {
        const py::object result = visit(toNumPy(std::exchange(pairs, {})));
        const int stop = PyObject_IsTrue(result.ptr());
        failed = stop < 0;
        return stop != 0;
      } catch (py::error_already_set& error) {
        error.restore();
        failed = true;
        return true;
      }
    };
    const auto take = [&](SegmentPair pair) {
      pairs.push_back(pair);
      if (signals.raised()) return true;
      return pairs.size() == block && hand();
    };
    bool ended = false;
    {
      const Unlocked unlocked;
      ended = tree_.visit(Pairs{}, partner(other).tree_, take);
    }
    signals.rethrow();
    if (!ended && !pairs.empty()) ended = hand();
    if (failed) throw py::error_already_set();
    return ended;
  }

  template <class Found>
  py::array contacts(Other other, Order order, std::size_t limit, const py::dtype& type) const {
    const Query own(users_);
    return contactsOf<Found>(pairsOf(order, other, limit), other, type);
  }
  /// Of a mesh or a shape.
  template <class Partner>
  py::array contactsWith(const Partner& partner, Order order, std::size_t limit,
                         const py::dtype& type) const {
    const Query own(users_);
    return contactsOf<FoundBy<Contacts<double>, Partner>>(pairsOf(order, partner, limit), partner,
                                                          type);
  }

  /// Of pairs that have been found.
  template <class Found>
  py::array contactsOf(const std::vector<SegmentPair>& pairs, Other other,
                       const py::dtype& type) const {
    const Query own(users_);
    const Query others(partner(other).users_);
    return withBoth(numbers_, layout_, partner(other).numbers_, partner(other).layout_,
                    [&](const auto& a, const auto& b) {
                      const auto write = [&](const SegmentPair* some, std::size_t count,
                                             Found* to) {
                        tree_.writeContacts(Contacts{a, &b}, partner(other).tree_, some, count, to);
                      };
                      return toArray(inBlocks<Found>(pairs, write), type);
                    });
  }
  template <class Found, class Partner>
  py::array contactsOf(const std::vector<FoundBy<Pairs, Partner>>& pairs, const Partner& partner,
                       const py::dtype& type) const {
    const Query own(users_);
    return withArrays(numbers_, layout_, [&](const auto& fibers) {
      const auto write = [&](const auto* some, std::size_t count, Found* to) {
        tree_.writeContacts(Contacts{fibers}, partner, some, count, to);
      };
      return toArray(inBlocks<Found>(pairs, write), type);
    });
  }

  /// Adds forces at contacts of the partner, if there is one; see FiberTree::accumulate().
  /// @param partner  Tree::Other or a mesh; null is the tree itself, and for contacts with a mesh
  ///                 or a shape what acts on these alone
  template <class Partner>
  void accumulate(const py::array& contacts, const py::array& forces, const Partner& partner,
                  const PointSums& sums, const PointSums& partner_sums) const {
    const Query own(users_);
    std::optional<Query> others;
    if constexpr (std::is_same_v<Partner, Other>) others.emplace(this->partner(partner).users_);
    const auto add = [&](const auto& found) {
      const auto addAll = [&](const ContactForces& all) {
        const Unlocked unlocked;
        if constexpr (std::is_same_v<Partner, TriangleMesh>) {
          tree_.accumulate(all, partner, sums, partner_sums);
        } else if (partner != nullptr) {
          tree_.accumulate(all, partner->tree_, sums, partner_sums);
        } else {
          tree_.accumulate(all, sums);
        }
      };
      forces.ndim() == 1 ? addAll({found, Borrowed<double>(forces)})
                         : addAll({found, Borrowed<std::array<double, 3>>(forces)});
    };
    const py::dtype type = contacts.dtype();
    if (type.equal(bareType())) return add(Borrowed<BareContact>(contacts));
    if (type.equal(contactType())) return add(Borrowed<Contact>(contacts));
    if (type.equal(shapeContactType())) return add(Borrowed<ShapeContact>(contacts));
    add(Borrowed<MeshContact>(contacts));
  }

  std::uint32_t layout(Other other) const {
    const Query own(users_);
    const Query others(partner(other).users_);
    return tree_.layout(partner(other).tree_);
  }

  /// An array of one contact.
  py::array closest(Other other) const {
    const Query own(users_);
    const Query others(partner(other).users_);
    return withBoth(numbers_, layout_, partner(other).numbers_, partner(other).layout_,
                    [&](const auto& a, const auto& b) {
                      return onlyOne(Contacts{a, &b}, partner(other).tree_, contactType());
                    });
  }
  py::array closest(const TriangleMesh& mesh) const {
    const Query own(users_);
    return withArrays(numbers_, layout_, [&](const auto& fibers) {
      return onlyOne(Contacts{fibers}, mesh, meshContactType());
    });
  }

  py::array impactContacts(const py::array& impacts, Other other) const {
    const Query own(users_);
    const auto all = fromArray<Impact>(impacts, impactType());
    const FiberNumbers& start = startOfStep();
    const std::uint32_t layout = this->layout(other);
    const auto contactsOf = [&](auto&& contact) {
      const auto make = [&](const Impact& impact) {
        Contact made = contact(impact);
        made.layout = layout;
        return made;
      };
      return toArray(makeEach<Contact>(all, make), contactType());
    };
    if (other == nullptr || other == this) {
      return withBoth(start, layout_, numbers_, layout_, [&](const auto& from, const auto& to) {
        return contactsOf([&](const Impact& impact) { return impactContact(from, to, impact); });
      });
    }
    const Query others(other->users_);
    // Four arrays of one type: doubles hold all floats.
    const FiberNumbers from_a = start.asDouble(), to_a = numbers_.asDouble(),
                       from_b = other->startOfStep().asDouble(), to_b = other->numbers_.asDouble();
    const auto a_start = from_a.view<double>(layout_), a_end = to_a.view<double>(layout_),
               b_start = from_b.view<double>(other->layout_),
               b_end = to_b.view<double>(other->layout_);
    return contactsOf([&](const Impact& impact) {
      return impactContact(a_start, a_end, b_start, b_end, impact);
    });
  }

  /// Of a mesh that moves or a shape.
  template <class Partner>
  py::array impactContacts(const py::array& impacts, const Partner& partner, const py::dtype& type,
                           const py::dtype& contact_type) const {
    const Query own(users_);
    const auto all = fromArray<FoundBy<Impacts, Partner>>(impacts, type);
    return withBoth(
        startOfStep(), layout_, numbers_, layout_, [&](const auto& from, const auto& to) {
          const auto contactOf = [&](const auto& impact) {
            auto contact = impactContact(from, to, partner, impact);
            contact.layout = tree_.layout();
            return contact;
          };
          return toArray(makeEach<decltype(contactOf(all[0]))>(all, contactOf), contact_type);
        });
  }

  double safeStep(Other other) const {
    const Query own(users_);
    const Query others(partner(other).users_);
    const Unlocked unlocked;
    return tree_.safeStep(partner(other).tree_);
  }

  /// Of a mesh that moves or a shape.
  template <class Partner>
  double safeStep(const Partner& partner) const {
    const Query own(users_);
    const Unlocked unlocked;
    return tree_.safeStep(partner);
  }

  py::array segments() const {
    const Query own(users_);
    return toNumPy(tree_.segments());
  }

  /// Returns (segments, 2): fiber and number along it.
  py::array fiberSegments(const py::array& segments) const {
    const Query own(users_);
    const auto* const begin = requireArray<std::int32_t>("segments", segments);
    const std::vector<std::int32_t> all(begin, begin + segments.size());
    static_assert(sizeof(FiberSegment) == 2 * sizeof(std::int64_t));
    return toArray(makeEach<FiberSegment>(
                       all, [&](std::int32_t segment) { return tree_.fiberSegment(segment); }),
                   py::dtype::of<std::int64_t>(), 2);
  }

  /// Returns centers, half extents, offsets into segments, and segments.
  py::tuple volumes(int depth) const {
    const Query own(users_);
    using Vector = std::array<double, 3>;
    std::vector<Vector> centers, halves;
    std::vector<std::int64_t> offsets = {0};
    std::vector<std::int32_t> segments;
    {
      const Unlocked unlocked;
      for (const TreeVolume& volume : tree_.volumes(depth)) {
        centers.push_back({volume.center[0], volume.center[1], volume.center[2]});
        halves.push_back({volume.half[0], volume.half[1], volume.half[2]});
        segments.insert(segments.end(), volume.segments, volume.segments + volume.segment_count);
        offsets.push_back(static_cast<std::int64_t>(segments.size()));
      }
    }
    const py::dtype number = py::dtype::of<double>();
    return py::make_tuple(
        toArray(std::move(centers), number, 3), toArray(std::move(halves), number, 3),
        toArray(std::move(offsets), py::dtype::of<std::int64_t>()), toNumPy(std::move(segments)));
  }

  /// Returns what a function of the tree without arguments does.
  template <auto get>
  std::size_t count() const {
    const Query own(users_);
    return (tree_.*get)();
  }
  const FiberNumbers& numbers() const { return numbers_; }

  // For what borrows the tree of C++, which stays where it is.
  FiberTree& tree() { return tree_; }
  const FiberTree& tree() const { return tree_; }
  Users& users() const { return users_; }

 private:
  const FiberNumbers& startOfStep() const {
    if (start_) return *start_;
    throw py::value_error("the fibers rest; call update(start, end) before");
  }

  template <class Question, class Partner>
  py::array onlyOne(const Question& question, const Partner& partner, const py::dtype& type) const {
    std::vector<FoundBy<Question, Partner>> contacts(1);
    {
      const Unlocked unlocked;
      contacts[0] = tree_.closest(question, partner);
    }
    return toArray(std::move(contacts), type);
  }

  const Tree& partner(const Tree* other) const { return other != nullptr ? *other : *this; }
  template <class Question, class Partner>
  std::vector<FoundBy<Question, Partner>> query(const Question& question, const Partner& partner,
                                                std::size_t limit) const {
    const Query own(users_);
    using Found = FoundBy<Question, Partner>;
    if (limit == kNoLimit) {
      // That of the calls of C++ that keep what they find.
      limit = std::max((std::size_t{1} << 30) / sizeof(Found), 256 * tree_.segmentCount());
    }
    const auto visit = [&](auto&& take) { tree_.visit(question, partner, take); };
    if constexpr (!std::is_same_v<Found, SegmentPair>) {
      return collect<Found>(0, limit, visit);
    } else {
      auto pairs = collect<SegmentPair>(pairs_before_, limit, visit);
      pairs_before_ = pairs.size();
      return pairs;
    }
  }

  template <class Question>
  std::vector<FoundBy<Question, FiberTree>> query(const Question& question, Other other,
                                                  std::size_t limit) const {
    const Query others(partner(other).users_);
    return query(question, partner(other).tree_, limit);
  }

  FiberTree tree_;
  FiberLayout layout_{{0}, {}, {}, {}, {}, {}, {}, {}, {}};
  /// Of the last build or update.
  FiberNumbers numbers_{py::array_t<double>(std::vector<std::size_t>{0, 3}), py::array_t<double>(1),
                        0};
  std::optional<FiberNumbers> start_;  ///< of the step, if there is one
  mutable Users users_;
  mutable std::size_t pairs_before_ = 0;  ///< of the last query; the next may find as many
};

/// Adds the class Tree.
void addTree(py::module_& module);
/// Adds the classes LiveOfTrees and LiveOfMesh, whose trees are those of addTree().
void addLivePairs(py::module_& module);

}  // namespace fcl_fibers::python
