// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/accumulate.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <variant>

#include "fibers/options.h"

namespace fcl_fibers::arrays {
namespace {

/// Contacts that one thread takes in a row.
constexpr std::size_t kAtOnce = 4096;
/// From so many on, several threads add.
constexpr std::size_t kMany = std::size_t{1} << 18;

/// A call with contacts of one type. The points of the partner are numbered on from those of the
/// tree, so that there is one range of points.
template <class Found>
class Accumulation {
 public:
  Accumulation(const Found* first, const ContactForces& forces, const FiberIndex& index,
               const FiberIndex* other, const TriangleMesh* mesh, const PointSums& sums,
               const PointSums& partner_sums)
      : first_(reinterpret_cast<const char*>(first)),
        forces_(forces),
        index_(index),
        other_(other != nullptr ? *other : index),
        mesh_(mesh),
        sums_{sums, partner_sums},
        layout_(index.layout(other)),
        begin_(other == nullptr && mesh == nullptr ? 0 : index.table().idCount()),
        end_(static_cast<std::size_t>(begin_) +
             (mesh != nullptr ? mesh->pointCount()
                              : static_cast<std::size_t>(other_.table().idCount()))) {
    const bool floats = std::holds_alternative<float*>(sums.numbers) ||
                        std::holds_alternative<float*>(partner_sums.numbers);
    if (floats) largest_ = double{std::numeric_limits<float>::max()};
  }

  /// Refuses the first contact that has a problem.
  void check(const std::string& call) const {
    std::atomic<std::size_t> first{forces_.count};
    index_->forRanges(forces_.count, kAtOnce, [&](std::size_t begin, std::size_t end) {
      while (begin < end && problem(begin) == nullptr) ++begin;
      std::size_t least = first;
      while (begin < end && begin < least && !first.compare_exchange_weak(least, begin)) continue;
    });
    if (first == forces_.count) return;
    fibers::throwInvalidArgument(call, "contact " + std::to_string(first) + ": " + problem(first));
  }

  /// Each thread owns a range of points and goes over the contacts in their order, so no sum
  /// depends on the threads. It takes as long to pass over a few contacts as to add them.
  void add() const {
    const auto threads = static_cast<std::size_t>(index_.options().threads);
    if (threads == 1 || forces_.count < kMany) return addIf([](std::int32_t) { return true; });
    index_->forRanges(threads, 1, [&](std::size_t first, std::size_t last) {
      const auto begin = static_cast<std::int32_t>(end_ * first / threads);
      const auto end = static_cast<std::int32_t>(end_ * last / threads);
      addIf([begin, end](std::int32_t point) { return point >= begin && point < end; });
    });
  }

 private:
  const Found& contact(std::size_t i) const {
    return *reinterpret_cast<const Found*>(first_ + i * forces_.contact_size);
  }
  std::array<double, 3> forceAt(std::size_t i) const {
    const double* const f = forces_.numbers + forces_.numbers_each * i;
    if (forces_.numbers_each == 3) return {f[0], f[1], f[2]};
    const auto& [x, y, z] = contact(i).normal;
    return {*f * x, *f * y, *f * z};
  }

  /// What is wrong with a contact or its force, or null.
  const char* problem(std::size_t i) const {
    const Found& found = contact(i);
    if ((found.layout != layout_ && found.layout != 0) || !exists(found)) {
      return "it is not of this tree and this partner; pass contacts that were found since the "
             "last build(), with the partner that they were found with";
    }
    for (const double weight : nodesOf(found).weights) {
      if (!(weight >= 0 && weight <= 1)) return "s, t or a weight is not in [0, 1]";
    }
    for (const double number : forceAt(i)) {
      if (!(std::fabs(number) <= largest_)) {
        return "its force is NaN, infinite or too large for the numbers of the sums";
      }
    }
    return nullptr;
  }

  static bool has(const FiberIndex& index, std::int32_t segment, std::uint32_t layout) {
    return segment >= 0 && segment < index.table().idCount() - 1 &&
           (layout != 0 || !index.table().isBehind(segment));
  }
  bool exists(const BareContact& c) const {
    return has(index_, c.pair.a, c.layout) && has(other_, c.pair.b, c.layout);
  }
  bool exists(const ShapeContact& c) const { return has(index_, c.segment, c.layout); }
  bool exists(const MeshContact& c) const {
    return has(index_, c.segment, c.layout) && c.triangle >= 0 &&
           static_cast<std::size_t>(c.triangle) < mesh_->triangleCount();
  }

  ContactNodes<4> nodesOf(const BareContact& c) const {
    const std::int32_t b = begin_ + c.pair.b;
    return {{c.pair.a, c.pair.a + 1, b, b + 1}, c.nodes().weights};
  }
  ContactNodes<2> nodesOf(const ShapeContact& c) const { return c.nodes(); }
  ContactNodes<5> nodesOf(const MeshContact& c) const {
    const auto [i, j, k] = mesh_->corners(c.triangle);
    const auto [x, y, z] = c.weights;
    return {{c.segment, c.segment + 1, begin_ + i, begin_ + j, begin_ + k},
            {1 - c.s, c.s, x, y, z}};
  }

  /// Adds what all contacts do to the points that owns(point) is true for.
  template <class Owns>
  void addIf(const Owns& owns) const {
    for (std::size_t i = 0; i < forces_.count; ++i) {
      const auto nodes = nodesOf(contact(i));
      const std::array<double, 3> force = forceAt(i);
      for (std::size_t k = 0; k < nodes.points.size(); ++k) {
        const std::int32_t point = nodes.points[k];
        if (!owns(point)) continue;
        const bool is_of_tree = k < 2 || begin_ == 0;
        const auto at = 3 * static_cast<std::size_t>(is_of_tree ? point : point - begin_);
        const double weight = k < 2 ? -nodes.weights[k] : nodes.weights[k];
        const auto addTo = [&](auto sums) {
          if constexpr (!std::is_null_pointer_v<decltype(sums)>) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
              auto& sum = sums[at + axis];
              sum = static_cast<std::decay_t<decltype(sum)>>(sum + weight * force[axis]);
            }
          }
        };
        std::visit(addTo, sums_[is_of_tree ? 0 : 1].numbers);
      }
    }
  }

  const char* const first_;
  const ContactForces& forces_;
  const FiberIndex& index_;
  const FiberIndex& other_;
  const TriangleMesh* const mesh_;
  const PointSums sums_[2];
  const std::uint32_t layout_;
  const std::int32_t begin_;  ///< number of the partner's first point
  const std::size_t end_;     ///< of all points
  double largest_ = std::numeric_limits<double>::max();
};

}  // namespace

void accumulate(const std::string& call, const ContactForces& forces, const FiberIndex& index,
                const FiberIndex* other, const TriangleMesh* mesh, const PointSums& sums,
                const PointSums& partner_sums) {
  const auto require = [&](bool is_right, const std::string& problem) {
    if (!is_right) fibers::throwInvalidArgument(call, problem);
  };
  const auto requireSums = [&](const PointSums& of, std::size_t points, const char* owner) {
    require(std::holds_alternative<std::nullptr_t>(of.numbers) || of.point_count == points,
            "there are sums for " + std::to_string(of.point_count) + " points, but " + owner +
                " has " + std::to_string(points) + "; give three numbers for each");
  };
  require(forces.force_count == forces.count, "there are " + std::to_string(forces.force_count) +
                                                  " forces for " + std::to_string(forces.count) +
                                                  " contacts; give one for each");
  requireSums(sums, static_cast<std::size_t>(index.table().idCount()), "the tree");
  if (mesh != nullptr) requireSums(partner_sums, mesh->pointCount(), "the mesh");
  if (other != nullptr) {
    requireSums(partner_sums, static_cast<std::size_t>(other->table().idCount()), "the other tree");
  }
  const auto accumulate = [&](const auto* first) {
    const Accumulation all(first, forces, index, other, mesh, sums, partner_sums);
    all.check(call);
    all.add();
  };
  std::visit(
      [&](const auto* first) {
        using Found = std::decay_t<decltype(*first)>;
        if constexpr (std::is_same_v<Found, BareContact>) {
          require(mesh == nullptr, "the contacts are of two segments; leave the mesh out");
          accumulate(first);
        } else {
          require(other == nullptr, "the contacts are not of two trees; leave the other one out");
          // Without the mesh, what acts on it is left out.
          if constexpr (std::is_same_v<Found, MeshContact>) {
            if (mesh != nullptr) return accumulate(first);
          }
          require(mesh == nullptr, "the contacts are of no mesh; leave it out");
          accumulate(static_cast<const ShapeContact*>(first));
        }
      },
      forces.first);
}

}  // namespace fcl_fibers::arrays
