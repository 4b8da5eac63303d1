// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/live_pairs.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include <fcl_fibers/contact.h>

#include "arrays/fiber_index.h"
#include "arrays/pair_sinks.h"
#include "fibers/options.h"
#include "geometry/segment_distance.h"
#include "live/live_list.h"

namespace fcl_fibers {
namespace {

using arrays::FiberIndex;
using geometry::Frame;
using live::LiveList;

constexpr char kUpdate[] = "LivePairs::update";

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
  double gapOf(const tree::Pair& pair) const override {
    const geometry::Segment p = index_->segment(pair.a);
    geometry::Segment q = other_ != nullptr ? (*other_)->segment(pair.b) : index_->segment(pair.b);
    double error = endPointError(p);
    if (other_ == nullptr) {
      error += endPointError(q);
    } else {
      q = change_(q);
      error += change_.error(q);
    }
    const double distance = norm(geometry::closestPoints(p, q).apart);
    // The points found are further apart than the nearest ones by less than the second number.
    return distance - p.radius - q.radius - margin() - 8 * error;
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
  FiberIndex& index_;
  const FiberIndex* const other_;
  const arrays::PairsOfOne own_;
  const geometry::FrameChange change_;
  std::array<live::SegmentsNow, 2> sides_;
};

SegmentPair toPublic(const tree::Pair& pair) { return {pair.a, pair.b}; }

template <class Pair>
std::vector<LivePair<Pair>> toPublic(const std::vector<LiveList::Entry>& entries) {
  std::vector<LivePair<Pair>> pairs;
  pairs.reserve(entries.size());
  for (const LiveList::Entry& entry : entries) pairs.push_back({toPublic(entry.pair), entry.slot});
  return pairs;
}

void require(const FiberTreeOptions& options) {
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
    const std::shared_ptr<FiberIndex> own = tree_.index(), other = partner_.index();
    const bool is_own = own == other;
    // Both are held here, and by the trees.
    if (own.use_count() > (is_own ? 3 : 2)) fibers::throwQueryRuns(kUpdate);
    require(own->problem(/*needs_capsules=*/true));
    require(other->problem(/*needs_capsules=*/true));
    if (!(*own)->matches(**other)) {
      fibers::throwInvalidArgument(kUpdate,
                                   "the trees have other topologies; construct them alike");
    }
    if (watches_[0] == nullptr) watches_ = {own->watch(), other->watch()};
    const std::array<Version, 2> now = {Version::of(*own), Version::of(*other)};
    auto last = LiveList::Last::kSame;
    for (std::size_t i = 0; i < 2; ++i) {
      if (now[i].leaves != versions_[i].leaves || !(now[i].frame == versions_[i].frame)) {
        last = std::max(last, LiveList::Last::kOtherLeaves);
      }
      if (now[i].names != versions_[i].names) last = LiveList::Last::kOtherNames;
    }
    TreePairing pairing(*own, is_own ? nullptr : other.get());
    list_.update(pairing, (*own)->frame().scale, last);
    versions_ = now;
  }

  void findSafeDistances(bool skips_touching, std::vector<double>& distances,
                         std::vector<double>* of_partner) const {
    constexpr char kCall[] = "LivePairs::safeDistances";
    const std::shared_ptr<FiberIndex> own = tree_.index(), other = partner_.index();
    const bool is_own = own == other;
    if (!(Version::of(*own) == versions_[0] && Version::of(*other) == versions_[1])) {
      fibers::throwInvalidArgument(kCall,
                                   "the fibers have changed; call LivePairs::update() before");
    }
    if (!list_.isListed()) {
      fibers::throwInvalidArgument(
          kCall, "there is no list at present; construct the pairs with a skin above 0");
    }
    const TreePairing pairing(*own, is_own ? nullptr : other.get());
    std::vector<std::atomic<double>> found[2];
    for (int i = 0; i < pairing.sideCount(); ++i) {
      found[i] = std::vector<std::atomic<double>>(
          static_cast<std::size_t>(pairing.side(i).segments->end()) + 1);
      for (auto& distance : found[i]) distance = std::numeric_limits<double>::infinity();
    }
    list_.findSafeDistances(pairing, skips_touching, found);
    const double unit = 1 / (*own)->frame().scale;
    const auto write = [unit](const FiberIndex& index, const auto& from, std::vector<double>& to) {
      to.resize(static_cast<std::size_t>(index.table().idCount()));
      for (std::size_t i = 0; i < to.size(); ++i) {
        to[i] = i < from.size() ? unit * from[i].load() : std::numeric_limits<double>::infinity();
      }
    };
    write(*own, found[0], distances);
    if (of_partner != nullptr) write(*other, is_own ? found[0] : found[1], *of_partner);
  }

 private:
  /// What the list of an index depends on besides the places of its segments.
  struct Version {
    std::size_t names = 0;   ///< FiberIndex::buildCount()
    std::size_t leaves = 0;  ///< SegmentIndex::buildCount()
    std::size_t places = 0;  ///< FiberIndex::updateCount()
    Frame frame;

    bool operator==(const Version& other) const {
      return names == other.names && leaves == other.leaves && places == other.places &&
             frame == other.frame;
    }
    static Version of(const FiberIndex& index) {
      return {index.buildCount(), index->buildCount(), index.updateCount(), index->frame()};
    }
  };

  static void require(const char* problem) {
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
  require(tree.options());
  require(partner.options());
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
  for (const LiveList::Entry& entry : impl_->list().entries()) {
    if (entry.slot < 0) continue;
    run[count++] = {toPublic(entry.pair), entry.slot};
    if (count < run.size()) continue;
    if (take(run.data(), count)) return true;
    count = 0;
  }
  return count > 0 && take(run.data(), count);
}

template <class Partner>
void LivePairs<Partner>::find(std::vector<Pair>& pairs) const {
  pairs.resize(count());
  auto out = pairs.begin();
  for (const LiveList::Entry& entry : impl_->list().entries()) {
    if (entry.slot >= 0) *out++ = toPublic(entry.pair);
  }
}
template <class Partner>
void LivePairs<Partner>::find(std::vector<LivePair<Pair>>& pairs) const {
  pairs.resize(count());
  auto out = pairs.begin();
  for (const LiveList::Entry& entry : impl_->list().entries()) {
    if (entry.slot >= 0) *out++ = {toPublic(entry.pair), entry.slot};
  }
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
  return {counts.updates,      counts.listings,       counts.renewed_segments,
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

}  // namespace fcl_fibers
