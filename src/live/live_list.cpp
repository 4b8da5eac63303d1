// SPDX-License-Identifier: BSD-3-Clause
#include "live/live_list.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <iterator>
#include <optional>
#include <utility>

#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "index/pair_search.h"
#include "live/coverage.h"
#include "live/segment_flags.h"

namespace fcl_fibers::live {
namespace {

using tree::Pair;
using tree::SegmentId;

using Entry = LiveList::Entry;
using Entries = parallel::UnwrittenVector<Entry>;

bool isBefore(const Pair& p, const Pair& q) { return p.a != q.a ? p.a < q.a : p.b < q.b; }

/// Puts what a search finds into a list.
class ListSink final : public index::PairSink {
 public:
  /// @param elements  as requireFew() has it
  ListSink(const Pairing& pairing, std::size_t elements, Entries& entries)
      : pairing_(pairing), elements_(elements), entries_(entries) {}

  Delivery delivery() const override { return Delivery::kPlaced; }
  std::size_t sift(Pair* pairs, geometry::Impact* /*impacts*/, std::size_t count) const override {
    return pairing_.sift(pairs, count);
  }
  tree::Visit take(const index::PairRun& run) override {
    makeRoom(run.count);
    place(0, run);
    return tree::Visit::kContinue;
  }
  void requireRoom(std::size_t count) const override {
    index::requireFew("live pairs", entries_.size() + count, index::kMostKept / sizeof(Entry),
                      elements_, ", and whether the skin is far wider than the gaps");
  }
  void makeRoom(std::size_t count) override {
    requireRoom(count);
    begin_ = entries_.size();
    entries_.resize(begin_ + count);
  }
  void place(std::size_t begin, const index::PairRun& run) const override {
    Entry* const out = entries_.data() + begin_ + begin;
    for (std::size_t i = 0; i < run.count; ++i) out[i] = {run.pairs[i], -1};
  }

 private:
  const Pairing& pairing_;
  const std::size_t elements_;
  Entries& entries_;
  std::size_t begin_ = 0;
};

/// Counts pairs.
class Counter final : public index::PairFilter {
 public:
  std::size_t keep(Pair* /*pairs*/, std::size_t count,
                   std::vector<geometry::Impact>& /*impacts*/) const override {
    count_.fetch_add(count, std::memory_order_relaxed);
    return count;
  }
  std::size_t count() const { return count_; }

 private:
  mutable std::atomic<std::size_t> count_{0};
};

/// The slots of pairs that touch, for those that are listed anew.
class SlotsOfPairs {
 public:
  explicit SlotsOfPairs(const std::vector<Entry>& touching) {
    if (touching.empty()) return;
    const auto byFirst = [](const Entry& p, const Entry& q) { return p.pair.a < q.pair.a; };
    const auto [least, most] = std::minmax_element(touching.begin(), touching.end(), byFirst);
    first_ = least->pair.a;
    ends_.assign(static_cast<std::size_t>(most->pair.a - first_) + 2, 0);
    for (const Entry& entry : touching) ++ends_[placeOf(entry.pair.a) + 1];
    for (std::size_t i = 1; i < ends_.size(); ++i) ends_[i] += ends_[i - 1];
    entries_.resize(touching.size());
    // Each number of ends_ is where its segment begins now, and where it ends afterwards.
    for (const Entry& entry : touching) {
      entries_[static_cast<std::size_t>(ends_[placeOf(entry.pair.a)]++)] = entry;
    }
    for (std::size_t i = 0; i + 1 < ends_.size(); ++i) {
      std::sort(entries_.begin() + beginOf(i), entries_.begin() + ends_[i],
                [](const Entry& p, const Entry& q) { return p.pair.b < q.pair.b; });
    }
  }

  /// Returns the slot of a pair and forgets it; -1 if there is none.
  std::int32_t take(const Pair& pair) {
    // The place of a segment before the first one wraps around to a large number.
    const std::size_t place = placeOf(pair.a);
    if (ends_.empty() || place >= ends_.size() - 1) return -1;
    const auto end = entries_.begin() + ends_[place];
    const auto found =
        std::lower_bound(entries_.begin() + beginOf(place), end, pair.b,
                         [](const Entry& entry, SegmentId b) { return entry.pair.b < b; });
    return found != end && found->pair.b == pair.b ? std::exchange(found->slot, -1) : -1;
  }

  /// Adds those that were not taken, in the order of their names.
  void addRest(std::vector<Entry>& rest) const {
    std::copy_if(entries_.begin(), entries_.end(), std::back_inserter(rest),
                 [](const Entry& entry) { return entry.slot >= 0; });
  }

 private:
  std::size_t placeOf(SegmentId a) const {
    return static_cast<std::size_t>(std::int64_t{a} - first_);
  }
  std::ptrdiff_t beginOf(std::size_t place) const { return place > 0 ? ends_[place - 1] : 0; }

  std::int64_t first_ = 0;
  std::vector<std::int32_t> ends_;  ///< by segment a, from first_ on
  std::vector<Entry> entries_;
};

SegmentId firstOf(const Pair& pair) { return pair.a; }
SegmentId firstOf(const Entry& entry) { return entry.pair.a; }

/// The first segments of pairs.
template <class Pairs>
SegmentFlags segmentsOf(const Pairing& pairing, const Pairs& pairs) {
  const index::KeptSegments& segments = *pairing.side(0).segments;
  SegmentFlags flags(segments.begin(), segments.end());
  for (const auto& pair : pairs) flags.set(firstOf(pair));
  return flags;
}

/// Whether a segment and a triangle are at most `reach` apart.
bool areNear(const geometry::Segment& p, const geometry::Triangle& triangle, double reach) {
  return p.isBox() ? boxesTouch(p, boxAround(triangle), reach)
                   : touch(p, triangle, reach, /*error=*/0);
}

}  // namespace

LiveList::LiveList(double skin) : fixed_(skin), skin_(/*is_chosen=*/skin < 0) {}

void LiveList::update(Pairing& pairing, double scale, Last last) {
  const bool told_distances = told_distances_.exchange(false);
  // Until the end the list is none that may serve.
  const State before =
      last == Last::kSame ? std::exchange(state_, State::kNone) : (state_ = State::kNone);
  Entries listed;
  std::vector<Entry> gone;
  const bool has_unit = skin_.isChosen() && (before != State::kNone || skin_.knowsSpeed());
  const double unit = has_unit ? pairing.usualReach() : 1;
  bool serves = false;
  double used_skin = used_skin_;
  if (before != State::kNone) {
    ++age_;
    const bool is_worn = before == State::kListed && skin_.isWorn();
    if (!is_worn) {
      measure(pairing, /*samples=*/before == State::kAnchored);
      if (skin_.isChosen()) {
        skin_.setApproach(usualApproach(sidesOf(pairing), unit) / unit, age_);
      }
      serves = before == State::kListed && complete(pairing, told_distances);
    }
    if (serves) counts_.longest_life = std::max(counts_.longest_life, age_);
  }
  State now = State::kListed;
  if (!serves) {
    const double skin = skin_.isChosen()
                            ? skin_.next(before == State::kListed && !told_distances) * unit
                            : fixed_ * scale;
    list(pairing, skin, last, listed, gone);
    if (skin <= 0) now = skin_.wantsSpeed() ? State::kAnchored : State::kNone;
    if (now != State::kNone) anchor(pairing, /*samples=*/now == State::kAnchored);
    age_ = 0;
    used_skin = skin / scale;
  }
  Entries& entries = serves ? entries_ : listed;
  const bool all_touch = !serves && now != State::kListed;
  const std::vector<std::size_t> changed = all_touch ? allNew(entries) : test(pairing, entries);
  std::vector<Entry> inside;
  if (pairing.isSolid()) inside = findInside(pairing, entries, changed);
  if (serves) gone.insert(gone.end(), inside_.begin(), inside_.end());
  take(entries, changed, inside, gone, last != Last::kOtherNames);
  if (!serves) skin_.setFound(entries_.size(), touching_count_);
  state_ = now;
  used_skin_ = used_skin;
  ++counts_.updates;
}

/// The segments of some blocks of a side. They suffice to tell how fast all move.
SegmentsNow LiveList::sampleOf(const SegmentsNow& side, tree::SegmentIds& order) {
  constexpr std::size_t kBlock = Anchors::kBlock, kFewBlocks = 32, kMostBlocks = 1024;
  const std::size_t blocks = side.order->size() / kBlock;
  const std::size_t step =
      std::max(blocks / kMostBlocks, std::min<std::size_t>(blocks / kFewBlocks, 8));
  SegmentsNow sample = side;
  if (step < 2) return sample;
  for (std::size_t i = 0; i < blocks; i += step) {
    const auto begin = side.order->begin() + static_cast<std::ptrdiff_t>(i * kBlock);
    order.insert(order.end(), begin, begin + kBlock);
  }
  sample.order = &order;
  return sample;
}

/// Bounds how far ends have moved since they were listed.
/// @param samples  whether some segments are anchored, and not all
void LiveList::measure(const Pairing& pairing, bool samples) {
  tree::SegmentIds orders[2];
  SegmentsNow sides[2];
  for (int i = 0; i < pairing.sideCount(); ++i) {
    sides[i] = samples ? sampleOf(pairing.side(i), orders[i]) : pairing.side(i);
  }
  std::vector<geometry::MovedPoint> points;
  for (int i = 0; i < pairing.sideCount(); ++i) anchors_[i].sample(sides[i], points);
  const TrianglesNow* const triangles = pairing.triangles();
  if (triangles != nullptr) mesh_.sample(*triangles, points);
  const geometry::AffineMap motion = commonMotion(points);
  for (int i = 0; i < pairing.sideCount(); ++i) {
    anchors_[i].measure(sides[i], motion, pairing.executor());
  }
  if (triangles != nullptr) mesh_.measure(*triangles, motion, pairing.executor());
}

Sides LiveList::sidesOf(const Pairing& pairing) const {
  const TrianglesNow* const triangles = pairing.triangles();
  const auto writeNodes = [this, triangles, &pairing](int side, std::int32_t block,
                                                      BlockTree::BlockNodes& nodes) {
    if (triangles != nullptr && side == 1) return mesh_.writeNodes(*triangles, block, nodes);
    anchors_[side].writeNodes(pairing.side(side), block, nodes);
  };
  bool have_boxes = false;
  for (int i = 0; i < pairing.sideCount(); ++i) {
    have_boxes = have_boxes || pairing.side(i).segments->hasBoxes();
  }
  if (triangles != nullptr)
    return {2, {&anchors_[0], &mesh_}, /*is_mesh=*/true, have_boxes, writeNodes};
  const int count = pairing.sideCount();
  return {count, {&anchors_[0], &anchors_[count - 1]}, /*is_mesh=*/false, have_boxes, writeNodes};
}

/// Returns the pair of two leaves if it counts, unless the search has listed it, as its anchors
/// tell.
std::optional<Pair> LiveList::unlisted(const Pairing& pairing, Leaf k, Leaf l) const {
  const TrianglesNow* const triangles = pairing.triangles();
  const int second = pairing.sideCount() - 1;
  const SegmentsNow &first_now = pairing.side(0), &second_now = pairing.side(second);
  const geometry::Segment p = anchors_[0].segment(first_now, k);
  const double reach = pairing.margin() + covered_;
  const bool is_listed =
      triangles != nullptr ? areNear(p, mesh_.triangle(*triangles, l), reach)
                           : touch(p, anchors_[second].segment(second_now, l), reach, /*error=*/0);
  if (is_listed) return std::nullopt;
  const tree::SegmentIds& others = triangles != nullptr ? triangles->order() : *second_now.order;
  Pair pair{(*first_now.order)[static_cast<std::size_t>(k)], others[static_cast<std::size_t>(l)]};
  if (pairing.sift(&pair, 1) == 0) return std::nullopt;
  return pair;
}

/// Makes the list complete: of the pairs that are neither covered nor listed, it lists those that
/// touch. Returns false if all have to be listed.
bool LiveList::complete(const Pairing& pairing, bool told_distances) {
  // Far out the anchors may be rounded by more than the skin.
  if (!(covered_ > 0)) return false;
  // What is left of the skin bounds safe distances. If a program moved its points by these, and the
  // list were renewed only once nothing is left, they would become less and less, and never end.
  const double covered = told_distances ? 0.5 * covered_ : covered_;
  std::vector<Pair> missing;
  const std::int64_t most = skin_.mostAsked();
  std::int64_t left = most;
  const bool is_checked =
      visitUncovered(sidesOf(pairing), covered, pairing.margin(), left, [&](Leaf k, Leaf l) {
        if (const std::optional<Pair> pair = unlisted(pairing, k, l)) missing.push_back(*pair);
      });
  if (!is_checked) return false;
  skin_.setUpdate(most - left, entries_.size() + missing.size());
  counts_.uncovered_pairs += static_cast<std::int64_t>(missing.size());
  // A segment may pass through a surface from one update to the next. Those of a solid that have a
  // listed triangle are asked on which side they are.
  if (!pairing.isSolid()) missing.resize(pairing.keepTouching(missing.data(), missing.size()));
  missing = withoutListed(pairing, std::move(missing));
  // A vector would double its memory by itself.
  const std::size_t count = entries_.size() + missing.size();
  if (count > entries_.capacity()) entries_.reserve(std::max(count, entries_.size() / 8 * 9));
  for (const Pair& pair : missing) entries_.push_back({pair, -1});
  return true;
}

/// Returns those of the pairs that are not listed, in ascending order.
std::vector<Pair> LiveList::withoutListed(const Pairing& pairing, std::vector<Pair> pairs) const {
  if (pairs.empty()) return pairs;
  std::sort(pairs.begin(), pairs.end(), isBefore);
  std::vector<bool> are_listed(pairs.size());
  const SegmentFlags flags = segmentsOf(pairing, pairs);
  for (const Entry& entry : entries_) {
    if (!flags.has(entry.pair.a)) continue;
    const auto found = std::lower_bound(pairs.begin(), pairs.end(), entry.pair, isBefore);
    if (found != pairs.end() && !isBefore(entry.pair, *found)) {
      are_listed[static_cast<std::size_t>(found - pairs.begin())] = true;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!are_listed[i]) pairs[kept++] = pairs[i];
  }
  pairs.resize(kept);
  return pairs;
}

/// Lists all pairs.
void LiveList::list(Pairing& pairing, double skin, Last last, Entries& listed,
                    std::vector<Entry>& gone) {
  ++counts_.listings;
  listed.clear();
  gone.clear();
  std::size_t segments = 0, elements = 0;
  for (int i = 0; i < pairing.sideCount(); ++i) {
    segments += pairing.side(i).order->size();
    elements = std::max(elements, pairing.side(i).order->size());
  }
  if (pairing.triangles() != nullptr) {
    elements = std::max(elements, pairing.triangles()->order().size());
  }
  ListSink sink(pairing, elements, listed);
  const Counter seen;
  pairing.search(skin, seen, sink);
  if (pairing.triangles() != nullptr) {
    skin_.setMeshSearch(segments, touching_count_);
  } else {
    skin_.setSearch(segments, seen.count());
  }
  sides_.clear();
  if (pairing.isSolid()) {
    std::vector<SegmentId> deep;
    for (; !listed.empty() && listed.back().pair.b < 0; listed.pop_back()) {
      deep.push_back(listed.back().pair.a);
    }
    sides_.set(pairing, deep);
  }
  std::vector<Entry> touched = inside_;
  touched.reserve(touching_count_);
  std::copy_if(entries_.begin(), entries_.end(), std::back_inserter(touched),
               [](const Entry& entry) { return entry.slot >= 0; });
  if (last == Last::kOtherNames) {
    gone = std::move(touched);
  } else {
    for (Entry& entry : touched) {
      entry.pair = {pairing.nameNow(entry.pair.a), pairing.nameNow(entry.pair.b)};
    }
    const auto isSame = [](const Entry& p, const Entry& q) {
      return p.pair.a == q.pair.a && p.pair.b == q.pair.b;
    };
    // Small scenes often find what they found before.
    if (std::equal(listed.begin(), listed.end(), touched.begin(), touched.end(), isSame)) {
      std::copy(touched.begin(), touched.end(), listed.begin());
    } else {
      SlotsOfPairs slots(touched);
      for (Entry& entry : listed) entry.slot = slots.take(entry.pair);
      slots.addRest(gone);
    }
  }
  // A list lasts, and its memory has grown by doubling.
  if (skin > 0 && listed.capacity() / 9 * 8 > listed.size()) listed.shrink_to_fit();
  listed_ = skin;
}

/// Anchors all segments where they are, or a sample.
void LiveList::anchor(const Pairing& pairing, bool samples) {
  for (int i = 0; i < pairing.sideCount(); ++i) {
    tree::SegmentIds order;
    anchors_[i].set(samples ? sampleOf(pairing.side(i), order) : pairing.side(i),
                    pairing.executor());
  }
  if (pairing.triangles() != nullptr) mesh_.set(*pairing.triangles(), pairing.executor());
  // The anchors are rounded.
  covered_ = listed_ - mostApproach(sidesOf(pairing));
}

/// Returns the places of the entries without a slot, if all touch.
std::vector<std::size_t> LiveList::allNew(const Entries& entries) {
  std::vector<std::size_t> changed;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].slot < 0) changed.push_back(i);
  }
  return changed;
}

/// Returns the places of the entries that have begun or ended to touch.
std::vector<std::size_t> LiveList::test(const Pairing& pairing, const Entries& entries) {
  constexpr std::size_t kTask = 8192, kRun = 1024;
  std::vector<std::vector<std::size_t>> found(entries.size() / kTask + 1);
  std::atomic<std::size_t> touching{0};
  parallel::forRanges(
      pairing.executor(), entries.size(), kTask, [&](std::size_t begin, std::size_t end) {
        std::array<Pair, kRun> pairs;
        std::size_t touching_here = 0;
        for (std::size_t from = begin; from < end; from += kRun) {
          const std::size_t count = std::min(kRun, end - from);
          for (std::size_t i = 0; i < count; ++i) pairs[i] = entries[from + i].pair;
          const std::size_t kept = pairing.keepTouching(pairs.data(), count);
          touching_here += kept;
          for (std::size_t i = 0, next = 0; i < count; ++i) {
            const Entry& entry = entries[from + i];
            const bool touches =
                next < kept && pairs[next].a == entry.pair.a && pairs[next].b == entry.pair.b;
            next += touches ? 1 : 0;
            if (touches != (entry.slot >= 0)) found[from / kTask].push_back(from + i);
          }
        }
        touching.fetch_add(touching_here, std::memory_order_relaxed);
      });
  counts_.tested_pairs += static_cast<std::int64_t>(entries.size());
  counts_.touching_pairs += static_cast<std::int64_t>(touching.load());
  std::vector<std::size_t> changed;
  for (const auto& part : found) changed.insert(changed.end(), part.begin(), part.end());
  return changed;
}

/// Finds what is inside a solid now. They have no slots yet.
std::vector<Entry> LiveList::findInside(const Pairing& pairing, const Entries& entries,
                                        const std::vector<std::size_t>& changed) const {
  const SegmentFlags near = segmentsOf(pairing, entries);
  SegmentFlags touching(near.begin(), near.end());
  auto next = changed.begin();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const bool has_changed = next != changed.end() && *next == i;
    if (has_changed) ++next;
    if ((entries[i].slot >= 0) != has_changed) touching.set(entries[i].pair.a);
  }
  std::vector<Entry> inside;
  for (const SegmentId id : sides_.find(pairing, near, touching)) inside.push_back({{id, -1}, -1});
  constexpr std::size_t kAtOnce = 64;
  parallel::forRanges(pairing.executor(), inside.size(), kAtOnce,
                      [&](std::size_t begin, std::size_t end) {
                        for (std::size_t i = begin; i < end; ++i) {
                          inside[i].pair.b = pairing.nearest(inside[i].pair.a);
                        }
                      });
  return inside;
}

/// Takes over a list and what has changed.
/// @param inside     gets its slots
/// @param gone       what is listed no more, or was inside
/// @param may_go_on  whether a pair of these may still touch
void LiveList::take(Entries& entries, const std::vector<std::size_t>& changed,
                    std::vector<Entry>& inside, std::vector<Entry>& gone, bool may_go_on) {
  for (const std::size_t i : changed) {
    if (entries[i].slot >= 0) gone.push_back(entries[i]);
  }
  // A pair may begin to touch by itself that was that of a segment inside, or the other way round.
  may_go_on &= !inside.empty() || !inside_.empty();
  SlotsOfPairs slots(may_go_on ? gone : std::vector<Entry>());
  std::vector<Entry> begun, ended;
  begun.reserve(changed.size() + inside.size());
  ended.reserve(gone.size());
  free_.reserve(free_.size() + ended_.size());

  // Nothing below throws.
  for (const Entry& entry : ended_) free_.push_back(entry.slot);
  const auto begin = [&](Entry& entry) {
    entry.slot = slots.take(entry.pair);
    if (entry.slot >= 0) return;
    if (free_.empty()) {
      entry.slot = slot_count_++;
    } else {
      entry.slot = free_.back();
      free_.pop_back();
    }
    begun.push_back(entry);
  };
  for (const std::size_t i : changed) {
    if (entries[i].slot >= 0) {
      entries[i].slot = -1;
    } else {
      begin(entries[i]);
    }
  }
  for (Entry& entry : inside) begin(entry);
  if (may_go_on) {
    slots.addRest(ended);
  } else {
    ended.swap(gone);
  }
  touching_count_ = touching_count_ + begun.size() - ended.size();
  if (&entries != &entries_) entries_.swap(entries);
  inside_.swap(inside);
  begun_.swap(begun);
  ended_.swap(ended);
}

void LiveList::findSafeDistances(const Pairing& pairing, bool skips_touching,
                                 std::vector<std::atomic<double>>* distances) const {
  constexpr double kInward = 1 - 0x1p-30;
  constexpr std::size_t kTask = 8192, kRun = 256;
  told_distances_ = true;
  const TrianglesNow* const triangles = pairing.triangles();
  const bool is_mesh = triangles != nullptr;
  const int second = pairing.sideCount() - 1;
  const SegmentFlags free = is_mesh ? freeOfMesh(pairing, skips_touching) : SegmentFlags();
  // Half of what two segments may come nearer is for each of them. A mesh rests.
  const double share = (is_mesh ? 1 : 0.5) * kInward;
  // It is 0 where the distance is NaN, of which nothing is safe.
  const auto shareOf = [share](double distance) { return std::max(0.0, share * distance); };
  const auto placeOf = [&](int side, SegmentId id) {
    const index::KeptSegments& segments = *pairing.side(side).segments;
    const std::size_t stride = segments.sharesEnds() ? 1 : 2;
    return stride * static_cast<std::size_t>(id - segments.begin());
  };
  const auto lower = [&](int side, SegmentId id, double distance) {
    if (is_mesh && free.has(id)) return;
    const double its_share = shareOf(distance);
    const std::size_t place = placeOf(side, id);
    for (const std::size_t end : {place, place + 1}) {
      std::atomic<double>& least = distances[side][end];
      double before = least.load(std::memory_order_relaxed);
      while (its_share < before && !least.compare_exchange_weak(before, its_share)) {
      }
    }
  };
  // Of what is as it was at first, all by one number, so that no store has to wait for another.
  const auto setAll = [&](int side, double distance) {
    const tree::SegmentIds& order = *pairing.side(side).order;
    parallel::forRanges(
        pairing.executor(), order.size(), kTask, [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            if (is_mesh && free.has(order[i])) continue;
            const std::size_t place = placeOf(side, order[i]);
            for (const std::size_t end_of_it : {place, place + 1}) {
              distances[side][end_of_it].store(shareOf(distance), std::memory_order_relaxed);
            }
          }
        });
  };

  const auto lowerBoth = [&](const Pair& pair, double gap) {
    lower(0, pair.a, gap);
    if (!is_mesh) lower(second, pair.b, gap);
  };
  const auto lowerByGaps = [&](const Pair* pairs, std::size_t count) {
    std::array<double, kRun> gaps;
    pairing.findGaps(pairs, count, gaps.data());
    for (std::size_t i = 0; i < count; ++i) lowerBoth(pairs[i], gaps[i]);
  };

  // What is not listed: nearly the whole skin, or what is left of it where that is less. Half of it
  // is always left to what is covered.
  constexpr std::int64_t kMostAsked = 4;
  std::size_t all = is_mesh ? triangles->order().size() : 0;
  for (int i = 0; i <= second; ++i) all += pairing.side(i).order->size();
  std::vector<Pair> uncovered;
  // @param nearer  by how much what is covered may have come nearer
  const auto findUncovered = [&](double nearer) {
    uncovered.clear();
    std::int64_t left = kMostAsked * static_cast<std::int64_t>(all) + 1024;
    return visitUncovered(sidesOf(pairing), nearer, pairing.margin() + covered_ - nearer, left,
                          [&](Leaf k, Leaf l) {
                            const std::optional<Pair> pair = unlisted(pairing, k, l);
                            if (pair) uncovered.push_back(*pair);
                          });
  };
  // The lanes round up by less.
  constexpr double kOutward = 1 + 0x1p-16;
  double nearer = std::min(kOutward * mostApproach(sidesOf(pairing)), 0.5 * covered_);
  while (nearer < covered_ && !findUncovered(nearer)) {
    // Too much is near. Less is told then, and at last nothing.
    const double rest = covered_ - nearer;
    nearer = nearer < 0.5 * covered_     ? 0.5 * covered_
             : rest > 0x1p-10 * covered_ ? covered_ - 0.5 * rest
                                         : covered_;
  }
  const double wanted = covered_ - nearer;
  uncovered = withoutListed(pairing, std::move(uncovered));
  for (int side = 0; side <= second; ++side) {
    setAll(side, wanted);
  }
  for (std::size_t i = 0; i < uncovered.size(); i += kRun) {
    lowerByGaps(&uncovered[i], std::min(kRun, uncovered.size() - i));
  }

  parallel::forRanges(pairing.executor(), entries_.size(), kTask,
                      [&](std::size_t begin, std::size_t end) {
                        std::array<Pair, kRun> apart;
                        std::size_t count = 0;
                        for (std::size_t i = begin; i < end; ++i) {
                          const Entry& entry = entries_[i];
                          if (entry.slot < 0) {
                            apart[count++] = entry.pair;
                            __builtin_prefetch(&distances[0][placeOf(0, entry.pair.a)]);
                            if (!is_mesh)
                              __builtin_prefetch(&distances[second][placeOf(second, entry.pair.b)]);
                          } else if (!skips_touching) {
                            lowerBoth(entry.pair, 0);
                          }
                          if (count < kRun && i + 1 < end) continue;
                          lowerByGaps(apart.data(), count);
                          count = 0;
                        }
                      });
  for (const Entry& entry : inside_) lower(0, entry.pair.a, 0);
}

/// The segments that may go anywhere without a new touch of a mesh: those that do not meet it and,
/// on request, those that touch it already. Otherwise these could not slide from one triangle to
/// the next, or leave a solid.
SegmentFlags LiveList::freeOfMesh(const Pairing& pairing, bool skips_touching) const {
  SegmentFlags free(pairing.side(0).segments->begin(), pairing.side(0).segments->end());
  for (const SegmentId id : *pairing.side(0).order) free.set(id, !pairing.mayMeet(id));
  if (!skips_touching) return free;
  for (const Entry& entry : entries_) {
    if (entry.slot >= 0) free.set(entry.pair.a);
  }
  for (const Entry& entry : inside_) free.set(entry.pair.a);
  return free;
}

tree::Visit LiveList::handOn(index::PairSink& sink) const {
  index::SerialBuffer buffer(/*filter=*/nullptr, sink);
  for (const Entry& entry : entries_) {
    if (entry.slot < 0) continue;
    if (buffer.push(entry.pair.a, entry.pair.b) == tree::Visit::kStop) return tree::Visit::kStop;
  }
  return buffer.full();
}

std::size_t LiveList::memoryUsage() const {
  return entries_.capacity() * sizeof(Entry) +
         (inside_.capacity() + begun_.capacity() + ended_.capacity()) * sizeof(Entry) +
         free_.capacity() * sizeof(std::int32_t) + sides_.memoryUsage() + mesh_.memoryUsage() +
         anchors_[0].memoryUsage() + anchors_[1].memoryUsage();
}

}  // namespace fcl_fibers::live
