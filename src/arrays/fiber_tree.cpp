// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "arrays/fiber_arrays.h"
#include "tree/neighbor_rule.h"
#include "tree/scene.h"

namespace fcl_fibers {
namespace {

using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using geometry::Vec3d;
using tree::SegmentId;
using tree::Visit;

[[noreturn]] void refuse(const char* call, const std::string& what) {
  throw std::invalid_argument(std::string("fcl_fibers: FiberTree::") + call + ": " + what);
}

const FiberTreeOptions& checked(const FiberTreeOptions& options) {
  if (options.ignored_neighbors < 0) {
    refuse("FiberTree",
           "ignored_neighbors is " + std::to_string(options.ignored_neighbors) + "; set 0 or more");
  }
  if (!(options.ignored_arc_length >= 0) || !std::isfinite(options.ignored_arc_length)) {
    refuse("FiberTree", "ignored_arc_length is " + std::to_string(options.ignored_arc_length) +
                            "; set a finite length of 0 or more");
  }
  if (!(options.margin >= 0) || !std::isfinite(options.margin)) {
    refuse("FiberTree",
           "margin is " + std::to_string(options.margin) + "; set a finite length of 0 or more");
  }
  if (options.threads < 1) {
    refuse("FiberTree", "threads is " + std::to_string(options.threads) + "; set 1 or more");
  }
  return options;
}

tree::SceneOptions sceneOptions(const FiberTreeOptions& options) {
  return {options.volumes == FiberTreeOptions::Volumes::kWrappedSpheres,
          options.topology == Topology::kSuperThread, options.report == Report::kCapsules,
          options.margin, options.threads};
}

/// Reads capsules off arrays; a capsule's id is the index of its first point.
template <typename S>
class ArrayReader {
 public:
  ArrayReader(const FiberArrays<S>& fibers, const std::vector<bool>& is_last)
      : fibers_(fibers), is_last_(is_last) {}

  /// In the frame of the world.
  Segment segment(std::size_t id, std::size_t fiber) const {
    return {point(id), point(id + 1), radius(id, fiber)};
  }

  bool operator()(SegmentId id, const Frame& frame, Segment& segment) const {
    const auto index = static_cast<std::size_t>(id);
    if (is_last_[index]) return false;
    segment = {frame.fromWorld(point(index)), frame.fromWorld(point(index + 1)),
               frame.scale * radius(index, fiberOf(index))};
    return true;
  }

 private:
  Vec3d point(std::size_t i) const { return arrays::pointOf(fibers_, i); }
  double radius(std::size_t id, std::size_t fiber) const {
    return arrays::radiusOf(fibers_, id, fiber);
  }
  std::size_t fiberOf(std::size_t id) const {
    if (fibers_.radii_are != FiberArrays<S>::Radii::kPerFiber) return 0;
    return arrays::fiberOf(fibers_.point_begin, fibers_.fiber_count, id);
  }

  const FiberArrays<S>& fibers_;
  const std::vector<bool>& is_last_;
};

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Rounded outward. Division by the scale, a power of two, is exact.
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
  double moved = 0;  // by rounding of the centre: half an ulp an axis, and room for the sum
  for (int k = 0; k < 3; ++k) {
    volume.center[k] = double{sphere.center[k]} / frame.scale + origin[k];
    moved += std::numeric_limits<double>::epsilon() * std::fabs(volume.center[k]);
  }
  const double radius = std::nextafter(double{sphere.radius} / frame.scale + moved, kInfinity);
  std::fill_n(volume.half, 3, radius);
  return volume;
}

}  // namespace

class FiberTree::Impl {
 public:
  explicit Impl(const FiberTreeOptions& options)
      : options_(checked(options)),
        neighbors_(options.ignored_neighbors, options.ignored_arc_length),
        scene_(sceneOptions(options)) {}

  const FiberTreeOptions& options() const { return options_; }
  std::size_t fiberCount() const { return point_begin_.size() - 1; }
  std::size_t segmentCount() const { return segment_count_; }
  std::size_t memoryUsage() const {
    return sizeof(*this) + point_begin_.capacity() * sizeof(std::size_t) + is_last_.capacity() / 8 +
           is_closed_.capacity() / 8 + arc_end_.capacity() * sizeof(double) +
           groups_.capacity() * sizeof(tree::Group) + scene_.memoryUsage();
  }

  template <typename S>
  void build(const FiberArrays<S>& fibers) {
    checkFibers("build", fibers);
    const Frame frame = checkCoordinates("build", fibers);

    std::vector<std::size_t> point_begin(fibers.point_begin,
                                         fibers.point_begin + fibers.fiber_count + 1);
    std::vector<bool> is_last(fibers.point_count);
    std::size_t segments = 0;
    for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
      const std::size_t begin = point_begin[f], end = point_begin[f + 1];
      if (begin == end) continue;
      is_last[end - 1] = true;
      segments += end - begin - 1;
    }
    std::vector<bool> is_closed;
    if (fibers.closed != nullptr && neighbors_.ignoresAny()) {
      for (std::size_t f = 0; f < fibers.fiber_count; ++f)
        is_closed.push_back(fibers.closed[f] != 0);
    }
    std::vector<double> arc_end = arcEnds(fibers, is_last);
    std::vector<tree::Group> groups = groupsOf(fibers);
    is_whole_ = false;
    point_begin_ = std::move(point_begin);
    is_last_ = std::move(is_last);
    is_closed_ = std::move(is_closed);
    arc_end_ = std::move(arc_end);
    groups_ = std::move(groups);
    segment_count_ = segments;
    buildScene(fibers, frame);
  }

  template <typename S>
  void update(const FiberArrays<S>& fibers) {
    checkFibers("update", fibers);
    if (!std::equal(point_begin_.begin(), point_begin_.end(), fibers.point_begin,
                    fibers.point_begin + fibers.fiber_count + 1)) {
      refuse("update", "fibers have other numbers of points than at the last build(); build anew");
    }
    const Frame frame = checkCoordinates("update", fibers);
    if (!is_whole_) return buildScene(fibers, frame);
    is_whole_ = false;
    const ArrayReader<S> reader(fibers, is_last_);
    const auto read = [&](SegmentId id, Segment& segment) { return reader(id, frame, segment); };
    if (!scene_.update(frame, fibers.point_count, read)) return buildScene(fibers, frame);
    is_whole_ = true;
  }

  Visit findPairs(tree::PairSink& sink) const {
    requireWhole("visitPairs");
    if (!neighbors_.ignoresAny()) return scene_.findPairs(sink);
    NeighborFilter filter(*this, sink);
    return scene_.findPairs(filter);
  }

  Visit findPairs(const Impl& other, tree::PairSink& sink) const {
    requireMatch(other);
    return scene_.findPairs(other.scene_, other.scene_.segments().data(), sink);
  }

  /// All capsules, in the order of the tree.
  const std::vector<SegmentId>& leaves() const {
    return std::visit(
        [](const auto& tree) -> const std::vector<SegmentId>& { return tree.topology().leaves; },
        scene_.tree());
  }

  std::vector<TreeVolume> volumes(int depth) const {
    requireWhole("volumes");
    if (depth < 0) refuse("volumes", "depth is " + std::to_string(depth) + "; give 0 or more");
    std::vector<TreeVolume> volumes;
    std::visit(
        [&](const auto& tree) {
          tree.visitVolumes(depth, [&](const auto& volume, std::int32_t begin, std::int32_t end) {
            volumes.push_back(toWorld(volume, scene_.frame()));
            volumes.back().segments = leaves().data() + begin;
            volumes.back().segment_count = static_cast<std::size_t>(end - begin);
          });
        },
        scene_.tree());
    return volumes;
  }

  FiberSegment fiberSegment(std::int32_t segment) const {
    const auto id = static_cast<std::size_t>(segment);
    if (segment < 0 || id >= is_last_.size() || is_last_[id]) {
      refuse("fiberSegment", "no capsule starts at point " + std::to_string(segment));
    }
    const std::size_t fiber = fiberOf(segment);
    return {fiber, id - point_begin_[fiber]};
  }

 private:
  /// Leaves out neighbours along a fiber.
  class NeighborFilter : public tree::PairSink {
   public:
    NeighborFilter(const Impl& impl, tree::PairSink& sink) : impl_(impl), sink_(sink) {}

    Visit take(const tree::Pair* pairs, std::size_t count) override {
      std::array<tree::Pair, 256> kept;
      std::size_t size = 0;
      for (std::size_t i = 0; i < count; ++i) {
        if (impl_.areNeighbors(pairs[i])) continue;
        kept[size++] = pairs[i];
        if (size < kept.size()) continue;
        if (sink_.take(kept.data(), size) == Visit::kStop) return Visit::kStop;
        size = 0;
      }
      return size == 0 ? Visit::kContinue : sink_.take(kept.data(), size);
    }

   private:
    const Impl& impl_;
    tree::PairSink& sink_;
  };

  template <typename S>
  void buildScene(const FiberArrays<S>& fibers, const Frame& frame) {
    const auto ids = [this](auto&&) {
      tree::Fibers in_order;
      in_order.groups = groups_;
      in_order.ids.reserve(segment_count_);
      for (std::size_t f = 0; f < fiberCount(); ++f) {
        for (std::size_t i = point_begin_[f]; i + 1 < point_begin_[f + 1]; ++i) {
          in_order.ids.push_back(static_cast<SegmentId>(i));
        }
        in_order.endFiber();
      }
      return in_order;
    };
    const ArrayReader<S> reader(fibers, is_last_);
    scene_.build(frame, fibers.point_count, ids,
                 [&](SegmentId id, Segment& segment) { return reader(id, frame, segment); });
    is_whole_ = true;
  }

  void requireMatch(const Impl& other) const {
    requireWhole("visitPairs");
    other.requireWhole("visitPairs");
    if (!scene_.matches(other.scene_)) {
      refuse("visitPairs",
             "the other tree has other volumes or another topology; give both trees "
             "the same");
    }
    if (options_.report == Report::kCapsules && !other.scene_.keepsSegments()) {
      refuse("visitPairs",
             "the other tree reports volumes and keeps no capsules; give it "
             "Report::kCapsules");
    }
  }

  void requireWhole(const char* call) const {
    if (!is_whole_) refuse(call, "the last build() or update() failed; build anew");
  }

  std::size_t fiberOf(SegmentId id) const {
    return arrays::fiberOf(point_begin_.data(), fiberCount(), static_cast<std::size_t>(id));
  }

  bool areNeighbors(const tree::Pair& pair) const {
    const auto [first, last] = std::minmax(pair.a, pair.b);
    // Most pairs end here.
    if (last - first > neighbors_.reach && is_closed_.empty() && arc_end_.empty()) return false;
    const std::size_t fiber = fiberOf(first), end = point_begin_[fiber + 1];
    if (static_cast<std::size_t>(last) >= end) return false;
    // The last point starts no capsule.
    const tree::FiberRange range{static_cast<SegmentId>(point_begin_[fiber]),
                                 static_cast<SegmentId>(end) - 1,
                                 !is_closed_.empty() && is_closed_[fiber]};
    return tree::areNeighbors(neighbors_, range, arc_end_.data(), first, last);
  }

  /// Empty if all are none.
  template <typename S>
  static std::vector<tree::Group> groupsOf(const FiberArrays<S>& fibers) {
    const tree::Group* const begin = fibers.groups;
    if (begin == nullptr) return {};
    const tree::Group* const end = begin + fibers.fiber_count;
    const auto has_group = [](tree::Group group) { return group != tree::kNoGroup; };
    if (std::none_of(begin, end, has_group)) return {};
    return std::vector<tree::Group>(begin, end);
  }

  /// Empty unless arc lengths matter.
  template <typename S>
  std::vector<double> arcEnds(const FiberArrays<S>& fibers,
                              const std::vector<bool>& is_last) const {
    if (neighbors_.arc_length <= 0) return {};
    std::vector<double> ends(fibers.point_count);
    const ArrayReader<S> reader(fibers, is_last);
    double end = 0;
    for (std::size_t i = 0; i < fibers.point_count; ++i) {
      if (is_last[i]) {
        end = 0;
        continue;
      }
      const Segment segment = reader.segment(i, 0);
      end += norm(segment.b - segment.a);
      ends[i] = end;
    }
    return ends;
  }

  template <typename S>
  static void checkFibers(const char* call, const FiberArrays<S>& fibers) {
    arrays::checkEnds(fibers, [call](const std::string& what) { refuse(call, what); });
    const std::size_t* begin = fibers.point_begin;
    for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
      if (begin[f + 1] < begin[f]) {
        refuse(call, "point_begin descends at fiber " + std::to_string(f) + "; mend it");
      }
    }
  }

  /// Refuses what is not finite; returns a frame for the rest.
  template <typename S>
  static Frame checkCoordinates(const char* call, const FiberArrays<S>& fibers) {
    double largest = 0;
    for (std::size_t i = 0; i < 3 * fibers.point_count; ++i) {
      const double coordinate = std::fabs(static_cast<double>(fibers.points[i]));
      if (!std::isfinite(coordinate)) {
        refuse(call, "point " + std::to_string(i / 3) +
                         " is NaN or infinite; give it finite coordinates");
      }
      largest = std::max(largest, coordinate);
    }
    for (std::size_t i = 0; i < arrays::radiusCount(fibers); ++i) {
      // The last point of a fiber starts no capsule, but a radius there is checked all the same.
      const double radius = static_cast<double>(fibers.radii[i]);
      if (!(radius >= 0 && std::isfinite(radius))) {
        refuse(call, "radius " + std::to_string(i) +
                         " is negative, NaN or infinite; give a finite one of 0 or more");
      }
      largest = std::max(largest, radius);
    }

    constexpr std::size_t kSamples = 255;
    std::array<Segment, kSamples> samples;
    std::size_t found = 0;
    const std::vector<bool> none;
    const ArrayReader<S> reader(fibers, none);
    const std::size_t step = fibers.fiber_count / kSamples + 1;
    for (std::size_t f = 0; f < fibers.fiber_count && found < kSamples; f += step) {
      const std::size_t begin = fibers.point_begin[f], end = fibers.point_begin[f + 1];
      if (end - begin < 2) continue;
      // Each at another place along its fiber.
      samples[found] = reader.segment(begin + found % (end - begin - 1), f);
      ++found;
    }
    const Frame frame = geometry::frameFor(samples.data(), found);
    // With room for sums of a few coordinates in the frame.
    if (!std::isfinite(16 * frame.scale * (largest + maxNorm(frame.origin)))) {
      refuse(call,
             "coordinates overflow; bring the fibers nearer to the origin or change their unit");
    }
    return frame;
  }

  FiberTreeOptions options_;
  tree::NeighborRule neighbors_;
  std::vector<std::size_t> point_begin_ = {0};
  std::vector<bool> is_last_;    ///< by point: whether it is the last one of its fiber
  std::vector<bool> is_closed_;  ///< by fiber; empty if none is, or nothing is ignored
  std::vector<double> arc_end_;  ///< by point, see areNeighbors(); empty unless arc lengths matter
  std::vector<tree::Group> groups_;  ///< by fiber; empty if none has one
  std::size_t segment_count_ = 0;
  tree::Scene scene_;
  bool is_whole_ = true;  ///< false after a build or an update that ended early
};

namespace {

/// Pairs of a tree, handed on in the public type.
template <class F>
class PairsTo : public tree::PairSink {
 public:
  PairsTo(bool ordered, F take) : ordered_(ordered), take_(std::move(take)) {}

  Visit take(const tree::Pair* pairs, std::size_t count) override {
    std::array<SegmentPair, 256> run;
    for (std::size_t begin = 0; begin < count; begin += run.size()) {
      const std::size_t size = std::min(run.size(), count - begin);
      for (std::size_t i = 0; i < size; ++i) {
        const auto [a, b] = pairs[begin + i];
        run[i] = ordered_ && a > b ? SegmentPair{b, a} : SegmentPair{a, b};
      }
      if (take_(run.data(), size)) return Visit::kStop;
    }
    return Visit::kContinue;
  }

 private:
  bool ordered_;
  F take_;
};

}  // namespace

FiberTree::FiberTree(const FiberTreeOptions& options) : impl_(std::make_unique<Impl>(options)) {}
FiberTree::~FiberTree() = default;
FiberTree::FiberTree(FiberTree&&) noexcept = default;
FiberTree& FiberTree::operator=(FiberTree&&) noexcept = default;

void FiberTree::build(const FiberArrays<float>& fibers) { impl_->build(fibers); }
void FiberTree::build(const FiberArrays<double>& fibers) { impl_->build(fibers); }
void FiberTree::update(const FiberArrays<float>& fibers) { impl_->update(fibers); }
void FiberTree::update(const FiberArrays<double>& fibers) { impl_->update(fibers); }

bool FiberTree::visitRuns(Runs& runs) const {
  PairsTo sink(
      true, [&](const SegmentPair* pairs, std::size_t count) { return runs.take(pairs, count); });
  return impl_->findPairs(sink) == Visit::kStop;
}

bool FiberTree::visitRuns(const FiberTree& other, Runs& runs) const {
  if (&other == this) return visitRuns(runs);
  PairsTo sink(
      false, [&](const SegmentPair* pairs, std::size_t count) { return runs.take(pairs, count); });
  return impl_->findPairs(*other.impl_, sink) == Visit::kStop;
}

void FiberTree::findPairs(std::vector<SegmentPair>& pairs) const {
  pairs.clear();
  PairsTo sink(true, [&](const SegmentPair* run, std::size_t count) {
    pairs.insert(pairs.end(), run, run + count);
    return false;
  });
  impl_->findPairs(sink);
}

std::vector<TreeVolume> FiberTree::volumes(int depth) const { return impl_->volumes(depth); }
FiberSegment FiberTree::fiberSegment(std::int32_t segment) const {
  return impl_->fiberSegment(segment);
}
std::size_t FiberTree::fiberCount() const { return impl_->fiberCount(); }
std::size_t FiberTree::segmentCount() const { return impl_->segmentCount(); }
const FiberTreeOptions& FiberTree::options() const { return impl_->options(); }
std::size_t FiberTree::memoryUsage() const { return impl_->memoryUsage(); }

}  // namespace fcl_fibers
