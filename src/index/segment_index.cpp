// SPDX-License-Identifier: BSD-3-Clause
#include "index/segment_index.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <type_traits>
#include <utility>

#include "tree/bundle.h"
#include "tree/extent.h"
#include "tree/volumes.h"

namespace fcl_fibers::index {
namespace {

using geometry::Frame;
using geometry::Segment;

/// The number of segments that a task reads. It takes some hundredths of a millisecond.
constexpr std::size_t kRange = 4096;
using Ids = std::array<SegmentId, kRange>;

/// A build costs about as much as five updates. Nodes 1.5 times as long overlap three times as many
/// others.
constexpr double kLoose = 1.5;

/// The tree of so few segments is as good as a new one, however they have moved: most of its nodes
/// are compared in any case.
constexpr std::size_t kFew = 64;

/// A frame is kept until the middle of the segments has moved by this share of their spread.
constexpr double kDrift = 0.25;

/// To find the extent takes as long as to read tens of segments. So it is looked at only after so
/// many have been read, unless their reach is this many times as large or small as it was, or as
/// large as their size: then all have left the origin, as where what was far out has returned.
constexpr std::size_t kUnseen = 512;
constexpr double kReach = 8;

}  // namespace

SegmentIndex::SegmentIndex(const IndexOptions& options)
    : options_(options),
      executor_(parallel::makeExecutor(options.threads)),
      blocks_(std::make_unique<BlockPool>()),
      now_{{}, KeptSegments(options.share_ends), {}} {}

void SegmentIndex::copy(const SegmentIndex& other) {
  endStep();
  now_ = other.fitted();
  fit_->is_due = false;
  ++build_count_;
  begin_ = other.begin_;
  end_ = other.end_;
  looseness_when_built_ = other.looseness_when_built_;
  in_new_frame_ = other.in_new_frame_;
  reach_in_new_frame_ = other.reach_in_new_frame_;
  unseen_ = other.unseen_;
  sampled_in_new_frame_ = other.sampled_in_new_frame_;
  frame_lasts_ = other.frame_lasts_;
  fitted_ = other.fitted_;
  unit_ = other.unit_;
  limitBlocks();
}

void SegmentIndex::clear() {
  endStep();
  frame_lasts_ = false;
  begin_ = end_ = 0;
  now_ = {{}, KeptSegments(options_.share_ends), {}};
  fit_->is_due = false;
  ++build_count_;
  blocks_->clear();
}

// --- Building ---

void SegmentIndex::build(const SegmentSource& source, const Frame& frame, SegmentId begin,
                         SegmentId end, const tree::Fibers& fibers) {
  if (!tryBuild(source, frame, begin, end, fibers, /*in_range=*/false)) {
    refuseLeast(source, fibers.ids, frame);
  }
}

bool SegmentIndex::tryBuild(const SegmentSource& source, const Frame& frame, SegmentId begin,
                            SegmentId end, const tree::Fibers& fibers) {
  return tryBuild(source, frame, begin, end, fibers, /*in_range=*/true);
}

/// Returns false if some segment cannot be read, or if `in_range` is set and some segment is not in
/// float's range.
bool SegmentIndex::tryBuild(const SegmentSource& source, const Frame& frame, SegmentId begin,
                            SegmentId end, const tree::Fibers& fibers, bool in_range) {
  keepStarts();
  ++build_count_;
  fit_->is_due = false;
  is_loose_ = false;
  begin_ = begin;
  end_ = end;
  now_.frame = frame;
  now_.reach = -1;
  Tree last = std::exchange(now_.tree, Tree());
  // A source that is slow to read is read once, into segments that are freed after the build.
  const bool stores = keepsSegments() || source.isFasterInOrder();
  if (stores) now_.segments.reset(begin, end, fibers.ids, executor_.get());
  Middles middles(options_.super_thread ? 0 : fibers.ids.size());
  std::atomic<bool> fits{true};
  const bool is_read = readRanges(
      source, frame, fibers.ids.size(),
      [&](std::size_t from, std::size_t to, Ids& ids) {
        // Its memory serves the next one. To give it back takes a thread as long as many tasks.
        if (from == 0) last = Tree();
        std::copy_n(fibers.ids.begin() + static_cast<std::ptrdiff_t>(from), to - from, ids.begin());
        return to - from;
      },
      [&](const SegmentId* ids, int count, BlockMask /*present*/, const SegmentBlock& block,
          std::size_t first) {
        if (!middles.empty()) tree::middlesOf(block, count, &middles[first]);
        if (!in_range && !stores) return;
        for (int i = 0; i < count; ++i) {
          const Segment segment = block[i];
          if (in_range && !isInFloatRange(segment)) fits.store(false, std::memory_order_relaxed);
          if (stores) now_.segments.set(ids[i], block, i);
        }
      });
  if (!is_read || !fits) return false;
  makeTree(fibers, std::move(middles));
  if (stores) {
    fitFromSegments(now_, padding());
  } else if (!fitFrom(now_, source)) {
    return false;
  }
  if (keepsSegments()) {
    unit_ = now_.segments.usualUnit();
  } else {
    now_.segments.clear();
  }
  if (source.isFasterInOrder()) {
    std::visit([this](auto& tree) { tree.findPlaces(executor_.get()); }, now_.tree);
  }
  useNewFrame();
  looseness_when_built_ = looseness();
  bringStart(source);
  limitBlocks();
  return true;
}

/// Calls take(ids, count, present, block, position of the first) with blocks of the ids that
/// idsOf(from, to, ids) writes for ranges of [0, count), and counts. Returns false if some cannot
/// be read.
template <class IdsOf, class Take>
bool SegmentIndex::readRanges(const SegmentSource& source, const Frame& frame, std::size_t count,
                              IdsOf&& idsOf, Take&& take) {
  std::atomic<bool> is_read{true};
  parallel::forRanges(executor_.get(), count, kRange, [&](std::size_t begin, std::size_t end) {
    Ids ids;
    SegmentBlock block;
    for (std::size_t from = begin; from < end; from += kRange) {
      const std::size_t found = idsOf(from, std::min(from + kRange, end), ids);
      for (std::size_t i = 0; i < found; i += SegmentBlock::kCapacity) {
        const auto size =
            static_cast<int>(std::min<std::size_t>(SegmentBlock::kCapacity, found - i));
        const auto ahead = static_cast<int>(std::min<std::size_t>(
            SegmentBlock::kCapacity, found - i - static_cast<std::size_t>(size)));
        BlockMask present = 0;
        if (!source.read(&ids[i], size, ahead, frame, block, present)) {
          is_read.store(false, std::memory_order_relaxed);
          return;
        }
        take(&ids[i], size, present, block, from + i);
      }
    }
  });
  return is_read;
}

/// Makes the tree of these fibers, without volumes.
void SegmentIndex::makeTree(const tree::Fibers& fibers, Middles middles) {
  if (options_.super_thread) {
    if (options_.wrapped_spheres) {
      now_.tree = tree::WrappedSphereTree<2>(superThread(fibers));
    } else {
      now_.tree = tree::LayeredBoxTree<2>(superThread(fibers));
    }
    return;
  }
  parallel::Executor* const executor = executor_.get();
  tree::TopologyParts<8> parts = tree::bundleInParts(fibers, middles.data(), executor);
  middles = Middles();  // a build needs most memory when it makes the nodes
  if (options_.wrapped_spheres) {
    now_.tree = tree::WrappedSphereTree<8>(std::move(parts), fibers, executor);
  } else {
    now_.tree = tree::LayeredBoxTree<8>(std::move(parts), fibers, executor);
  }
}

// --- Refitting ---

bool SegmentIndex::refit(const SegmentSource& source) {
  if (frame_lasts_ && tryRefit(source, frame())) {
    unseen_ += leaves().size();
    const double reach = reachOf(now_), then = reach_in_new_frame_;
    const bool is_near =
        std::visit([](const auto& tree) { return tree::isNearOrigin(tree, kReach); }, now_.tree);
    if (unseen_ < kUnseen && is_near && reach <= kReach * then && then <= kReach * reach) {
      return true;
    }
    unseen_ = 0;
    const tree::Extent now = extent();
    // A frame that is no longer good is used once more, so that no update refits twice, unless it
    // is far too bad.
    frame_lasts_ = staysWithin(in_new_frame_, now, kDrift);
    if (frame_lasts_ || staysWithin(in_new_frame_, now, 16)) return !hasDecayed(kLoose);
  }
  const bool is_good = refit(source, betterFrame(source));
  useNewFrame();
  return is_good;
}

Frame SegmentIndex::betterFrame(const SegmentSource& source) const {
  const Frame frame = frameFor(source, leaves());
  return source.staysFiniteIn(frame) ? frame : now_.frame;
}

bool SegmentIndex::refit(const SegmentSource& source, const Frame& frame) {
  if (!tryRefit(source, frame)) refuseLeast(source, leaves(), frame);
  frame_lasts_ = false;  // who gives one frame gives the next one, too
  return !hasDecayed(kLoose);
}

void SegmentIndex::useNewFrame() {
  in_new_frame_ = extent();
  reach_in_new_frame_ = reachOf(now_);
  unseen_ = 0;
  if (keepsSegments()) sampled_in_new_frame_ = sampledExtent(in_new_frame_.reach);
  // If the extent is not known, each refit chooses a frame.
  frame_lasts_ = in_new_frame_.is_finite;
}

/// The extent by a sample of segments, which needs no volumes.
/// @param reach  bounds the coordinates of all
tree::Extent SegmentIndex::sampledExtent(double reach) const {
  tree::ExtentSample sample;
  const tree::SegmentIds& ids = leaves();
  const std::size_t every = ids.size() / tree::ExtentSample::kMost + 1;
  for (std::size_t i = 0; i < ids.size(); i += every) {
    sample.add(midpoint(now_.segments[ids[i]]), reach);
  }
  return sample.extent();
}

double SegmentIndex::usualReach() const {
  constexpr std::size_t kMost = 255;
  constexpr double kSmall = 0x1p-6;
  std::vector<double> radii, sizes;
  const tree::SegmentIds& ids = leaves();
  for (std::size_t i = 0; i < ids.size(); i += ids.size() / kMost + 1) {
    const Segment segment = now_.segments[ids[i]];
    const double size = maxNorm(segment.b - segment.a);
    radii.push_back(segment.thickness());
    sizes.push_back(std::isfinite(size) ? size : 0);
  }
  const auto medianOf = [](std::vector<double>& numbers) {
    if (numbers.empty()) return 0.0;
    const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
    std::nth_element(numbers.begin(), middle, numbers.end());
    return *middle;
  };
  const double reach = 2 * medianOf(radii) + margin();
  if (reach > 0 && std::isfinite(reach)) return reach;
  const double size = medianOf(sizes);
  return size > 0 ? kSmall * size : kSmall;
}

tree::Extent SegmentIndex::extent() const {
  return std::visit([](const auto& tree) { return extentOf(tree); }, now_.tree);
}

bool SegmentIndex::tryRefit(const SegmentSource& source, const Frame& frame) {
  fitted_ = 0;
  leaveStart(nullptr);
  if (!read(now_, source, frame)) return false;
  if (keepsSegments()) unit_ = now_.segments.usualUnit();
  bringStart(source);
  return true;
}

bool SegmentIndex::reread(const SegmentSource& source) {
  if (!frame_lasts_ || is_loose_ || step_ != Step::kNone) return false;
  now_.segments.forgetKinds();
  const double reach = readKept(now_.segments, source, now_.frame);
  if (reach < 0 || !staysWithin(sampled_in_new_frame_, sampledExtent(reach), kDrift)) {
    unseen_ = kUnseen;  // so that the refit looks at the extent, too
    return false;
  }
  now_.reach = reach;
  unit_ = now_.segments.usualUnit();
  fit_->is_due.store(true, std::memory_order_release);
  return true;
}

/// Reads all segments. Returns a bound of their coordinates, or a negative number if some
/// cannot be read.
double SegmentIndex::readKept(KeptSegments& segments, const SegmentSource& source,
                              const Frame& frame) {
  std::atomic<double> reach{0};
  const auto add = [&](double largest) {
    double before = reach.load(std::memory_order_relaxed);
    while (before < largest && !reach.compare_exchange_weak(before, largest)) {
    }
  };
  if (segments.sharesEnds()) {
    std::atomic<bool> can_read{true};
    parallel::forRanges(executor_.get(), static_cast<std::size_t>(end_ - begin_), kRange,
                        [&](std::size_t from, std::size_t to) {
                          bool are_tapered = false;
                          const double largest =
                              source.readEnds(begin_ + static_cast<SegmentId>(from),
                                              begin_ + static_cast<SegmentId>(to), frame,
                                              segments.ends() + from, are_tapered);
                          if (are_tapered) segments.setMayTaper();
                          if (largest < 0) can_read.store(false, std::memory_order_relaxed);
                          add(largest);
                        });
    if (can_read) return reach;
  }
  const auto store = [&](const SegmentId* ids, int count, BlockMask present,
                         const SegmentBlock& block) {
    segments.set(ids, count, present, block);
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < count; ++i) {
        largest = std::max({largest, std::fabs(block.a[axis][i]), std::fabs(block.b[axis][i])});
      }
    }
    add(largest);
  };
  return readInOrder(segments, source, frame, store) ? reach.load() : -1;
}

void SegmentIndex::fitBeyond(double beyond) {
  now_.reach = reachOf(now_);
  fit_->is_due.store(true, std::memory_order_release);
  fitFromSegments(now_, padding() + beyond / 2 * frame().scale);
  is_loose_ = is_loose_ || hasDecayed(kLoose);
}

const SegmentIndex::End& SegmentIndex::fittedNow() const {
  const std::lock_guard<std::mutex> lock(fit_->mutex);
  if (fit_->is_due.load(std::memory_order_relaxed)) {
    fitFromSegments(now_, padding());
    is_loose_ = is_loose_ || hasDecayed(kLoose);
    fit_->is_due.store(false, std::memory_order_release);
  }
  return now_;
}

/// Reads all segments and fits their volumes. Returns whether all could be read.
bool SegmentIndex::read(End& end, const SegmentSource& source, const Frame& frame) {
  end.frame = frame;
  end.reach = -1;
  if (&end == &now_) fit_->is_due = is_loose_ = false;
  end.segments.forgetKinds();
  if (source.isFasterInOrder()) return placeFrom(end, source);
  if (!keepsSegments()) return fitFrom(end, source);
  if (readKept(end.segments, source, frame) < 0) return false;
  fitFromSegments(end, padding());
  return true;
}

/// Reads all segments in the order of ids and calls take(ids, count, present, block).
template <class Take>
bool SegmentIndex::readInOrder(const KeptSegments& segments, const SegmentSource& source,
                               const Frame& frame, Take&& take) {
  return readRanges(
      source, frame, static_cast<std::size_t>(end_ - begin_),
      [&](std::size_t from, std::size_t to, Ids& ids) {
        const auto first = begin_ + static_cast<SegmentId>(from);
        const auto last = begin_ + static_cast<SegmentId>(to);
        const bool all_are_segments = !(options_.share_ends && keepsSegments());
        std::size_t found = 0;
        for (SegmentId id = first; id < last; ++id) {
          ids[found] = id;
          found += all_are_segments || segments.isSegment(id) ? 1 : 0;
        }
        return found;
      },
      [&](const SegmentId* ids, int count, BlockMask present, const SegmentBlock& block,
          std::size_t /*first*/) { take(ids, count, present, block); });
}

/// Fits the volumes in the order of the tree, to segments that read(ids, count, ahead, block)
/// reads.
template <class Read>
void SegmentIndex::fit(End& end, double padding, const Read& read) const {
  std::visit(
      [&](auto& tree) {
        tree.startRefit(padding);
        std::atomic<bool> changed{false};
        forChunks(tree.chunkCount(), [&](std::size_t chunk) {
          if (tree.fitChunk(chunk, read)) changed.store(true, std::memory_order_relaxed);
        });
        tree.fitAboveChunks(changed, read, executor_.get());
      },
      end.tree);
}

bool SegmentIndex::fitFrom(End& end, const SegmentSource& source) {
  std::atomic<bool> is_read{true};
  fit(end, padding(), [&](const SegmentId* ids, int count, int ahead, SegmentBlock& block) {
    BlockMask present = 0;
    if (source.read(ids, count, ahead, end.frame, block, present)) return present;
    is_read.store(false, std::memory_order_relaxed);
    return BlockMask{0};
  });
  return is_read;
}

void SegmentIndex::fitFromSegments(End& end, double padding) const {
  const SegmentRange segments = end.segments.range();
  fit(end, padding, [&](const SegmentId* ids, int count, int ahead, SegmentBlock& block) {
    for (int i = count; i < count + ahead; ++i) segments.prefetch(ids[i]);
    for (int i = 0; i < count; ++i) block.set(i, segments[ids[i]]);
    return geometry::firstOfBlock(count);
  });
}

/// Fits the leaves in the order of ids.
bool SegmentIndex::placeFrom(End& end, const SegmentSource& source) {
  return std::visit(
      [&](auto& tree) {
        tree.findPlaces(executor_.get());
        tree.startRefit(padding());
        if (tree.empty()) return true;
        std::atomic<bool> changed{false};
        const auto place = [&](const SegmentId* ids, int count, BlockMask present,
                               const SegmentBlock& block) {
          if (keepsSegments()) end.segments.set(ids, count, present, block);
          if (tree.placeLeaves(ids, count, present, block)) {
            changed.store(true, std::memory_order_relaxed);
          }
        };
        if (!readInOrder(end.segments, source, end.frame, place)) return false;
        if (!changed) return true;
        forChunks(tree.chunkCount(), [&](std::size_t chunk) { tree.fitChunkAbove(chunk); });
        tree.fitAboveChunks(executor_.get());
        return true;
      },
      end.tree);
}

template <class F>
void SegmentIndex::forChunks(std::size_t count, F&& visit) const {
  constexpr std::size_t kGrain = 8;
  parallel::forRanges(executor_.get(), count, kGrain, [&](std::size_t from, std::size_t to) {
    for (std::size_t chunk = from; chunk < to; ++chunk) visit(chunk);
  });
}

bool SegmentIndex::refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved) {
  fitted();
  now_.reach = -1;
  leaveStart(&ids);
  if (keepsSegments()) {
    for (std::size_t i = 0; i < ids.size(); ++i) now_.segments.set(ids[i], moved[i]);
  }
  fitted_ += std::visit([&](auto& tree) { return tree.refitSome(ids, moved); }, now_.tree);
  // A few fibers that have changed places make all nodes above them as large as the scene. So the
  // looseness is checked before many segments have moved. At worst a build costs three microseconds
  // for each leaf that has moved.
  constexpr std::size_t kPart = 24, kFew = 16;
  if (fitted_ < std::max(static_cast<std::size_t>(end_ - begin_) / kPart, kFew)) return true;
  fitted_ = 0;
  return !hasDecayed(/*loose=*/1.15);
}

bool SegmentIndex::isFitted(const SegmentSource& source) const {
  bool is_fitted = true;
  const auto holds = [&](SegmentId id, auto&& volume_holds) {
    if (!is_fitted) return;
    SegmentBlock block;
    BlockMask present = 0;
    const bool is_read = source.read(&id, 1, 0, frame(), block, present);
    if (is_read && present == 0) return;
    is_fitted = is_fitted && is_read &&
                (keepsSegments() ? now_.segments[id] == block[0] : volume_holds(block[0]));
  };
  std::visit([&](const auto& tree) { tree.forEachLeaf(holds); }, fitted().tree);
  return is_fitted;
}

const tree::SegmentIds& SegmentIndex::leaves() const {
  return std::visit([](const auto& tree) -> const tree::SegmentIds& { return tree.leaves(); },
                    now_.tree);
}

double SegmentIndex::looseness() const {
  return std::visit([](const auto& tree) { return tree::looseness(tree); }, now_.tree);
}

bool SegmentIndex::hasDecayed(double loose) const {
  return !options_.super_thread && leaves().size() > kFew &&
         looseness() > loose * looseness_when_built_;
}

/// One dense query must not make the index keep much more memory for good.
void SegmentIndex::limitBlocks() {
  blocks_->keepAtMost((memoryUsage() - blocks_->memoryUsage()) / 4);
}

SegmentIndex::Cages SegmentIndex::cages() const {
  return std::visit(
      [](const auto& tree) -> Cages {
        if constexpr (std::is_same_v<decltype(tree.nodeVolume(0)), geometry::Sphere>) {
          return {tree.nodes().size(), tree.hierarchy().cagesRecomputed()};
        }
        return {};
      },
      now_.tree);
}

std::size_t SegmentIndex::memoryUsage() const {
  const auto bytesOf = [](const End& end) {
    return end.segments.memoryUsage() +
           std::visit([](const auto& tree) { return tree.memoryUsage(); }, end.tree);
  };
  return blocks_->memoryUsage() + bytesOf(now_) + moved_.capacity() * sizeof(SegmentId) +
         (start_ ? sizeof(End) + bytesOf(*start_) : 0);
}

}  // namespace fcl_fibers::index
