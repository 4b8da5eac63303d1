// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/fiber_index.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <variant>

#include "arrays/fiber_arrays.h"
#include "fibers/options.h"
#include "tree/volumes.h"

namespace fcl_fibers::arrays {
namespace {

using fibers::FiberTable;
using geometry::Frame;

constexpr char kUpdate[] = "FiberTree::update";
constexpr char kStart[] = "FiberTree::update: at the start";
constexpr char kEnd[] = "FiberTree::update: at the end";

const FiberTreeOptions& checked(const FiberTreeOptions& options) {
  fibers::requireValid("FiberTree::FiberTree", options);
  return options;
}

index::IndexOptions indexOptions(const FiberTreeOptions& options) {
  index::IndexOptions result =
      fibers::indexOptions(options, options.volumes == FiberTreeOptions::Volumes::kWrappedSpheres);
  result.share_ends = true;
  return result;
}

/// Rounds outward. Division by the scale, a power of two, is exact.
TreeVolume toWorld(const geometry::Box& box, const geometry::Frame& frame) {
  TreeVolume volume;
  const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
  for (int k = 0; k < 3; ++k) {
    const double low = std::nextafter(double{box.low[k]} / frame.scale + origin[k],
                                      -std::numeric_limits<double>::infinity());
    const double high = std::nextafter(double{box.high[k]} / frame.scale + origin[k],
                                       std::numeric_limits<double>::infinity());
    volume.center[k] = low + (high - low) / 2;
    volume.half[k] = std::nextafter(std::max(high - volume.center[k], volume.center[k] - low),
                                    std::numeric_limits<double>::infinity());
  }
  return volume;
}

TreeVolume toWorld(const geometry::Sphere& sphere, const geometry::Frame& frame) {
  TreeVolume volume;
  volume.kind = FiberTreeOptions::Volumes::kWrappedSpheres;
  const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
  // By how much rounding moves the centre: half an ulp on each axis, and room for the sum.
  double moved = 0;
  for (int k = 0; k < 3; ++k) {
    volume.center[k] = double{sphere.center[k]} / frame.scale + origin[k];
    moved += std::numeric_limits<double>::epsilon() * std::fabs(volume.center[k]);
  }
  const double radius = std::nextafter(double{sphere.radius} / frame.scale + moved,
                                       std::numeric_limits<double>::infinity());
  std::fill_n(volume.half, 3, radius);
  return volume;
}

/// A hash of two numbers, never 0 (Steele, Lea and Flood, Fast splittable pseudorandom number
/// generators, 2014, mix64 of figure 16).
std::uint32_t hashOf(std::uint64_t first, std::uint64_t second) {
  std::uint64_t x = first * 0x9e3779b97f4a7c15 + second;
  x = (x ^ (x >> 33)) * 0xff51afd7ed558ccd;
  x = (x ^ (x >> 33)) * 0xc4ceb9fe1a85ec53;
  return static_cast<std::uint32_t>(x >> 32) | 1;
}

/// Returns another number each time, never 0.
std::uint64_t newNumber() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

std::uint32_t layoutOf(const FiberTable& table) {
  std::uint32_t layout = hashOf(0, static_cast<std::uint64_t>(table.idCount()));
  for (std::size_t f = 0; f < table.fiberCount(); ++f) {
    layout = hashOf(layout, static_cast<std::uint64_t>(table.beginOf(f)));
    if (table.hasGaps()) layout = hashOf(layout, static_cast<std::uint64_t>(table.idsEnd(f)));
  }
  return layout;
}

}  // namespace

void refuse(const char* call, const std::string& what) {
  fibers::throwInvalidArgument(std::string("FiberTree::") + call, what);
}

FiberIndex::FiberIndex(const FiberTreeOptions& options)
    : options_(checked(options)), table_(emptyTable()), index_(indexOptions(options)) {}

std::size_t FiberIndex::memoryUsage() const {
  return sizeof(*this) + table_.memoryUsage() + joints_.memoryUsage() + index_.memoryUsage();
}

std::uint32_t FiberIndex::layout(const FiberIndex* other) const {
  return other == nullptr || other == this ? layout_ : hashOf(layout_, other->layout_);
}

FiberTable FiberIndex::emptyTable() const {
  return FiberTable(fibers::neighborRule(options_), /*ids_behind=*/1);
}

template <typename S>
void FiberIndex::build(const FiberArrays<S>& fibers) {
  const double largest = checkArrays("FiberTree::build", fibers, index_.executor());
  Joints joints = checkedJoints("FiberTree::build", fibers, index_.executor());
  FiberTable table = emptyTable();
  addFibers(fibers, table, index_.executor());
  join(joints, table);
  rebuild("FiberTree::build", ArraySource<S>(fibers, largest), &table, std::move(joints));
}

template <typename S>
void FiberIndex::update(const FiberArrays<S>* start, const FiberArrays<S>& fibers) {
  parallel::Executor* const executor = index_.executor();
  double largest = checkArrays(start != nullptr ? kEnd : kUpdate, fibers, executor);
  if (start != nullptr) largest = std::max(largest, checkArrays(kStart, *start, executor));
  const auto checkFibers = [this](const char* which, const FiberArrays<S>& given) {
    if (hasFibersOf(given)) return;
    refuse("update", std::string("the fibers ") + which +
                         "have other numbers of points than at the last build(); call build() "
                         "instead");
  };
  if (start != nullptr) {
    checkFibers("at the start ", *start);
    checkStillJoined(kStart, *start, joints_, executor);
  }
  checkFibers(start != nullptr ? "at the end " : "", fibers);
  checkStillJoined(start != nullptr ? kEnd : kUpdate, fibers, joints_, executor);
  if (start != nullptr && options_.volumes != FiberTreeOptions::Volumes::kLayeredBoxes) {
    refuse(
        "update",
        "wrapped spheres have no motion; construct the tree with Volumes::kLayeredBoxes, or pass "
        "the end of the step alone");
  }
  refit(kUpdate, ArraySource<S>(fibers, largest), /*may_wait=*/start == nullptr);
  if (start == nullptr) return index_.endStep();
  is_valid_ = false;
  if (!index_.fitStart(ArraySource<S>(*start, largest))) {
    refuse("update", "the start of the step cannot be read; do not change it during the call");
  }
  is_valid_ = true;
}

/// From now on nobody takes what was found before for what is now, even if the change fails.
void FiberIndex::beginChange() {
  is_valid_ = false;
  update_number_ = newNumber();
}

template <typename S>
void FiberIndex::rebuild(const char* call, const ArraySource<S>& source, FiberTable* table,
                         Joints joints) {
  const tree::Fibers runs = table->segments(index_.executor());
  const Frame frame = frameFor(call, source, runs.ids);
  beginChange();
  if (table != &table_) {
    table_ = std::move(*table);
    joints_ = std::move(joints);
    layout_ = layoutOf(table_);
    build_number_ = update_number_;
  }
  index_.build(source, frame, 0, table_.idCount(), runs);
  is_valid_ = true;
}

template <typename S>
void FiberIndex::refit(const char* call, const ArraySource<S>& source, bool may_wait) {
  if (!is_valid_ || !source.staysFiniteIn(index_.frame())) return rebuild(call, source, &table_);
  beginChange();
  if (may_wait && watch_.use_count() > 1) {
    index_.endStep();
    if (index_.reread(source)) {
      is_valid_ = true;
      return;
    }
  }
  if (!index_.refit(source)) {
    index_.build(source, index_.betterFrame(source), 0, table_.idCount(),
                 table_.segments(index_.executor()));
  }
  is_valid_ = true;
}

template <typename S>
bool FiberIndex::hasFibersOf(const FiberArrays<S>& fibers) const {
  if (fibers.fiber_count != table_.fiberCount() ||
      fibers.point_count != static_cast<std::size_t>(table_.idCount())) {
    return false;
  }
  const bool may_have_gaps = table_.hasGaps() || fibers.point_end != nullptr;
  return areAll(index_.executor(), table_.fiberCount(), [&](std::size_t f) {
    return static_cast<std::size_t>(table_.beginOf(f)) == fibers.point_begin[f] &&
           (!may_have_gaps || static_cast<std::size_t>(table_.idsEnd(f)) == pointEnd(fibers, f));
  });
}

const char* FiberIndex::problem(bool needs_capsules, bool needs_step) const {
  if (!is_valid_) return "the last build() or update() failed; call build()";
  if (needs_capsules && !index_.keepsSegments()) {
    return "the tree reports volumes and keeps no capsules; construct it with Report::kCapsules";
  }
  if (needs_step && !index_.moves()) return "the fibers rest; call update(start, end) before";
  return nullptr;
}

std::vector<std::int32_t> FiberIndex::segments() const {
  const tree::SegmentIds ids = table_.segments(index_.executor()).ids;
  return {ids.begin(), ids.end()};
}

std::vector<TreeVolume> FiberIndex::volumes(int depth) const {
  std::vector<TreeVolume> volumes;
  const auto add = [&](const auto& volume, std::int32_t begin, std::int32_t end) {
    volumes.push_back(toWorld(volume, index_.frame()));
    volumes.back().segments = index_.leaves().data() + begin;
    volumes.back().segment_count = static_cast<std::size_t>(end - begin);
  };
  std::visit([&](const auto& tree) { visitVolumes(tree, depth, add); }, index_.tree());
  return volumes;
}

#define FCL_FIBERS_INSTANTIATE(S)                                                 \
  template void FiberIndex::build(const FiberArrays<S>&);                         \
  template void FiberIndex::update(const FiberArrays<S>*, const FiberArrays<S>&); \
  template bool FiberIndex::hasFibersOf(const FiberArrays<S>&) const;
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::arrays
