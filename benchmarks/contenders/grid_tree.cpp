// SPDX-License-Identifier: BSD-3-Clause
//
// What a user writes who has segments of about one length: a uniform grid with every segment in the
// cell of its midpoint. Cells are as large as the largest box, so that boxes which overlap have
// midpoints in one cell or in cells next to each other. Cells follow each other along x, and their
// boxes are sorted by them, so that cells along x are one range of boxes.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "contenders/foreign_tree.h"

namespace fcl_fibers::benchmarks {
namespace {

/// More cells than these times the boxes are mostly empty. Then cells become larger.
constexpr std::size_t kMostCellsOfBox = 4, kLeastCells = 27;

class GridTree : public ForeignTree {
 public:
  explicit GridTree(int threads) : ForeignTree(threads) {}

  void setup() override { update(); }

  using ForeignTree::update;
  void update() override {
    readBoxes();
    if (size() == 0) return;
    chooseCells();
    sortByCells();
  }

  using ForeignTree::collide;
  void collide(void* cdata, fcl::CollisionCallBack<double> callback) const override {
    forEachPair(
        [&](std::size_t i, std::size_t j) { callback(object(ids_[i]), object(ids_[j]), cdata); });
  }

  std::size_t countTouching() const override {
    const auto& capsules = readAxes<double>(
        size(), [this](std::size_t place) { return axisOf(*object(ids_[place])); });
    std::size_t count = 0;
    forEachPair(
        [&](std::size_t i, std::size_t j) { count += capsulesTouch(capsules[i], capsules[j]); });
    return count;
  }

  PairCount countPairs() const override {
    constexpr std::size_t kGrain = 4096;
    std::atomic<std::size_t> pairs{0}, visited{0};
    parallel::forRanges(executor(), cellCount(), kGrain, [&](std::size_t first, std::size_t last) {
      std::size_t found = 0, tested = 0;
      forEachRange(first, last, [&](std::size_t i, std::size_t begin, std::size_t end) {
        tested += end - begin;
        std::uint32_t count = 0;
        for (std::size_t j = begin; j < end; ++j) count += overlapSorted(i, j);
        found += count;
      });
      pairs += found;
      visited += tested;
    });
    return {pairs, visited};
  }

 private:
  std::size_t cellCount() const { return cell_begin_.empty() ? 0 : cell_begin_.size() - 1; }

  void chooseCells() {
    std::array<float, 3> greatest, edge = {};
    least_.fill(std::numeric_limits<float>::infinity());
    greatest.fill(-std::numeric_limits<float>::infinity());
    for (const FloatBox& box : boxes()) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float middle = middleOf(box, axis);
        least_[axis] = std::min(least_[axis], middle);
        greatest[axis] = std::max(greatest[axis], middle);
        edge[axis] = std::max(edge[axis], box.greatest[axis] - box.least[axis]);
      }
    }
    for (;;) {
      double cells = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        // Midpoints are rounded, and their cells as well.
        constexpr float kUlps = 4 * std::numeric_limits<float>::epsilon();
        const float rounding = kUlps * std::max(std::abs(least_[axis]), std::abs(greatest[axis]));
        per_cell_[axis] = 1 / (1.000001 * (double{edge[axis]} + double{rounding}));
        const double count =
            std::floor((double{greatest[axis]} - double{least_[axis]}) * per_cell_[axis]) + 3;
        cells_[axis] = static_cast<std::uint32_t>(count);
        cells *= count;
      }
      if (cells <= static_cast<double>(kLeastCells + kMostCellsOfBox * size())) break;
      for (float& length : edge) length *= 1.26F;
    }
  }

  void sortByCells() {
    cell_begin_.assign(std::size_t{cells_[0]} * cells_[1] * cells_[2] + 2, 0);
    cell_of_.resize(size());
    for (std::size_t i = 0; i < size(); ++i) {
      const FloatBox& box = boxes()[i];
      const auto place = [&](std::size_t axis) {
        const double from_least = double{middleOf(box, axis)} - double{least_[axis]};
        return 1 + static_cast<std::uint32_t>(from_least * per_cell_[axis]);
      };
      cell_of_[i] = (place(2) * cells_[1] + place(1)) * cells_[0] + place(0);
      ++cell_begin_[cell_of_[i] + 2];
    }
    for (std::size_t cell = 2; cell < cell_begin_.size(); ++cell) {
      cell_begin_[cell] += cell_begin_[cell - 1];
    }
    ids_.resize(size());
    for (auto& side : sorted_) side.resize(size());
    for (std::size_t i = 0; i < size(); ++i) {
      // Ends where the next cell begins.
      const std::uint32_t to = cell_begin_[cell_of_[i] + 1]++;
      ids_[to] = static_cast<std::uint32_t>(i);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sorted_[axis][to] = boxes()[i].least[axis];
        sorted_[axis + 3][to] = boxes()[i].greatest[axis];
      }
    }
    cell_begin_.pop_back();
  }

  /// Calls visit(i, begin, end) for boxes of cells first to last, and ranges of boxes that each has
  /// to be tested with.
  template <typename Visit>
  void forEachRange(std::size_t first, std::size_t last, Visit&& visit) const {
    const std::size_t row = cells_[0], layer = row * cells_[1];
    for (std::size_t cell = first; cell < last; ++cell) {
      const std::uint32_t begin = cell_begin_[cell], end = cell_begin_[cell + 1];
      if (begin == end) continue;
      // The rest of its own cell, and the next one.
      for (std::size_t i = begin; i < end; ++i) visit(i, i + 1, cell_begin_[cell + 2]);
      for (const std::size_t next :
           {cell + row, cell + layer - row, cell + layer, cell + layer + row}) {
        const std::uint32_t from = cell_begin_[next - 1], to = cell_begin_[next + 2];
        if (from == to) continue;
        for (std::size_t i = begin; i < end; ++i) visit(i, from, to);
      }
    }
  }

  /// Calls visit(i, j), by places in their order, for boxes that overlap.
  template <typename Visit>
  void forEachPair(Visit&& visit) const {
    constexpr std::size_t kBlock = 16;
    std::array<std::uint32_t, kBlock> hits = {};
    forEachRange(0, cellCount(), [&](std::size_t i, std::size_t begin, std::size_t end) {
      for (std::size_t first = begin; first < end; first += kBlock) {
        const std::size_t count = std::min(kBlock, end - first);
        std::uint32_t any = 0;
        for (std::size_t k = 0; k < count; ++k) any |= hits[k] = overlapSorted(i, first + k);
        if (any == 0) continue;
        for (std::size_t k = 0; k < count; ++k) {
          if (hits[k] != 0) visit(i, first + k);
        }
      }
    });
  }

  static float middleOf(const FloatBox& box, std::size_t axis) {
    return 0.5F * (box.least[axis] + box.greatest[axis]);
  }

  /// Without branches.
  std::uint32_t overlapSorted(std::size_t i, std::size_t j) const {
    std::uint32_t all = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      all &= static_cast<std::uint32_t>(sorted_[axis][i] <= sorted_[axis + 3][j]) &
             static_cast<std::uint32_t>(sorted_[axis][j] <= sorted_[axis + 3][i]);
    }
    return all;
  }

  std::array<float, 3> least_;
  std::array<double, 3> per_cell_;
  std::array<std::uint32_t, 3> cells_ = {};  ///< by axis, with an empty one at each end
  std::vector<std::uint32_t> cell_of_, cell_begin_, ids_;
  std::array<std::vector<float>, 6> sorted_;  ///< least and greatest by axis
};

Contender grid(int threads) {
  const std::string suffix = threads == 1 ? "" : "_2_threads";
  Contender grid = foreignContender("Grid", "midpoints" + suffix,
                                    [threads] { return std::make_unique<GridTree>(threads); });
  // It is written here, so that it has to be right.
  grid.ours = true;
  return grid;
}

const AddLibrary kGrid("Grid", "", {grid(1), grid(2)});

}  // namespace
}  // namespace fcl_fibers::benchmarks
