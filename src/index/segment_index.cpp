// SPDX-License-Identifier: BSD-3-Clause
#include "index/segment_index.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "index/nearest_filter.h"

namespace fcl_fibers::index {
namespace {

using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using tree::Group;
using tree::TraversalTask;
using tree::Visit;

/// The number of segments that a task reads, in about a tenth of a millisecond.
constexpr std::size_t kRange = 4096;
static_assert(kRange % SegmentSource::kBlock == 0);
/// A leaf's slot may be anywhere in memory. It is prefetched this many segments ahead.
constexpr SegmentId kPrefetchAhead = 8;

template <class Trees>
class TreeSearch final : public PairSearch {
 public:
  explicit TreeSearch(const Trees& trees) : trees_(trees), kernels_(tree::pairKernels(trees)) {}
  Visit split(tree::TaskSink& out) const override { return kernels_.splitIntoTasks(trees_, out); }
  Visit run(const TraversalTask& task, tree::PairBuffer& out) const override {
    return kernels_.overlaps(trees_, task, out);
  }

 private:
  const Trees& trees_;
  const tree::PairKernels<Trees>& kernels_;
};

/// A segment whose coordinates have overflowed in this frame may be anywhere.
template <class Volume>
Volume volumeAround(const Segment& segment, double padding) {
  const bool is_somewhere = segment.isBox() || isBounded(segment);
  return is_somewhere ? Volume::around(segment, padding) : Volume::unbounded();
}

/// As FrameChange, where a box that overflows becomes open to all sides.
Segment inFrame(const FrameChange& change, const Segment& segment) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Segment result = change(segment);
  if (!segment.isBox() || isBounded(result) || !isBounded(segment)) return result;
  return Segment::box({-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity});
}

}  // namespace

SegmentIndex::SegmentIndex(const IndexOptions& options)
    : options_(options),
      executor_(parallel::makeExecutor(options.threads)),
      scratch_(std::make_unique<ScratchPool>()) {}

void SegmentIndex::copy(const SegmentIndex& other) {
  frame_ = other.frame_;
  begin_ = other.begin_;
  end_ = other.end_;
  segments_ = other.segments_;
  tree_ = other.tree_;
  looseness_when_built_ = other.looseness_when_built_;
  fitted_ = other.fitted_;
  unit_ = other.unit_;
}

void SegmentIndex::clear() {
  frame_ = {};
  begin_ = end_ = 0;
  segments_ = std::vector<Segment>();
  tree_ = Tree();
  scratch_->clear();
}

/// Reads all segments, into segments_ unless it is empty, and calls fit(id, segment) for each. If
/// some cannot be read, the source throws for the one with the least id.
template <class Fit>
SegmentId SegmentIndex::readAll(const SegmentSource& source, Fit&& fit) {
  std::atomic<SegmentId> bad{end_};
  const auto range = [&](std::size_t from, std::size_t to) {
    const auto last = begin_ + static_cast<SegmentId>(to);
    Segment not_kept[SegmentSource::kBlock];
    for (auto begin = begin_ + static_cast<SegmentId>(from); begin < last;
         begin += SegmentSource::kBlock) {
      const SegmentId end = std::min(begin + SegmentSource::kBlock, last);
      Segment* const block =
          segments_.empty() ? not_kept : &segments_[static_cast<std::size_t>(begin - begin_)];
      std::uint64_t present = 0;
      const SegmentId read = source.read(begin, end, frame_, block, present);
      if (read != end) {
        SegmentId least = bad.load(std::memory_order_relaxed);
        while (read < least && !bad.compare_exchange_weak(least, read)) {
        }
        return;
      }
      for (SegmentId id = begin; id < end; ++id) {
        if (present >> (id - begin) & 1u) fit(id, block[id - begin]);
      }
    }
  };
  parallel::forRanges(executor_.get(), static_cast<std::size_t>(end_ - begin_), kRange, range);
  return bad;
}

void SegmentIndex::build(const SegmentSource& source, const Frame& frame, SegmentId begin,
                         SegmentId end, const tree::Fibers& fibers) {
  const SegmentId read = readToBuild(source, frame, begin, end);
  if (read != end) source.refuse(read, frame);
  buildTree(fibers);
}

bool SegmentIndex::tryBuild(const SegmentSource& source, const Frame& frame, SegmentId begin,
                            SegmentId end, const tree::Fibers& fibers) {
  if (readToBuild(source, frame, begin, end) != end) return false;
  const auto fits = [this](SegmentId id) { return isInFloatRange(segments()[id]); };
  if (!std::all_of(fibers.ids.begin(), fibers.ids.end(), fits)) return false;
  buildTree(fibers);
  return true;
}

SegmentId SegmentIndex::readToBuild(const SegmentSource& source, const Frame& frame,
                                    SegmentId begin, SegmentId end) {
  frame_ = frame;
  begin_ = begin;
  end_ = end;
  segments_.resize(static_cast<std::size_t>(end - begin));
  return readAll(source, [](SegmentId, const Segment&) {});
}

void SegmentIndex::buildTree(const tree::Fibers& fibers) {
  const auto make_tree = [&](auto topology) {
    constexpr int kArity = decltype(topology)::kArity;
    if (options_.wrapped_spheres) {
      tree_ = tree::WrappedSphereTree<kArity>(std::move(topology));
    } else {
      tree_ = tree::LayeredBoxTree<kArity>(std::move(topology));
    }
  };
  if (options_.super_thread) {
    make_tree(superThread(fibers));
  } else {
    make_tree(bundle(fibers, segments()));
  }
  std::visit(
      [&](auto& tree) {
        tree.startRefit(padding());
        parallel::forRanges(executor_.get(), segments_.size(), kRange,
                            [&](std::size_t from, std::size_t to) {
                              for (std::size_t i = from; i < to; ++i) {
                                const SegmentId id = begin_ + static_cast<SegmentId>(i);
                                tree.prefetchLeaf(id + kPrefetchAhead);
                                tree.fitLeaf(id, segments_[i]);
                              }
                            });
        tree.fitNodes();
        looseness_when_built_ = tree.looseness();
      },
      tree_);
  fitted_ = 0;
  if (keepsSegments()) {
    unit_ = usualUnit(segments_);
  } else {
    segments_ = std::vector<Segment>();
  }
}

bool SegmentIndex::refit(const SegmentSource& source, const Frame& frame) {
  frame_ = frame;
  std::visit(
      [&](auto& tree) {
        tree.startRefit(padding());
        std::atomic<bool> changed{false};
        const SegmentId read = readAll(source, [&](SegmentId id, const Segment& segment) {
          tree.prefetchLeaf(id + kPrefetchAhead);
          if (tree.fitLeaf(id, segment)) changed.store(true, std::memory_order_relaxed);
        });
        if (read != end_) source.refuse(read, frame_);
        tree.fitNodes(changed);
      },
      tree_);
  if (keepsSegments()) unit_ = usualUnit(segments_);
  fitted_ = 0;
  return !hasDecayed();
}

bool SegmentIndex::refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved) {
  std::visit(
      [&](auto& tree) {
        std::vector<SegmentId> changed;
        for (std::size_t i = 0; i < ids.size(); ++i) {
          if (keepsSegments()) segments_[static_cast<std::size_t>(ids[i] - begin_)] = moved[i];
          if (tree.fitLeaf(ids[i], moved[i])) changed.push_back(ids[i]);
        }
        tree.fitNodesAbove(changed);
        fitted_ += changed.size();
      },
      tree_);
  // Checks the looseness once per as many fitted leaves as a whole refit has.
  if (fitted_ < static_cast<std::size_t>(end_ - begin_)) return true;
  fitted_ = 0;
  return !hasDecayed();
}

bool SegmentIndex::isFitted(SegmentId id, const Segment& segment) const {
  if (keepsSegments()) return segments()[id] == segment;
  return std::visit([&](const auto& tree) { return tree.isFitted(id, segment); }, tree_);
}

const std::vector<SegmentId>& SegmentIndex::leaves() const {
  return std::visit(
      [](const auto& tree) -> const std::vector<SegmentId>& { return tree.topology().leaves; },
      tree_);
}

/// A build costs about as much as five updates. Nodes 1.5 times as long overlap three times as many
/// others.
bool SegmentIndex::hasDecayed() const {
  constexpr double kLoose = 1.5;
  return !options_.super_thread && std::visit([](const auto& tree) { return tree.looseness(); },
                                              tree_) > kLoose * looseness_when_built_;
}

std::vector<Segment> SegmentIndex::readSegments(const SegmentSource& source) const {
  std::vector<Segment> segments(static_cast<std::size_t>(end_ - begin_));
  for (SegmentId id = begin_; id < end_; ++id) {
    readOne(source, id, frame_, segments[static_cast<std::size_t>(id - begin_)]);
  }
  return segments;
}

// --- Searches ---

Visit SegmentIndex::search(PairSink& sink) const {
  const CapsuleFilter filter(segments(), segments(), nullptr, margin(), unit_);
  return std::visit(
      [&](const auto& tree) {
        return findPairs(TreeSearch(tree), options_.capsules ? &filter : nullptr, executor_.get(),
                         *scratch_, sink);
      },
      tree_);
}

Visit SegmentIndex::search(NearestSink& sink) const {
  NearestFilter filter(
      segments(),
      [this](SegmentId b, double& error) -> const Segment& {
        error = endPointError(segments()[b]);
        return segments()[b];
      },
      sink);
  return std::visit(
      [&](const auto& tree) {
        return tree::pairKernels(tree).nearest(tree, sink.limit(),
                                               filterOrSink(options_.capsules, filter, sink));
      },
      tree_);
}

Visit SegmentIndex::search(const Segment& segment, double error, Group group, SegmentId second,
                           PairSink& sink) const {
  const CapsuleFilter filter(segments(), {&segment, second}, nullptr, margin(), unit_, error);
  SerialBuffer buffer(options_.capsules ? &filter : nullptr, sink);
  return std::visit(
      [&](const auto& tree) {
        using ATree = std::decay_t<decltype(tree)>;
        const auto volume = volumeAround<typename ATree::Volume>(segment, tree.padding() + error);
        return tree::kernels<ATree>().overlapsVolume(tree, volume, second, group, buffer) ==
                       Visit::kStop
                   ? Visit::kStop
                   : buffer.full();
      },
      tree_);
}

Visit SegmentIndex::search(const Segment& segment, double error, Group group, SegmentId second,
                           NearestSink& sink) const {
  NearestFilter filter(
      segments(),
      [&](SegmentId, double& q_error) -> const Segment& {
        q_error = error;
        return segment;
      },
      sink);
  return std::visit(
      [&](const auto& tree) {
        using ATree = std::decay_t<decltype(tree)>;
        const auto volume = volumeAround<typename ATree::Volume>(segment, tree.padding() + error);
        return tree::kernels<ATree>().nearestVolume(tree, volume, second, group, sink.limit(),
                                                    filterOrSink(options_.capsules, filter, sink));
      },
      tree_);
}

/// Calls visit(trees) with both trees, if they have one type, and the changes of frame between
/// them.
template <class F>
Visit SegmentIndex::visitTrees(const SegmentIndex& other, F&& visit) const {
  return std::visit(
      [&](const auto& tree, const auto& other_tree) {
        using ATree = std::decay_t<decltype(tree)>;
        if constexpr (std::is_same_v<decltype(tree), decltype(other_tree)>) {
          // Each tree is padded by half its own margin. The sum must be this index's margin.
          const double growth = (options_.margin - other.options_.margin) / 2;
          const FrameChange b_to_a(other.frame_, frame_, growth * frame_.scale);
          const FrameChange a_to_b(frame_, other.frame_, growth * other.frame_.scale);
          return visit(tree::TreePair<ATree>{tree, other_tree, b_to_a, a_to_b});
        } else {
          return Visit::kContinue;  // one of the two has never been built
        }
      },
      tree_, other.tree_);
}

Visit SegmentIndex::search(const SegmentIndex& other, const SegmentSource* source,
                           PairSink& sink) const {
  if (!matches(other)) return searchOneByOne(other, source, sink);
  std::vector<Segment> read;
  SegmentRange second = other.segments();
  if (options_.capsules && !other.keepsSegments()) {
    read = other.readSegments(*source);
    second.segments = read.data();
  }
  return visitTrees(other, [&](const auto& two) {
    const CapsuleFilter filter(segments(), second, &two.b_to_a, margin(), unit_);
    return findPairs(TreeSearch(two), options_.capsules ? &filter : nullptr, executor_.get(),
                     *scratch_, sink);
  });
}

Visit SegmentIndex::search(const SegmentIndex& other, const SegmentSource* source,
                           NearestSink& sink) const {
  if (!matches(other)) return searchOneByOne(other, source, sink);
  const FrameChange to_this(other.frame_, frame_);
  Segment q;
  NearestFilter filter(
      segments(),
      [&](SegmentId b, double& error) -> const Segment& {
        if (other.keepsSegments()) {
          q = other.segments()[b];
        } else {
          readOne(*source, b, other.frame_, q);
        }
        q = to_this(q);
        error = to_this.error(q);
        return q;
      },
      sink);
  return visitTrees(other, [&](const auto& two) {
    return tree::pairKernels(two).nearest(two, sink.limit(),
                                          filterOrSink(options_.capsules, filter, sink));
  });
}

template <class Sink>
Visit SegmentIndex::searchOneByOne(const SegmentIndex& other, const SegmentSource* source,
                                   Sink& sink) const {
  const FrameChange to_this(other.frame_, frame_);
  for (const SegmentId b : other.leaves()) {
    Segment segment;
    if (other.keepsSegments()) {
      segment = other.segments()[b];
    } else if (!readOne(*source, b, other.frame_, segment)) {
      continue;
    }
    segment = inFrame(to_this, segment);
    if (search(segment, to_this.error(segment), tree::kNoGroup, b, sink) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  return Visit::kContinue;
}

std::size_t SegmentIndex::memoryUsage() const {
  return scratch_->memoryUsage() + segments_.capacity() * sizeof(Segment) +
         std::visit([](const auto& tree) { return tree.memoryUsage(); }, tree_);
}

}  // namespace fcl_fibers::index
