// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>
#include <vector>

#include "geometry/frame.h"
#include "parallel/executor.h"
#include "tree/fiber_tree.h"
#include "tree/pair_search.h"
#include "tree/topology.h"

namespace fcl_fibers::tree {

struct SceneOptions {
  bool wrapped_spheres = false;  ///< else layered boxes
  bool super_thread = false;     ///< else bundles
  bool capsules = false;         ///< whether queries report capsules that touch; else volumes
  double margin = 0;             ///< in the world's unit
  int threads = 1;
};

/// What queries read: the segments of all fibers, and a tree over them, in a frame of their own.
/// Where they come from is the affair of a reader:
///
///   bool read(SegmentId id, Segment& segment)   in frame(); false if there is no such segment
///
/// It is called for all ids in any order, by several threads at once if there are several, and may
/// throw; the scene is then neither old nor new.
class Scene {
 public:
  using Segment = geometry::Segment;
  using Tree = std::variant<LayeredBoxTree<8>, LayeredBoxTree<2>, WrappedSphereTree<8>,
                            WrappedSphereTree<2>>;

  explicit Scene(const SceneOptions& options)
      : options_(options),
        executor_(parallel::makeExecutor(options.threads)),
        scratch_(std::make_unique<ScratchPool>()) {}

  const geometry::Frame& frame() const { return frame_; }
  const Tree& tree() const { return tree_; }

  /// In frame(), as all that follows.
  double margin() const { return options_.margin * frame_.scale; }

  /// Segments open to a side, which are in no tree; ids ascend.
  const std::vector<SegmentId>& unbounded() const { return unbounded_; }

  /// Whether segments are kept, and segment() may be asked: where the exact test needs them, or
  /// what is unbounded is to be tested against all.
  bool keepsSegments() const { return options_.capsules || !unbounded_.empty(); }
  const std::vector<Segment>& segments() const { return segments_; }
  const Segment& segment(SegmentId id) const { return segments_[static_cast<std::size_t>(id)]; }

  /// Becomes what the other one is; options and threads stay its own.
  /// @pre the options are the same
  void copy(const Scene& other) {
    frame_ = other.frame_;
    segments_ = other.segments_;
    unbounded_ = other.unbounded_;
    tree_ = other.tree_;
    looseness_when_built_ = other.looseness_when_built_;
    unit_ = other.unit_;
  }

  void clear() {
    segments_ = std::vector<Segment>();
    unbounded_.clear();
    tree_ = Tree();
    scratch_->clear();
    frame_ = {};
  }

  /// Reads all segments and builds the tree.
  /// @param frame   for the segments to come
  /// @param count   ids are 0, ..., count - 1
  /// @param fibers  fibers(admit) -> Fibers of the ids for which admit(id) holds
  template <class MakeFibers, class Read>
  void build(const geometry::Frame& frame, std::size_t count, MakeFibers&& fibers, Read&& read) {
    frame_ = frame;
    segments_.resize(count);
    findUnbounded(count, [&](SegmentId id, Segment& segment) {
      if (!read(id, segment)) return false;
      segments_[static_cast<std::size_t>(id)] = segment;
      return true;
    });
    const Fibers in_tree = fibers([&](SegmentId id) { return isBounded(segment(id)); });
    if (options_.super_thread) {
      makeTree<2>(superThread(in_tree));
    } else {
      makeTree<8>(bundle(in_tree, segments_));
    }
    std::visit(
        [&](auto& tree) {
          tree.startRefit(padding());
          parallel::forRanges(executor_.get(), count, kRange,
                              [&](std::size_t begin, std::size_t end) {
                                for (std::size_t i = begin; i < end; ++i) {
                                  const auto id = static_cast<SegmentId>(i);
                                  tree.prefetchLeaf(id + kPrefetchAhead);
                                  tree.fitLeaf(id, segments_[i]);
                                }
                              });
          tree.fitNodes();
          looseness_when_built_ = tree.looseness();
          fitted_ = 0;
        },
        tree_);
    finish(count);
  }

  /// Reads all segments again and fits the tree to them. If nothing has moved there is nothing to
  /// fit. Returns false if the scene has to be built: where other segments than before are
  /// unbounded; or, all being up to date, should be, as the fibers have moved so far apart that
  /// another bundle pays.
  template <class Read>
  bool update(const geometry::Frame& frame, std::size_t count, Read&& read) {
    frame_ = frame;
    const std::vector<SegmentId> unbounded_before = unbounded_;
    std::atomic<bool> changed{false};
    std::visit(
        [&](auto& tree) {
          tree.startRefit(padding());
          const bool keep = keepsSegments();
          findUnbounded(count, [&](SegmentId id, Segment& segment) {
            tree.prefetchLeaf(id + kPrefetchAhead);
            if (!read(id, segment)) return false;
            if (keep) segments_[static_cast<std::size_t>(id)] = segment;
            if (tree.fitLeaf(id, segment)) changed.store(true, std::memory_order_relaxed);
            return true;
          });
          if (unbounded_ == unbounded_before) tree.fitNodes(changed);
        },
        tree_);
    finish(count);
    fitted_ = 0;
    return unbounded_ == unbounded_before && !hasDecayed();
  }

  /// Reads these segments again, and fits the nodes above them. Returns as the above; whether
  /// another bundle pays it finds out now and then.
  template <class Read>
  bool updateSome(const std::vector<SegmentId>& ids, Read&& read) {
    return std::visit(
        [&](auto& tree) {
          std::vector<SegmentId> moved;
          for (const SegmentId id : ids) {
            Segment segment;
            read(id, segment);
            const bool was_unbounded = std::binary_search(unbounded_.begin(), unbounded_.end(), id);
            if (was_unbounded == isBounded(segment)) return false;
            if (keepsSegments()) segments_[static_cast<std::size_t>(id)] = segment;
            if (!was_unbounded && tree.fitLeaf(id, segment)) moved.push_back(id);
          }
          tree.fitNodesAbove(moved);
          // As often as the whole tree has been fitted.
          fitted_ += moved.size();
          if (fitted_ < tree.topology().leaves.size()) return true;
          fitted_ = 0;
          return !hasDecayed();
        },
        tree_);
  }

  /// Whether reading this segment again would change no answer.
  bool isFitted(SegmentId id, const Segment& segment) const {
    if (keepsSegments()) return this->segment(id) == segment;
    return std::visit([&](const auto& tree) { return tree.isFitted(id, segment); }, tree_);
  }

  // --- Queries of what is in the tree; `sink` gets pairs on this thread ---

  /// Pairs of this scene.
  Visit findPairs(PairSink& sink) const {
    const CapsuleFilter filter(segments_.data(), segments_.data(), nullptr, margin(), unit_);
    return std::visit(
        [&](const auto& tree) {
          return search<std::decay_t<decltype(tree)>>(tree, filterOrNone(filter), sink);
        },
        tree_);
  }

  /// Pairs with one segment in this scene's frame, except those of its group; b of each is 0.
  Visit findPairs(const Segment& segment, double error, Group group, PairSink& sink) const {
    return std::visit(
        [&](const auto& tree) {
          using Volume = typename std::decay_t<decltype(tree)>::Volume;
          const CapsuleFilter filter(segments_.data(), &segment, nullptr, margin(), unit_);
          return tree::findPairs(tree, Volume::around(segment, tree.padding() + error), 0, group,
                                 filterOrNone(filter), sink);
        },
        tree_);
  }

  /// Whether the trees of two scenes are of one kind, so that one can be searched with the other.
  bool matches(const Scene& other) const {
    return options_.wrapped_spheres == other.options_.wrapped_spheres &&
           options_.super_thread == other.options_.super_thread;
  }

  /// Pairs with another scene, whatever their groups.
  /// @param other_segments  by id, where this scene reports capsules
  /// @pre matches(other)
  Visit findPairs(const Scene& other, const Segment* other_segments, PairSink& sink) const {
    return visitTwo(other, [&](const auto& two, auto tree) {
      const CapsuleFilter filter(segments_.data(), other_segments, &two.b_to_a, margin(), unit_);
      return search<typename decltype(tree)::type>(two, filterOrNone(filter), sink);
    });
  }

  /// Pairs nearer than `limit`: the same three.
  Visit findNearest(double limit, NearestVisitor& visitor) const {
    return std::visit(
        [&](const auto& tree) {
          return Search<std::decay_t<decltype(tree)>>::nearest(tree, limit, visitor);
        },
        tree_);
  }
  Visit findNearest(const Segment& segment, double error, Group group, double limit,
                    NearestVisitor& visitor) const {
    return std::visit(
        [&](const auto& tree) {
          using ATree = std::decay_t<decltype(tree)>;
          return Search<ATree>::nearest(tree,
                                        ATree::Volume::around(segment, tree.padding() + error), 0,
                                        group, limit, visitor);
        },
        tree_);
  }
  Visit findNearest(const Scene& other, double limit, NearestVisitor& visitor) const {
    return visitTwo(other, [&](const auto& two, auto tree) {
      return Search<typename decltype(tree)::type>::nearest(two, limit, visitor);
    });
  }

  std::size_t memoryUsage() const {
    return scratch_->memoryUsage() + segments_.capacity() * sizeof(Segment) +
           unbounded_.capacity() * sizeof(SegmentId) +
           std::visit([](const auto& tree) { return tree.memoryUsage(); }, tree_);
  }

 private:
  template <class T>
  struct Type {
    using type = T;
  };
  /// Segments that a task reads: a tenth of a millisecond.
  static constexpr std::size_t kRange = 4096;
  /// Segments from prefetching where a leaf is kept, which may be anywhere, to fitting it.
  static constexpr SegmentId kPrefetchAhead = 8;

  double padding() const { return margin() / 2; }
  const CapsuleFilter* filterOrNone(const CapsuleFilter& filter) const {
    return options_.capsules ? &filter : nullptr;
  }

  template <int Arity>
  void makeTree(Topology<Arity> topology) {
    if (options_.wrapped_spheres) {
      tree_ = WrappedSphereTree<Arity>(std::move(topology));
    } else {
      tree_ = LayeredBoxTree<Arity>(std::move(topology));
    }
  }

  /// Calls read(id, segment) for all ids and collects those that are unbounded. Of several ids that
  /// throw, the lowest one's exception is thrown.
  template <class Read>
  void findUnbounded(std::size_t count, Read&& read) {
    unbounded_.clear();
    std::mutex mutex;
    const auto range = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto id = static_cast<SegmentId>(i);
        Segment segment;
        // Capsules that have been read are bounded.
        if (!read(id, segment) || !segment.isBox() || isBounded(segment)) continue;
        const std::lock_guard<std::mutex> lock(mutex);
        unbounded_.push_back(id);
      }
    };
    try {
      parallel::forRanges(executor_.get(), count, kRange, range);
    } catch (...) {
      if (executor_ == nullptr) throw;
      range(0, count);
      throw;
    }
    std::sort(unbounded_.begin(), unbounded_.end());
  }

  /// A build costs about as much as five updates; nodes half as long again overlap three times as
  /// many others.
  bool hasDecayed() const {
    constexpr double kLoose = 1.5;
    return !options_.super_thread && std::visit([](const auto& tree) { return tree.looseness(); },
                                                tree_) > kLoose * looseness_when_built_;
  }

  void finish(std::size_t count) {
    if (!keepsSegments()) {
      segments_ = std::vector<Segment>();
      return;
    }
    if (options_.capsules) unit_ = usualUnit(count);
  }

  /// A power of two that brings the median segment to a size of about one, from a sample.
  double usualUnit(std::size_t count) const {
    constexpr std::size_t kSamples = 255;
    std::array<double, kSamples> sizes;
    std::size_t found = 0;
    for (std::size_t i = 0; i < count; i += count / kSamples + 1) {
      const Segment& s = segments_[i];
      const double size = maxNorm(s.b - s.a) + s.thickness();
      if (std::isfinite(size) && size > 0) sizes[found++] = size;
    }
    if (found == 0) return 1;
    const auto median = sizes.begin() + found / 2;
    std::nth_element(sizes.begin(), median, sizes.begin() + found);
    return std::ldexp(1.0, -std::ilogb(*median));
  }

  template <class ATree, class Trees>
  Visit search(const Trees& trees, const CapsuleFilter* filter, PairSink& sink) const {
    const ScratchPool::Lease scratch(*scratch_);
    return tree::findPairs<ATree>(trees, filter, executor_.get(), *scratch, sink);
  }

  template <class F>
  Visit visitTwo(const Scene& other, F&& visit) const {
    return std::visit(
        [&](const auto& tree, const auto& other_tree) {
          using ATree = std::decay_t<decltype(tree)>;
          if constexpr (std::is_same_v<decltype(tree), decltype(other_tree)>) {
            // Each tree is padded by half its own margin; the sum has to be this scene's.
            const double growth = (options_.margin - other.options_.margin) / 2;
            const geometry::FrameChange b_to_a(other.frame_, frame_, growth * frame_.scale);
            const geometry::FrameChange a_to_b(frame_, other.frame_, growth * other.frame_.scale);
            return visit(typename Search<ATree>::Two{tree, other_tree, b_to_a, a_to_b},
                         Type<ATree>());
          } else {
            return Visit::kContinue;  // one of the two has never been built
          }
        },
        tree_, other.tree_);
  }

  SceneOptions options_;
  std::unique_ptr<parallel::Executor> executor_;
  std::unique_ptr<ScratchPool> scratch_;
  geometry::Frame frame_;
  std::vector<Segment> segments_;  ///< by id, if they are kept; an empty id has anything
  std::vector<SegmentId> unbounded_;
  Tree tree_;
  double looseness_when_built_ = 0;
  std::size_t fitted_ = 0;  ///< leaves that updateSome() has fitted since it looked at the bundle
  double unit_ = 1;         ///< see CapsulePairs
};

}  // namespace fcl_fibers::tree
