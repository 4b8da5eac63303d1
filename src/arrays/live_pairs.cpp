// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/live_pairs.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include <fcl_fibers/contact.h>

#include "arrays/fiber_index.h"
#include "arrays/pair_sinks.h"
#include "arrays/triangle_mesh.h"
#include "fibers/options.h"
#include "geometry/segment_distance.h"
#include "geometry/triangle_distance.h"
#include "live/live_list.h"

namespace fcl_fibers {
namespace {

using arrays::FiberIndex;
using geometry::Frame;
using live::LiveList;

constexpr char kUpdate[] = "LivePairs::update";
constexpr char kSafeDistances[] = "LivePairs::safeDistances";

/// The segments of one tree, or of two.
class TreePairing final : public live::Pairing {
 public:
  /// @param other  null for the pairs within the first
  TreePairing(FiberIndex& index, const FiberIndex* other)
      : index_(index),
        other_(other),
        own_(index.table()),
        change_(other != nullptr ? (*other)->frame() : index->frame(), index->frame()) {
    sides_[0] = {&index->leaves(), &index->segments(), index->reach(), nullptr};
    if (other == nullptr) return;
    const double reach = change_.scale() * (*other)->reach() + maxNorm(change_.shift());
    sides_[1] = {&(*other)->leaves(), &(*other)->segments(), reach, &change_};
  }

  int sideCount() const override { return other_ != nullptr ? 2 : 1; }
  const live::SegmentsNow& side(int i) const override {
    return sides_[static_cast<std::size_t>(i)];
  }
  double margin() const override { return index_->margin(); }
  double usualReach() const override { return index_->usualReach(); }
  parallel::Executor* executor() const override { return index_->executor(); }

  tree::Visit search(double beyond, const index::PairFilter& seen, index::PairSink& sink) override {
    index::Question question;
    question.wanted = &seen;
    question.beyond = beyond / index_->frame().scale;
    if (other_ != nullptr) return index_->search(**other_, nullptr, sink, question);
    if (beyond > 0) index_.index().fitBeyond(question.beyond);
    return index_->search(sink, question);
  }
  std::size_t keepTouching(tree::Pair* pairs, std::size_t count) const override {
    std::vector<geometry::Impact> none;
    index_->withTouchTest(other_ != nullptr ? &**other_ : nullptr,
                          [&](const auto& filter) { count = filter.keep(pairs, count, none); });
    return count;
  }
  void findGaps(const tree::Pair* pairs, std::size_t count, double* gaps) const override {
    constexpr std::size_t kBlock = geometry::PairBlock::kCapacity;
    const tree::SegmentRange first = index_->segments().range();
    const tree::SegmentRange second = (other_ != nullptr ? *other_ : index_)->segments().range();
    geometry::CapsulePairs block(index_->pairUnit());
    block.setMayTaper(first.mayTaper(), second.mayTaper());
    geometry::CapsuleEnd ends[4 * kBlock];
    alignas(64) geometry::CapsulePairs::Row found;
    for (std::size_t i = 0; i < count; ++i) {
      first.prefetch(pairs[i].a);
      second.prefetch(pairs[i].b);
    }
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
      const std::size_t size = std::min(kBlock, count - begin);
      block.clear();
      for (std::size_t i = 0; i < size; ++i) {
        const auto [p, q, error] = both(pairs[begin + i]);
        geometry::CapsuleEnd* const its = ends + 4 * i;
        its[0] = firstEndOf(p), its[1] = secondEndOf(p);
        its[2] = firstEndOf(q), its[3] = secondEndOf(q);
        block.add(its, its + 2, margin(), error);
      }
      const std::uint64_t known = block.leastGaps(found);
      for (std::size_t i = 0; i < size; ++i) {
        gaps[begin + i] = (known >> i & 1u) != 0 ? static_cast<double>(found[i]) / block.unit()
                                                 : gapOf(pairs[begin + i]);
      }
    }
  }
  std::size_t sift(tree::Pair* pairs, std::size_t count) const override {
    if (other_ != nullptr) return count;
    if (index_.table().hasGroups()) {
      tree::Pair* const end = std::remove_if(pairs, pairs + count, [this](const tree::Pair& pair) {
        return index_.table().shareGroup(pair.a, pair.b);
      });
      count = static_cast<std::size_t>(end - pairs);
    }
    return own_.sift(pairs, nullptr, count);
  }

 private:
  /// A pair in the frame of the first side.
  struct Both {
    geometry::Segment p, q;
    double error;  ///< bounds what a test now and another one after a step may err by
  };
  Both both(const tree::Pair& pair) const {
    Both both{index_->segment(pair.a), {}, 0};
    both.error = endPointError(both.p);
    if (other_ == nullptr) {
      both.q = index_->segment(pair.b);
      both.error += endPointError(both.q);
    } else {
      both.q = change_((*other_)->segment(pair.b));
      both.error += change_.error(both.q);
    }
    both.error *= 8;
    return both;
  }
  double gapOf(const tree::Pair& pair) const {
    const auto [p, q, error] = both(pair);
    const geometry::ClosestPoints closest = geometry::closestPoints(p, q);
    return norm(closest.apart) - p.radiusAt(closest.s) - q.radiusAt(closest.t) - margin() - error;
  }

  FiberIndex& index_;
  const FiberIndex* const other_;
  const arrays::PairsOfOne own_;
  const geometry::FrameChange change_;
  std::array<live::SegmentsNow, 2> sides_;
};

/// The segments of a tree and the triangles of a mesh.
class MeshPairing final : public live::Pairing {
 public:
  MeshPairing(FiberIndex& index, const index::PlacedMesh& placed, std::uint64_t version)
      : index_(index), mesh_(placed, index->frame()) {
    segments_ = {&index->leaves(), &index->segments(), index->reach(), nullptr};
    triangles_ = {&mesh_.end(), version};
  }

  int sideCount() const override { return 1; }
  const live::SegmentsNow& side(int /*i*/) const override { return segments_; }
  const live::TrianglesNow* triangles() const override { return &triangles_; }
  double margin() const override { return index_->margin(); }
  double usualReach() const override { return index_->usualReach(); }
  parallel::Executor* executor() const override { return index_->executor(); }

  tree::Visit search(double beyond, const index::PairFilter& /*seen*/,
                     index::PairSink& sink) override {
    // The factor covers the rounding of the sum.
    constexpr double kOutward = 1 + 4 * std::numeric_limits<double>::epsilon();
    const double margin = index_->options().margin;
    index::Question question;
    question.names_nearest = false;
    return index_->search(
        mesh_, beyond > 0 ? (margin + beyond / index_->frame().scale) * kOutward : margin, sink,
        question);
  }
  std::size_t keepTouching(tree::Pair* pairs, std::size_t count) const override {
    std::vector<geometry::Impact> none;
    index_->withTouchTest(mesh_.end(), index_->options().margin,
                          [&](const auto& filter) { count = filter.keep(pairs, count, none); });
    return count;
  }
  void findGaps(const tree::Pair* pairs, std::size_t count, double* gaps) const override {
    for (std::size_t i = 0; i < count; ++i) {
      const geometry::Segment p = index_->segment(pairs[i].a);
      const double error = endPointError(p) + mesh_.error();
      gaps[i] = leastDistance(p, mesh_.end()[pairs[i].b]) - p.radius - margin() - 8 * error;
    }
  }
  std::size_t sift(tree::Pair* pairs, std::size_t count) const override {
    if (!index_.table().hasObstacleRules()) return count;
    tree::Pair* const end = std::remove_if(
        pairs, pairs + count, [this](const tree::Pair& pair) { return !mayMeet(pair.a); });
    return static_cast<std::size_t>(end - pairs);
  }

  bool isSolid() const override { return mesh_.isSolid() && !mesh_.empty(); }
  bool mayMeet(tree::SegmentId segment) const override {
    return !index_.table().hasObstacleRules() ||
           index_.table().meets(segment).meet(mesh_.categories());
  }
  bool isInside(tree::SegmentId segment) const override {
    return mesh_.end().isInside(index_->segment(segment));
  }
  index::TriangleId nearest(tree::SegmentId segment) const override {
    constexpr double kAny = std::numeric_limits<double>::max();
    return mesh_.end().nearest(index_->segment(segment), kAny).triangle;
  }

 private:
  FiberIndex& index_;
  const index::PosedMesh mesh_;
  live::SegmentsNow segments_;
  live::TrianglesNow triangles_;
};

template <class Pair>
LivePair<Pair> toPublic(const LiveList::Entry& entry) {
  return {{entry.pair.a, entry.pair.b}, entry.slot};
}

template <class Pair>
std::vector<LivePair<Pair>> toPublic(const std::vector<LiveList::Entry>& entries) {
  std::vector<LivePair<Pair>> pairs;
  pairs.reserve(entries.size());
  for (const LiveList::Entry& entry : entries) pairs.push_back(toPublic<Pair>(entry));
  return pairs;
}

/// Calls visit(entry) for the pairs that touch, until it returns true.
template <class Visit>
bool visitTouching(const LiveList& list, const Visit& visit) {
  for (const LiveList::Entry& entry : list.entries()) {
    if (entry.slot >= 0 && visit(entry)) return true;
  }
  return std::any_of(list.inside().begin(), list.inside().end(), visit);
}

void require(const TriangleMesh& /*partner*/) {}
void require(const FiberTree& tree) {
  const FiberTreeOptions& options = tree.options();
  constexpr char kCall[] = "LivePairs::LivePairs";
  if (options.volumes != FiberTreeOptions::Volumes::kLayeredBoxes) {
    fibers::throwInvalidArgument(
        kCall, "a tree has wrapped spheres; construct it with Volumes::kLayeredBoxes");
  }
  if (options.report != Report::kCapsules) {
    fibers::throwInvalidArgument(
        kCall, "a tree reports volumes and keeps no capsules; construct it with Report::kCapsules");
  }
}

}  // namespace

template <class Partner>
class LivePairs<Partner>::Impl {
 public:
  Impl(FiberTree& tree, const Partner& partner, double skin)
      : tree_(tree), partner_(partner), list_(skin) {}

  const FiberTree& tree() const { return tree_; }
  const Partner& partner() const { return partner_; }
  const LiveList& list() const { return list_; }

  void update() {
    const std::shared_ptr<FiberIndex> own = tree_.index();
    if constexpr (std::is_same_v<Partner, FiberTree>) {
      // To hold an index twice takes as long as some tests of pairs.
      const std::shared_ptr<FiberIndex> held = &tree_ != &partner_ ? partner_.index() : nullptr;
      const std::shared_ptr<FiberIndex>& other = held != nullptr ? held : own;
      const bool is_own = own == other;
      requireReady(own, held != nullptr && is_own ? 3 : 2);
      if (!is_own) requireNone(other->problem(/*needs_capsules=*/true));
      if (!is_own && !(*own)->matches(**other)) {
        fibers::throwInvalidArgument(kUpdate,
                                     "the trees have other topologies; construct them alike");
      }
      TreePairing pairing(*own, is_own ? nullptr : other.get());
      const Version version = Version::of(*own);
      update(pairing, {version, is_own ? version : Version::of(*other)});
      // A search needs the tree at once, so it may as well be fitted where it is read.
      if (list_.isListed()) {
        watches_ = {own->watch(), other->watch()};
      } else if (watches_[0] != nullptr) {
        watches_ = {};
      }
    } else {
      requireReady(own, 2);
      const index::PlacedMesh placed = MeshReader::placed(partner_);
      if (!index::fitsIn((*own)->frame(), placed)) {
        fibers::throwInvalidArgument(kUpdate,
                                     "the coordinates of the mesh overflow in the unit of the "
                                     "fibers; bring it nearer to them");
      }
      const Version mesh = Version::of(partner_, placed);
      MeshPairing pairing(*own, placed, mesh.places);
      update(pairing, {Version::of(*own), mesh});
      watches_[0] = list_.isListed() ? own->watch() : nullptr;
    }
  }

  void findSafeDistances(bool skips_touching, std::vector<double>& distances,
                         std::vector<double>* of_partner) const {
    const std::shared_ptr<FiberIndex> own = tree_.index();
    if constexpr (std::is_same_v<Partner, FiberTree>) {
      const std::shared_ptr<FiberIndex> other = partner_.index();
      const bool is_own = own == other;
      requireList({Version::of(*own), Version::of(*other)}, "the fibers have changed");
      const TreePairing pairing(*own, is_own ? nullptr : other.get());
      const std::array<Ends, 2> found = findSafeDistances(pairing, skips_touching);
      write(*own, found[0], distances);
      if (of_partner != nullptr) write(*other, found[is_own ? 0 : 1], *of_partner);
    } else {
      if (of_partner != nullptr) {
        fibers::throwInvalidArgument(kSafeDistances,
                                     "a mesh has no distances; ask for those of the fibers alone");
      }
      const index::PlacedMesh placed = MeshReader::placed(partner_);
      requireList({Version::of(*own), Version::of(partner_, placed)},
                  "the fibers or the mesh have changed");
      const MeshPairing pairing(*own, placed, versions_[1].places);
      write(*own, findSafeDistances(pairing, skips_touching)[0], distances);
    }
  }

 private:
  /// What a list depends on besides the places of segments and triangles.
  struct Version {
    std::uint64_t names = 0;   ///< FiberIndex::buildNumber(), or of the mesh
    std::uint64_t leaves = 0;  ///< SegmentIndex::buildCount()
    std::uint64_t places = 0;  ///< FiberIndex::updateNumber(), or of the mesh's points
    Frame frame;
    tree::Categories categories;  ///< of the mesh
    geometry::AffineMap pose;     ///< of the mesh
    bool may_taper = false;       ///< whether each end of a segment has its own radius

    bool operator==(const Version& other) const {
      return places == other.places && pose == other.pose && hasListOf(other);
    }
    /// Whether a list goes on that is of the other one.
    bool hasListOf(const Version& other) const {
      return names == other.names && leaves == other.leaves && frame == other.frame &&
             categories == other.categories && may_taper == other.may_taper;
    }
    static Version of(const FiberIndex& index) {
      return {index.buildNumber(),
              index->buildCount(),
              index.updateNumber(),
              index->frame(),
              {},
              {},
              index->segments().mayTaper()};
    }
    static Version of(const TriangleMesh& mesh, const index::PlacedMesh& placed) {
      const MeshReader::Version version = MeshReader::version(mesh);
      return {version.triangles, 0, version.points, {}, placed.categories, placed.pose};
    }
  };

  void update(live::Pairing& pairing, const std::array<Version, 2>& now) {
    auto last = LiveList::Last::kSame;
    for (std::size_t i = 0; i < 2; ++i) {
      if (!now[i].hasListOf(versions_[i])) last = std::max(last, LiveList::Last::kOtherLeaves);
      if (now[i].names != versions_[i].names) last = LiveList::Last::kOtherNames;
    }
    list_.update(pairing, now[0].frame.scale, last);
    versions_ = now;
  }

  /// By the ends of KeptSegments.
  using Ends = std::vector<std::atomic<double>>;

  /// @param what  has changed, if one of these is not that of the last update
  void requireList(const std::array<Version, 2>& now, const char* what) const {
    if (!(now == versions_)) {
      fibers::throwInvalidArgument(kSafeDistances,
                                   std::string(what) + "; call LivePairs::update() before");
    }
    if (!list_.isListed()) {
      fibers::throwInvalidArgument(
          kSafeDistances,
          "there is no list at present; construct the pairs with a skin above 0, and call "
          "LivePairs::update() again if it has thrown");
    }
  }
  std::array<Ends, 2> findSafeDistances(const live::Pairing& pairing, bool skips_touching) const {
    std::array<Ends, 2> found;
    for (int i = 0; i < pairing.sideCount(); ++i) {
      Ends& ends = found[static_cast<std::size_t>(i)];
      ends = Ends(static_cast<std::size_t>(pairing.side(i).segments->end()) + 1);
      for (auto& distance : ends) distance = std::numeric_limits<double>::infinity();
    }
    list_.findSafeDistances(pairing, skips_touching, found.data());
    return found;
  }
  void write(const FiberIndex& index, const Ends& from, std::vector<double>& to) const {
    const double unit = 1 / versions_[0].frame.scale;
    to.resize(static_cast<std::size_t>(index.table().idCount()));
    for (std::size_t i = 0; i < to.size(); ++i) {
      to[i] = i < from.size() ? unit * from[i].load() : std::numeric_limits<double>::infinity();
    }
  }

  /// @param holders  how many hold the index if no query runs: the tree, and this call
  static void requireReady(const std::shared_ptr<FiberIndex>& index, long holders) {
    if (index.use_count() > holders) fibers::throwQueryRuns(kUpdate);
    // A query of another thread may just have ended; see FiberTree::change().
    std::shared_ptr<FiberIndex>(index).reset();
    requireNone(index->problem(/*needs_capsules=*/true));
  }
  static void requireNone(const char* problem) {
    if (problem != nullptr) fibers::throwInvalidArgument(kUpdate, problem);
  }

  FiberTree& tree_;
  const Partner& partner_;
  LiveList list_;
  std::array<Version, 2> versions_;
  std::array<std::shared_ptr<const void>, 2> watches_;
};

template <class Partner>
LivePairs<Partner>::LivePairs(FiberTree& tree, const Partner& partner,
                              const LivePairsOptions& options) {
  require(tree);
  require(partner);
  if (!std::isfinite(options.skin)) {
    fibers::throwInvalidArgument("LivePairs::LivePairs",
                                 "the skin is NaN or infinite; give a finite length, or a negative "
                                 "number to have it chosen");
  }
  impl_ = std::make_unique<Impl>(tree, partner, options.skin);
}
template <class Partner>
LivePairs<Partner>::~LivePairs() = default;
template <class Partner>
LivePairs<Partner>::LivePairs(LivePairs&&) noexcept = default;
template <class Partner>
LivePairs<Partner>& LivePairs<Partner>::operator=(LivePairs&&) noexcept = default;

template <class Partner>
void LivePairs<Partner>::update() {
  impl_->update();
}
template <class Partner>
void LivePairs<Partner>::safeDistances(std::vector<double>& distances, bool skips_touching) const {
  impl_->findSafeDistances(skips_touching, distances, nullptr);
}
template <class Partner>
void LivePairs<Partner>::safeDistances(std::vector<double>& distances,
                                       std::vector<double>& partner_distances,
                                       bool skips_touching) const {
  impl_->findSafeDistances(skips_touching, distances, &partner_distances);
}
template <class Partner>
std::size_t LivePairs<Partner>::count() const {
  return impl_->list().touchingCount();
}
template <class Partner>
std::int32_t LivePairs<Partner>::slotCount() const {
  return impl_->list().slotCount();
}

template <class Partner>
bool LivePairs<Partner>::visitRuns(
    const std::function<bool(const LivePair<Pair>*, std::size_t)>& take) const {
  std::array<LivePair<Pair>, 256> run;
  std::size_t count = 0;
  const auto add = [&](const LiveList::Entry& entry) {
    run[count++] = toPublic<Pair>(entry);
    if (count < run.size()) return false;
    return take(run.data(), std::exchange(count, 0));
  };
  return visitTouching(impl_->list(), add) || (count > 0 && take(run.data(), count));
}

template <class Partner>
void LivePairs<Partner>::find(std::vector<Pair>& pairs) const {
  pairs.resize(count());
  auto out = pairs.begin();
  visitTouching(impl_->list(), [&](const LiveList::Entry& entry) {
    *out++ = toPublic<Pair>(entry).pair;
    return false;
  });
}
template <class Partner>
void LivePairs<Partner>::find(std::vector<LivePair<Pair>>& pairs) const {
  pairs.resize(count());
  auto out = pairs.begin();
  visitTouching(impl_->list(), [&](const LiveList::Entry& entry) {
    *out++ = toPublic<Pair>(entry);
    return false;
  });
}

template <class Partner>
std::vector<LivePair<typename LivePairs<Partner>::Pair>> LivePairs<Partner>::begun() const {
  return toPublic<Pair>(impl_->list().begun());
}
template <class Partner>
std::vector<LivePair<typename LivePairs<Partner>::Pair>> LivePairs<Partner>::ended() const {
  return toPublic<Pair>(impl_->list().ended());
}

template <class Partner>
double LivePairs<Partner>::skin() const {
  return impl_->list().skin();
}
template <class Partner>
LivePairsCounters LivePairs<Partner>::counters() const {
  const LiveList::Counts& counts = impl_->list().counts();
  return {counts.updates,      counts.listings,       counts.uncovered_pairs,
          counts.tested_pairs, counts.touching_pairs, counts.longest_life};
}
template <class Partner>
std::size_t LivePairs<Partner>::memoryUsage() const {
  return sizeof(*this) + sizeof(Impl) + impl_->list().memoryUsage();
}
template <class Partner>
const FiberTree& LivePairs<Partner>::tree() const {
  return impl_->tree();
}
template <class Partner>
const Partner& LivePairs<Partner>::partner() const {
  return impl_->partner();
}

template class LivePairs<FiberTree>;
template class LivePairs<TriangleMesh>;

}  // namespace fcl_fibers
