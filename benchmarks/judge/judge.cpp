// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/benchmark/judge.h>

#include <array>
#include <cstddef>
#include <limits>
#include <stdexcept>

namespace fcl_fibers::benchmarks {
namespace {

using Cell = Eigen::Array3i;

constexpr int kMostCells = 1 << 20;  ///< along an axis, for three of them to make a key
constexpr int kMostCellsOfBox = 64;  ///< who is in more is compared with all others

struct Box {
  Eigen::Array3d least, greatest;
};

/// Around the capsule and the rounding.
Box boxOf(const Capsule& capsule, double rounding) {
  const double spread = (1 + 1e-6) * capsule.radius + rounding;
  return {capsule.from.cwiseMin(capsule.to).array() - spread,
          capsule.from.cwiseMax(capsule.to).array() + spread};
}

/// Cells of one size over all boxes.
class Grid {
 public:
  explicit Grid(const std::vector<Box>& boxes) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Eigen::Array3d least = Eigen::Array3d::Constant(kInfinity), greatest = -least;
    double edges = 0;
    for (const Box& box : boxes) {
      least = least.min(box.least);
      greatest = greatest.max(box.greatest);
      edges += (box.greatest - box.least).mean();
    }
    const double extent = (greatest - least).maxCoeff();
    origin_ = least;
    edge_ = std::max(1.5 * edges / static_cast<double>(boxes.size()), extent / kMostCells);
  }

  /// Never decreases with the point.
  Cell cellOf(const Eigen::Array3d& point) const {
    if (edge_ == 0) return Cell::Zero();
    return ((point - origin_) / edge_).min(kMostCells).cast<int>();
  }

  static std::uint64_t keyOf(const Cell& cell) {
    const auto part = [&](int axis) { return static_cast<std::uint64_t>(cell[axis]); };
    return part(0) << 42 | part(1) << 21 | part(2);
  }

 private:
  Eigen::Array3d origin_;
  double edge_;
};

struct Cells {
  Cell least, greatest;

  std::ptrdiff_t count() const { return (greatest - least + 1).cast<std::ptrdiff_t>().prod(); }
};

}  // namespace

std::vector<CapsulePair> touchingPairs(const std::vector<Capsule>& capsules, double rounding,
                                       Contact kind) {
  if (!(rounding >= 0 && std::isfinite(rounding))) {
    throw std::invalid_argument("touchingPairs: the rounding has to be finite and not negative");
  }
  if (capsules.empty()) return {};
  std::vector<Box> boxes;
  for (const Capsule& capsule : capsules) {
    const bool is_finite = std::isfinite((capsule.to - capsule.from).squaredNorm());
    if (!is_finite || !(capsule.radius >= 0 && std::isfinite(capsule.radius))) {
      throw std::invalid_argument(
          "touchingPairs: coordinates and radii have to be finite, and squares of lengths too, and "
          "no radius negative");
    }
    boxes.push_back(boxOf(capsule, rounding));
  }
  const Grid grid(boxes);

  std::vector<Cells> cells;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> entries;
  std::vector<std::uint32_t> large;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    cells.push_back({grid.cellOf(boxes[i].least), grid.cellOf(boxes[i].greatest)});
    const auto& [least, greatest] = cells.back();
    if (cells.back().count() > kMostCellsOfBox) {
      large.push_back(i);
      continue;
    }
    Cell cell = least;
    for (cell[0] = least[0]; cell[0] <= greatest[0]; ++cell[0]) {
      for (cell[1] = least[1]; cell[1] <= greatest[1]; ++cell[1]) {
        for (cell[2] = least[2]; cell[2] <= greatest[2]; ++cell[2]) {
          entries.emplace_back(Grid::keyOf(cell), i);
        }
      }
    }
  }
  std::sort(entries.begin(), entries.end());

  std::vector<CapsulePair> pairs;
  const auto test = [&](std::uint32_t i, std::uint32_t j) {
    if (contact(capsules[i], capsules[j], rounding) != kind) return;
    pairs.emplace_back(std::min(i, j), std::max(i, j));
  };
  for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    const std::uint64_t key = entries[begin].first;
    while (end < entries.size() && entries[end].first == key) ++end;
    for (std::size_t a = begin; a < end; ++a) {
      const std::uint32_t i = entries[a].second;
      for (std::size_t b = a + 1; b < end; ++b) {
        const std::uint32_t j = entries[b].second;
        const Box &p = boxes[i], &q = boxes[j];
        if ((p.least > q.greatest).any() || (q.least > p.greatest).any()) continue;
        // Two boxes may share many cells. They meet in the first one of these.
        if (Grid::keyOf(cells[i].least.max(cells[j].least)) == key) test(i, j);
      }
    }
  }
  std::vector<bool> is_large(capsules.size());
  for (const std::uint32_t i : large) {
    is_large[i] = true;
    for (std::uint32_t j = 0; j < capsules.size(); ++j) {
      if (!is_large[j]) test(i, j);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace fcl_fibers::benchmarks
