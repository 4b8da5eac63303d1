// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "arrays/array_source.h"
#include "fibers/fiber_table.h"
#include "fibers/options.h"
#include "index/segment_index.h"
#include "tree/volumes.h"

namespace fcl_fibers {
namespace {

using fibers::FiberTable;
using geometry::Frame;
using index::SegmentId;
using tree::Visit;

[[noreturn]] void refuse(const char* call, const std::string& what) {
  fibers::throwInvalidArgument(std::string("FiberTree::") + call, what);
}

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

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Rounds outward. Division by the scale, a power of two, is exact.
TreeVolume toWorld(const geometry::Box& box, const Frame& frame) {
  TreeVolume volume;
  const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
  for (int k = 0; k < 3; ++k) {
    const double low = std::nextafter(double{box.low[k]} / frame.scale + origin[k], -kInfinity);
    const double high = std::nextafter(double{box.high[k]} / frame.scale + origin[k], kInfinity);
    volume.center[k] = low + (high - low) / 2;
    volume.half[k] =
        std::nextafter(std::max(high - volume.center[k], volume.center[k] - low), kInfinity);
  }
  return volume;
}

TreeVolume toWorld(const geometry::Sphere& sphere, const Frame& frame) {
  TreeVolume volume;
  volume.kind = FiberTreeOptions::Volumes::kWrappedSpheres;
  const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
  // By how much rounding moves the centre: half an ulp on each axis, and room for the sum.
  double moved = 0;
  for (int k = 0; k < 3; ++k) {
    volume.center[k] = double{sphere.center[k]} / frame.scale + origin[k];
    moved += std::numeric_limits<double>::epsilon() * std::fabs(volume.center[k]);
  }
  const double radius = std::nextafter(double{sphere.radius} / frame.scale + moved, kInfinity);
  std::fill_n(volume.half, 3, radius);
  return volume;
}

/// Orders pairs of one tree so that a < b, and leaves out neighbours. It avoids branches in both,
/// because they cannot be predicted.
class PairsOfOne {
 public:
  explicit PairsOfOne(const FiberTable& table) : are_neighbors_(table) {}

  /// Writes the pair to `out` and returns how many were written: 0 or 1.
  FCL_FIBERS_ALWAYS_INLINE std::size_t operator()(const tree::Pair& pair, SegmentPair& out) const {
    // The sign is spread over all bits, because compilers turn std::min() into a branch.
    const std::int32_t differ = (pair.a ^ pair.b) & ((pair.b - pair.a) >> 31);
    out = {pair.a ^ differ, pair.b ^ differ};
    return are_neighbors_(out.a, out.b) ? 0 : 1;
  }

 private:
  const FiberTable::NeighborTest are_neighbors_;
};
struct PairsOfTwo {
  FCL_FIBERS_ALWAYS_INLINE std::size_t operator()(const tree::Pair& pair, SegmentPair& out) const {
    out = {pair.a, pair.b};
    return 1;
  }
};

/// Converts pairs to the public type and hands them to take(pairs, count), which returns true to
/// end the search.
template <class Convert, class F>
class PairsTo final : public index::PairSink {
 public:
  PairsTo(const Convert& convert, F take) : convert_(convert), take_(std::move(take)) {}

  Visit take(const tree::Pair* pairs, std::size_t count) override {
    constexpr std::size_t kRun = 256;
    std::array<SegmentPair, kRun> run;
    for (const tree::Pair* const end = pairs + count; pairs != end;) {
      const tree::Pair* const run_end =
          pairs + std::min(kRun, static_cast<std::size_t>(end - pairs));
      std::size_t size = 0;
      for (; pairs != run_end; ++pairs) size += convert_(*pairs, run[size]);
      if (size > 0 && take_(run.data(), size)) return Visit::kStop;
    }
    return Visit::kContinue;
  }

 private:
  const Convert convert_;
  F take_;
};

}  // namespace

class FiberTree::Impl {
 public:
  explicit Impl(const FiberTreeOptions& options)
      : options_(checked(options)), table_(emptyTable()), index_(indexOptions(options)) {}

  const FiberTreeOptions& options() const { return options_; }
  const FiberTable& table() const { return table_; }
  std::size_t segmentCount() const { return index_.leaves().size(); }
  std::size_t memoryUsage() const {
    return sizeof(*this) + table_.memoryUsage() + index_.memoryUsage();
  }

  template <typename S>
  void build(const FiberArrays<S>& fibers) {
    const double largest = arrays::checkArrays("FiberTree::build", fibers);
    FiberTable table = emptyTable();
    arrays::addFibers(fibers, table);
    buildIndex("FiberTree::build", arrays::ArraySource<S>(fibers, largest), &table);
  }

  template <typename S>
  void update(const FiberArrays<S>& fibers) {
    const double largest = arrays::checkArrays("FiberTree::update", fibers);
    bool has_same_fibers = fibers.fiber_count == table_.fiberCount() &&
                           fibers.point_count == static_cast<std::size_t>(table_.idCount());
    for (std::size_t f = 0; has_same_fibers && f < table_.fiberCount(); ++f) {
      has_same_fibers = static_cast<std::size_t>(table_.beginOf(f)) == fibers.point_begin[f];
    }
    if (!has_same_fibers) {
      refuse(
          "update",
          "the fibers have other numbers of points than at the last build(); call build() instead");
    }
    const arrays::ArraySource<S> source(fibers, largest);
    if (!is_valid_ || !source.staysFiniteIn(index_.frame())) {
      return buildIndex("FiberTree::update", source, &table_);
    }
    is_valid_ = false;
    if (!index_.refit(source)) {
      const Frame frame = index_.betterFrame(source);
      index_.build(source, frame, 0, table_.idCount(), segmentsOf(table_));
    }
    is_valid_ = true;
  }

  template <class F>
  bool visitPairs(F take) const {
    requireValid("visitPairs");
    PairsTo sink(PairsOfOne(table_), std::move(take));
    return index_.search(sink) == Visit::kStop;
  }

  template <class F>
  bool visitPairs(const Impl& other, F take) const {
    requireValid("visitPairs");
    other.requireValid("visitPairs");
    if (!index_.matches(other.index_)) {
      refuse("visitPairs",
             "the trees have different volumes or topologies; construct both with the same");
    }
    if (index_.keepsSegments() && !other.index_.keepsSegments()) {
      refuse("visitPairs",
             "the other tree reports volumes and keeps no capsules; construct it with "
             "Report::kCapsules");
    }
    PairsTo sink(PairsOfTwo(), std::move(take));
    return index_.search(other.index_, nullptr, sink) == Visit::kStop;
  }

  std::vector<TreeVolume> volumes(int depth) const {
    requireValid("volumes");
    if (depth < 0) refuse("volumes", "depth is " + std::to_string(depth) + "; give 0 or more");
    std::vector<TreeVolume> volumes;
    std::visit(
        [&](const auto& tree) {
          visitVolumes(tree, depth, [&](const auto& volume, std::int32_t begin, std::int32_t end) {
            volumes.push_back(toWorld(volume, index_.frame()));
            volumes.back().segments = index_.leaves().data() + begin;
            volumes.back().segment_count = static_cast<std::size_t>(end - begin);
          });
        },
        index_.tree());
    return volumes;
  }

  FiberSegment fiberSegment(std::int32_t segment) const {
    if (segment < 0 || segment >= table_.idCount() || table_.isBehind(segment)) {
      refuse("fiberSegment", "no capsule starts at point " + std::to_string(segment) +
                                 "; pass a number of a pair that this tree has reported");
    }
    const fibers::Place place = table_.placeOf(segment);
    return {place.fiber, place.segment};
  }

 private:
  FiberTable emptyTable() const {
    return FiberTable(fibers::neighborRule(options_), /*ids_behind=*/1);
  }

  static tree::Fibers segmentsOf(const FiberTable& table) {
    return table.segmentsFrom(0, [](SegmentId) { return true; });
  }

  template <typename S>
  void buildIndex(const char* call, const arrays::ArraySource<S>& source, FiberTable* table) {
    const tree::Fibers runs = segmentsOf(*table);
    const Frame frame = arrays::frameFor(call, source, runs.ids);
    is_valid_ = false;
    if (table != &table_) table_ = std::move(*table);
    index_.build(source, frame, 0, table_.idCount(), runs);
    is_valid_ = true;
  }

  void requireValid(const char* call) const {
    if (!is_valid_) refuse(call, "the last build() or update() failed; call build()");
  }

  FiberTreeOptions options_;
  FiberTable table_;
  index::SegmentIndex index_;
  bool is_valid_ = true;  ///< false after a build() or update() has thrown
};

FiberTree::FiberTree(const FiberTreeOptions& options) : impl_(std::make_unique<Impl>(options)) {}
FiberTree::~FiberTree() = default;
FiberTree::FiberTree(FiberTree&&) noexcept = default;
FiberTree& FiberTree::operator=(FiberTree&&) noexcept = default;

void FiberTree::build(const FiberArrays<float>& fibers) { impl_->build(fibers); }
void FiberTree::build(const FiberArrays<double>& fibers) { impl_->build(fibers); }
void FiberTree::update(const FiberArrays<float>& fibers) { impl_->update(fibers); }
void FiberTree::update(const FiberArrays<double>& fibers) { impl_->update(fibers); }

bool FiberTree::visitRuns(Runs& runs) const {
  return impl_->visitPairs(
      [&](const SegmentPair* pairs, std::size_t count) { return runs.take(pairs, count); });
}

bool FiberTree::visitRuns(const FiberTree& other, Runs& runs) const {
  if (&other == this) return visitRuns(runs);
  return impl_->visitPairs(*other.impl_, [&](const SegmentPair* pairs, std::size_t count) {
    return runs.take(pairs, count);
  });
}

void FiberTree::findPairs(std::vector<SegmentPair>& pairs) const {
  pairs.clear();
  impl_->visitPairs([&](const SegmentPair* run, std::size_t count) {
    pairs.insert(pairs.end(), run, run + count);
    return false;
  });
}

std::vector<TreeVolume> FiberTree::volumes(int depth) const { return impl_->volumes(depth); }
FiberSegment FiberTree::fiberSegment(std::int32_t segment) const {
  return impl_->fiberSegment(segment);
}
std::size_t FiberTree::fiberCount() const { return impl_->table().fiberCount(); }
std::size_t FiberTree::segmentCount() const { return impl_->segmentCount(); }
const FiberTreeOptions& FiberTree::options() const { return impl_->options(); }
std::size_t FiberTree::memoryUsage() const { return impl_->memoryUsage(); }

}  // namespace fcl_fibers
