// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/shadow_gap.h"
#include "broadphase/shadow_record.h"
#include "joined_text.h"

namespace fcl_fibers::broadphase {

constexpr std::size_t kFirst = 0, kSecond = 1;
constexpr const char* kSides[] = {"the first manager", "the second manager"};

/// An object where it was, or null if that is not known.
using SeenObject = std::shared_ptr<const RecordedObject>;

/// An object of a query that is not of the manager that is asked.
struct ShadowPartner {
  bool is_moved = false;  ///< since its manager has read it
  bool rests = true;      ///< if not, the step of its manager began at `start`
  SeenObject start = nullptr;
};

/// What two managers were asked.
template <typename S>
struct ShadowQuery {
  RecordLine line;  ///< as in the record
  fcl::CollisionObject<S>* object;
  fcl::BroadPhaseCollisionManager<S>* other;
  std::unordered_map<const fcl::CollisionObject<S>*, ShadowPartner> partners = {};
  bool is_itself = false;
  std::size_t changes = 0;  ///< when it began

  bool isForDistances() const { return line.word[0] == 'd'; }
  bool isOf(const char* with) const { return line.word.find(with) != line.word.npos; }
};

/// What is known of an object, by its address.
template <typename S>
struct ShadowEntry {
  const fcl::CollisionObject<S>* object = nullptr;
  SeenObject now = nullptr;    ///< as last seen
  SeenObject start = nullptr;  ///< when the step began
  bool is_registered = false;
  bool is_moved = false;  ///< since it was registered or updated

  double number() const { return now->line.numbers[0]; }
};

/// A pair that managers have handed on.
template <typename S>
struct ShadowPair {
  const ShadowEntry<S>*a, *b;
  std::array<std::size_t, 2> counts;  ///< by each manager
};

/// The objects of two managers, as they were seen, and the record of all calls.
template <typename S>
class ShadowObjects {
 public:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Fibers = FiberCollisionManager<S>;
  using Entry = ShadowEntry<S>;
  using Query = ShadowQuery<S>;

  /// @param fibers  the managers that are one, else null; borrowed
  ShadowObjects(std::array<const Fibers*, 2> fibers, std::size_t record_limit)
      : fibers_(fibers), record_limit_(record_limit) {}

  Entry* find(const Object* object) {
    const auto found = entries_.find(object);
    return found == entries_.end() ? nullptr : &found->second;
  }

  Entry& see(Object* object) {
    const auto [place, is_new] = entries_.try_emplace(object);
    Entry& entry = place->second;
    const fcl::CollisionGeometry<S>* const geometry = object->collisionGeometry().get();
    auto& shape = shapes_[geometry];
    RecordLine line = readShape(geometry);
    if (shape != nullptr) line.numbers[0] = shape->line.numbers[0];
    if (shape == nullptr || !(shape->line == line)) {
      line.numbers[0] = shape_count_++;
      append(line);
      shape = std::make_shared<const RecordedShape>(RecordedShape{std::move(line)});
    }
    RecordedObject now = readObject(*object, is_new ? object_count_++ : entry.number(), shape);
    if (!is_new && entry.now->line == now.line) return entry;
    append(now.line);
    for (const std::size_t side : {kFirst, kSecond}) {
      if (fibers_[side] == nullptr) continue;
      try {
        now.margins[side] = fibers_[side]->margin(object);
      } catch (const std::exception&) {
        now.margins[side] = std::numeric_limits<double>::quiet_NaN();
      }
    }
    for (std::size_t i = kBox; i < kEnd; ++i) {
      // FCL's boxes of planes end at the largest number.
      const double far = std::fabs(now.line.numbers[i]);
      if (far < std::numeric_limits<S>::max() / 2) extent_ = std::max(extent_, 2 * far);
    }
    entry.object = object;
    entry.now = std::make_shared<const RecordedObject>(std::move(now));
    entry.is_moved = !is_new;
    return entry;
  }
  void seeKnown(const Objects& objects) {
    for (Object* object : objects) {
      if (find(object) != nullptr) see(object);
    }
  }

  /// Takes over what a change means for the objects, of which the managers have `size` now.
  void note(const std::string& call, const Objects& objects, std::size_t size) {
    if (call == "beginStep" || call == "endStep" || call == "clear") {
      is_step_ = call == "beginStep";
      for (auto& [object, entry] : entries_) entry.start = entry.is_moved ? nullptr : entry.now;
    }
    if (call == "clear" || call == "update") {
      for (auto& [object, entry] : entries_) {
        entry.is_moved = false;
        entry.is_registered = entry.is_registered && call != "clear";
      }
    }
    const bool registers = call.substr(0, 8) == "register";
    for (const Object* object : objects) {
      Entry* const entry = find(object);
      if (entry == nullptr) continue;
      entry->is_moved = false;
      if (!registers && call != "unregisterObject") continue;
      entry->is_registered = registers;
      entry->start = nullptr;  // The manager has yet to read it.
    }
    // Others may be gone. They are written again when they are met again.
    if (entries_.size() + shapes_.size() < 8 * size + 4096) return;
    eraseIf(entries_, [](const Entry& entry) { return !entry.is_registered; });
    eraseIf(shapes_, [](const auto& shape) { return shape.use_count() == 1; });
  }

  ShadowPartner asPartner(const Object* object) const {
    const Entry& entry = entries_.at(object);
    return {entry.is_moved, !is_step_, entry.start};
  }

  /// Whether both are where they were updated, and no option of a manager leaves the pair out.
  bool isDecided(const Query& query, const Entry& p, const Entry& q) const {
    for (const Entry* entry : {&p, &q}) {
      const auto partner = query.partners.find(entry->object);
      const bool is_moved_there = partner != query.partners.end() && partner->second.is_moved;
      if ((entry->is_moved && entry->is_registered) || is_moved_there) return false;
    }
    return std::none_of(fibers_.begin(), fibers_.end(), [&](const Fibers* fibers) {
      if (fibers == nullptr) return false;
      if (!fibers->isRegistered(p.object) || !fibers->isRegistered(q.object)) return false;
      const FiberSegment a = fibers->fiberSegment(p.object), b = fibers->fiberSegment(q.object);
      const auto neighbors = std::size_t(fibers->options().ignored_neighbors);
      const auto [low, high] = std::minmax(a.number, b.number);
      return a.fiber == b.fiber &&
             (fibers->options().ignored_arc_length > 0 || high - low <= neighbors ||
              low < neighbors);  // The fiber may be a ring.
    });
  }

  /// The gap of two objects at the end of the step.
  Gap gapOf(const Query& query, const Entry& a, const Entry& b) const {
    return isDecided(query, a, b) ? gapBetween(*a.now, *b.now, kIsFloat) : Gap();
  }

  /// Returns what is wrong with a pair, empty if nothing is, or `kUndecided`.
  std::string judge(const Query& query, const ShadowPair<S>& pair, bool is_stopped) const;
  static constexpr char kUndecided[] = "undecided";

  void append(const RecordLine& line) {
    if (bytes_ > record_limit_) return;
    lines_.push_back(line.text());
    bytes_ += sizeof(std::string) + lines_.back().size();
  }

  /// Writes the record. Throws std::runtime_error if that fails.
  /// @param difference  that it is written for, or empty
  void write(const std::string& path, const std::string& first, const std::string& second,
             const std::string& difference) const {
    const std::string draft = path + ".part";
    std::ofstream file(draft, std::ios::binary);
    file << kRecordHead << '\n'
         << (kIsFloat ? "float\n" : "double\n") << first << '\n'
         << second << '\n';
    for (const std::string& line : lines_) file << line << '\n';
    if (bytes_ > record_limit_) file << kLimit << '\n';
    if (!difference.empty()) file << "difference " << difference << '\n';
    file << "end\n";
    file.close();
    std::error_code error;
    if (file) std::filesystem::rename(draft, path, error);
    if (file && !error) return;
    std::filesystem::remove(draft, error);
    throw std::runtime_error(path +
                             ": the record cannot be written; check the folder and its space");
  }

 private:
  static constexpr bool kIsFloat = std::is_same_v<S, float>;

  template <class Map, class IsUnused>
  static void eraseIf(Map& map, IsUnused isUnused) {
    for (auto at = map.begin(); at != map.end();) {
      at = isUnused(at->second) ? map.erase(at) : std::next(at);
    }
  }

  /// Where an object was when the step began, null if that is not known. What has no step rests.
  const RecordedObject* startOf(const Query& query, const Entry& entry) const {
    const auto found =
        query.other == nullptr ? query.partners.end() : query.partners.find(entry.object);
    const bool is_partner = found != query.partners.end();
    const bool moves = entry.is_registered && is_step_,
               moves_there = is_partner && !found->second.rests;
    if (moves ? is_partner : moves_there && entry.is_registered) return nullptr;  // Which counts?
    return moves ? entry.start.get() : moves_there ? found->second.start.get() : entry.now.get();
  }

  const std::array<const Fibers*, 2> fibers_;
  const std::size_t record_limit_;
  std::deque<std::string> lines_;  // Of the record.
  std::size_t bytes_ = 0;          // Of these lines.
  std::unordered_map<const Object*, Entry> entries_;
  std::unordered_map<const void*, std::shared_ptr<const RecordedShape>> shapes_;
  double object_count_ = 0, shape_count_ = 0;
  double extent_ = 0;  // Twice the largest coordinate of a box so far.
  bool is_step_ = false;
};

template <typename S>
std::string ShadowObjects<S>::judge(const Query& query, const ShadowPair<S>& pair,
                                    bool is_stopped) const {
  const Entry &a = *pair.a, &b = *pair.b;
  const std::array<std::size_t, 2>& counts = pair.counts;
  const bool is_in_both = query.isOf("Manager") && a.is_registered && b.is_registered &&
                          query.partners.count(a.object) + query.partners.count(b.object) == 2;
  // FCL's tree pairs both orders if it is asked for itself.
  const std::size_t most[] = {is_in_both || query.is_itself ? 2U : 1U, is_in_both ? 2U : 1U};
  const auto isFew = [&](std::size_t side) {
    return counts[side] > 0 && counts[side] <= most[side];
  };
  if (isFew(kFirst) && isFew(kSecond)) return {};
  if (!isDecided(query, a, b)) return kUndecided;
  const RecordedObject &p = *a.now, &q = *b.now;
  const RecordedObject *p_start = startOf(query, a), *q_start = startOf(query, b);
  const bool is_known = p_start != nullptr && q_start != nullptr;
  const bool rests = p_start == &p && q_start == &q;
  const Gap at_end = gapBetween(p, q, kIsFloat);
  const double apart = std::max((p.low() - q.high()).maxCoeff(), (q.low() - p.high()).maxCoeff());
  const double rounding = 16 * double{std::numeric_limits<S>::epsilon()} * extent_;
  const bool boxes_meet = apart < -rounding, is_round = p.shape->isRound() && q.shape->isRound();
  // What was added to one side of a box alone is met only there.
  const bool is_even = is_round && p.isEvenlyWidened(rounding) && q.isEvenlyWidened(rounding);
  bool is_decided = true;
  for (const std::size_t side : {kFirst, kSecond}) {
    const Fibers* const fibers = fibers_[side];
    const FiberManagerOptions options =
        fibers == nullptr ? FiberManagerOptions() : fibers->options();
    const bool is_by_box = fibers != nullptr && options.bounds == Bounds::kObjects;
    const bool moves = options.motion && !rests;
    double added = p.margins[side] + q.margins[side];
    const double sure = options.margin + (is_even ? added : 0);
    const bool must_at_end = at_end.high <= (boxes_meet ? sure : is_by_box ? -kInfinity : 0);
    Gap gap = at_end;
    if (moves) {
      gap = is_known ? gapBetween(*p_start, p, *q_start, q, kIsFloat) : Gap();
      const double before = is_known ? p_start->margins[side] + q_start->margins[side] : added;
      if (!(before <= added)) added = before;  // Also if it is NaN.
    }
    const bool must = must_at_end || (moves && !is_by_box && gap.high <= 0);
    // A widened box of a capsule counts alone in a step.
    const bool is_exact = options.report == Report::kCapsules && !is_by_box && is_round &&
                          !(options.motion && added > 0);
    const double reach = options.margin + added;
    const bool may = (fibers == nullptr && side == kFirst) ||
                     !(is_exact ? gap.low > reach : gap.volumes > reach + 0x1p-20 * extent_);
    const char* problem = nullptr;
    if (counts[side] > most[side] && (side == kSecond || at_end.high <= 0)) {
      problem = " hands on more than once";
    } else if (counts[side] == 0 && must && !(side == kFirst && is_stopped)) {
      problem = " does not hand on";
    } else if (counts[side] > 0 && !may) {
      problem = " hands on, although it is too far apart,";
    }
    if (problem != nullptr) {
      return joinedText(
          kSides[side], problem, " the pair of the objects ", a.number(), " and ", b.number(),
          gap.high <= 0 ? "; they touch" : "", "; their surfaces are ", gap.low, " to ", gap.high,
          " apart", moves ? " in the step" : "", "; their boxes ",
          apart <= 0 ? "overlap" : "do not overlap: is computeAABB() missing?", "; object ",
          a.number(), ": ", p.describe(), "; object ", b.number(), ": ", q.describe());
    }
    is_decided = is_decided && (is_known || !moves);
  }
  return is_decided ? std::string() : kUndecided;
}

}  // namespace fcl_fibers::broadphase
