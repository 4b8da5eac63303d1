// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/live_pairs.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

#include "arrays.h"
#include "found.h"
#include "query.h"
#include "tree.h"

namespace fcl_fibers::python {
namespace {

/// LivePairs of a tree and a partner, which the object of Python keeps alive. Their guard is that
/// of the tree: an update is a change of it, and a read is a query of it.
/// @tparam Partner  Tree, which may be the same one, or TriangleMesh
template <class Partner>
class Live {
 public:
  static constexpr bool kIsOfMesh = std::is_same_v<Partner, TriangleMesh>;
  using Of = std::conditional_t<kIsOfMesh, TriangleMesh, FiberTree>;
  using Pair = FoundBy<Pairs, Of>;

  Live(Tree& tree, const Partner& partner, double skin)
      : tree_(tree), partner_(partner), mesh_(copyOf(partner)), live_(tree.tree(), of(), {skin}) {}

  void update() {
    const Change own(tree_.users());
    const std::optional<Query> others = queryOfPartner();
    if constexpr (kIsOfMesh) *mesh_ = partner_;
    {
      const Unlocked unlocked;
      live_.update();
    }
    layout_ = layout();
  }

  py::array pairs() const {
    const Query own(tree_.users());
    return toNumPy(found());
  }
  py::array slots() const {
    const Query own(tree_.users());
    std::vector<std::int32_t> slots;
    slots.reserve(live_.count());
    live_.visit([&](const Pair&, std::int32_t slot) { slots.push_back(slot); });
    return toNumPy(std::move(slots));
  }

  py::array contacts(bool bare) const {
    const Query own(tree_.users());
    if (live_.count() > 0 && layout() != layout_) {
      throw py::value_error(
          "the fibers have other offsets than at the last update() of these pairs; update them");
    }
    if constexpr (kIsOfMesh) {
      // The program may move the mesh meanwhile.
      return tree_.contactsOf<MeshContact>(found(), TriangleMesh(partner_), meshContactType());
    } else if (bare) {
      return tree_.contactsOf<BareContact>(found(), &partner_, bareType());
    } else {
      return tree_.contactsOf<Contact>(found(), &partner_, contactType());
    }
  }

  /// Returns pairs and slots.
  template <auto get>
  py::tuple changes() const {
    const Query own(tree_.users());
    std::vector<Pair> pairs;
    std::vector<std::int32_t> slots;
    for (const LivePair<Pair>& one : (live_.*get)()) {
      pairs.push_back(one.pair);
      slots.push_back(one.slot);
    }
    return py::make_tuple(toNumPy(std::move(pairs)), toNumPy(std::move(slots)));
  }

  /// Of the points of the tree, and of the partner if that is another tree.
  py::object safeDistances(bool skips_touching) const {
    const Query own(tree_.users());
    const std::optional<Query> others = queryOfPartner();
    const py::dtype type = py::dtype::of<double>();
    std::vector<double> distances, of_partner;
    if constexpr (kIsOfMesh) {
      // It tells whether the mesh has moved since the update. Other threads wait meanwhile.
      *mesh_ = partner_;
      live_.safeDistances(distances, skips_touching);
      return toArray(std::move(distances), type);
    } else {
      const bool is_own = isOwn();
      {
        const Unlocked unlocked;
        if (is_own) {
          live_.safeDistances(distances, skips_touching);
        } else {
          live_.safeDistances(distances, of_partner, skips_touching);
        }
      }
      if (is_own) return toArray(std::move(distances), type);
      return py::make_tuple(toArray(std::move(distances), type),
                            toArray(std::move(of_partner), type));
    }
  }

  /// Returns what a function of the pairs without arguments does.
  template <auto get>
  auto value() const {
    const Query own(tree_.users());
    return (live_.*get)();
  }

  /// In the order of LivePairsCounters.
  py::tuple counters() const {
    const LivePairsCounters all = value<&LivePairs<Of>::counters>();
    return py::make_tuple(all.updates, all.listings, all.uncovered_pairs, all.tested_pairs,
                          all.touching_pairs, all.longest_life);
  }

 private:
  static std::optional<TriangleMesh> copyOf(const Partner& partner) {
    if constexpr (kIsOfMesh) {
      return partner;
    } else {
      return std::nullopt;
    }
  }
  const Of& of() const {
    if constexpr (kIsOfMesh) {
      return *mesh_;
    } else {
      return partner_.tree();
    }
  }
  bool isOwn() const {
    if constexpr (kIsOfMesh) {
      return false;
    } else {
      return &partner_ == &tree_;
    }
  }
  std::optional<Query> queryOfPartner() const {
    if constexpr (!kIsOfMesh) {
      if (!isOwn()) return std::optional<Query>(std::in_place, partner_.users());
    }
    return std::nullopt;
  }
  std::uint32_t layout() const {
    if constexpr (kIsOfMesh) {
      return tree_.tree().layout();
    } else {
      return tree_.tree().layout(partner_.tree());
    }
  }
  std::vector<Pair> found() const {
    std::vector<Pair> pairs;
    live_.find(pairs);
    return pairs;
  }

  Tree& tree_;
  const Partner& partner_;
  /// Of the last call that has read it, which another thread does not move meanwhile; none if the
  /// partner is none.
  mutable std::optional<TriangleMesh> mesh_;
  LivePairs<Of> live_;
  std::uint32_t layout_ = 0;  ///< of the last update
};

template <class Partner>
void addLive(py::module_& module, const char* name) {
  using One = Live<Partner>;
  using Pairs = LivePairs<typename One::Of>;
  py::class_<One>(module, name)
      .def(py::init<Tree&, const Partner&, double>(), py::keep_alive<1, 2>(),
           py::keep_alive<1, 3>())
      .def("update", &One::update)
      .def("pairs", &One::pairs)
      .def("slots", &One::slots)
      .def("contacts", &One::contacts)
      .def("begun", &One::template changes<&Pairs::begun>)
      .def("ended", &One::template changes<&Pairs::ended>)
      .def("safe_distances", &One::safeDistances)
      .def("counters", &One::counters)
      .def_property_readonly("count", &One::template value<&Pairs::count>)
      .def_property_readonly("slot_count", &One::template value<&Pairs::slotCount>)
      .def_property_readonly("skin", &One::template value<&Pairs::skin>)
      .def_property_readonly("memory_usage", &One::template value<&Pairs::memoryUsage>);
}

}  // namespace

void addLivePairs(py::module_& module) {
  addLive<Tree>(module, "LiveOfTrees");
  addLive<TriangleMesh>(module, "LiveOfMesh");
}

}  // namespace fcl_fibers::python
