// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/shadow_manager.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <unordered_map>
#include <utility>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "broadphase/recorded_object.h"
#include "broadphase/shadow_record.h"
#include "joined_text.h"

namespace fcl_fibers {
namespace {

using namespace broadphase;
using Lock = std::lock_guard<std::mutex>;
using Side = std::size_t;  // kFirst or kSecond
constexpr Side kFirst = 0, kSecond = 1;
constexpr const char* kSides[] = {"the first manager", "the second manager"};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Seconds of the life of this object.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// What a call throws, in words; empty if it does not.
template <class F>
std::string problemOf(F f) {
  try {
    f();
    return {};
  } catch (const std::exception& error) {
    return joinedText("the second manager throws: ", error.what());
  } catch (...) {
    return "the second manager throws what is no std::exception";
  }
}

}  // namespace

template <typename S>
class ShadowManager<S>::Impl {
 public:
  using Fibers = FiberCollisionManager<S>;
  using Objects = std::vector<Object*>;

  /// What is known of an object, by its address.
  struct Entry {
    std::size_t number = 0;    // In the record.
    RecordedState now, read;   // As last seen, and as at its last update.
    std::size_t sequence = 0;  // Of registering, from 1; 0 if it is not registered.
    struct {
      std::size_t number = 0, place = 0, size = 0;  // The number is from 1.
      bool is_ring = false;
    } fiber;
    std::array<double, 2> margins{-1, -1};  // As each manager counts it; negative if unknown.

    bool isRead() const { return isSame(now, read); }
  };

  struct Query {
    With with;
    Object* object;
    Manager* other;
    std::string call = {};  // As in the record.
    // Objects that are not this manager's, and whether they are where they were read.
    std::unordered_map<const Object*, bool> partners = {};
    bool is_itself = false;
    std::size_t changes = 0;  // When it began.

    /// Passes on the arguments of a query, with another manager of this side.
    template <class Callback>
    void ask(const Manager& manager, Side side, void* data, Callback callback) const {
      const auto pass = [&](auto... to) {
        if constexpr (std::is_same_v<Callback, fcl::CollisionCallBack<S>>) {
          manager.collide(to..., data, callback);
        } else {
          manager.distance(to..., data, callback);
        }
      };
      const auto* const shadow = dynamic_cast<const ShadowManager*>(other);
      Manager* const to = shadow == nullptr ? other : shadow->impl()->sides_[side].manager.get();
      if (with == With::kSelf) return pass();
      if (with == With::kObject) return pass(object);
      const bool is_fibers = dynamic_cast<const Fibers*>(&manager) != nullptr;
      if (side == kFirst || to == nullptr || is_fibers || typeid(*to) == typeid(manager)) {
        return pass(to);
      }
      // FCL's managers cast the other one to their own class.
      Objects objects;
      to->getObjects(objects);
      for (Object* one : objects) pass(one);
    }
  };

  /// Takes the pairs of one manager in one query.
  template <class Callback>
  struct Watch {
    Impl* impl;
    const Query* query;
    Callback callback;  // The program's, for the first manager only.
    void* cdata;

    std::vector<std::pair<const Object*, const Object*>> pairs = {};
    bool is_stopped = false;  // By the program's callback, also if that threw.
    double seconds = 0;       // That were not spent in the manager.
    Gap least = {kInfinity, kInfinity};
    S left = std::numeric_limits<S>::max();  // The distance that the callbacks left.

    bool visit(Object* a, Object* b, S* dist) {
      const Stopwatch time;
      impl->guard([&] {
        pairs.emplace_back(a, b);
        if (dist != nullptr) measure(a, b, *dist);
        if (dist == nullptr && query->with == With::kObject) impl->see({a, b});
      });
      bool stops = dist != nullptr && *dist <= 0;
      if (callback != nullptr) {
        is_stopped = true;
        if constexpr (std::is_same_v<Callback, fcl::CollisionCallBack<S>>) {
          is_stopped = stops = callback(a, b, cdata);
        } else {
          is_stopped = stops = callback(a, b, cdata, *dist);
        }
      }
      if (dist != nullptr) left = *dist;
      seconds += time.seconds();
      return stops;
    }
    void measure(Object* a, Object* b, S& dist) {
      const Gap gap = impl->measured(*query, a, b);
      if (!(gap.high < kInfinity)) return;
      least = {std::min(least.low, gap.low), std::min(least.high, gap.high)};
      const auto distance = static_cast<S>(std::max(0.0, (gap.low + gap.high) / 2));
      if (callback == nullptr && distance < dist) dist = distance;
    }
    static bool collided(Object* a, Object* b, void* watch) {
      return static_cast<Watch*>(watch)->visit(a, b, nullptr);
    }
    static bool measuredPair(Object* a, Object* b, void* watch, S& dist) {
      return static_cast<Watch*>(watch)->visit(a, b, &dist);
    }
    static Callback own(fcl::CollisionCallBack<S>) { return &Watch::collided; }
    static Callback own(fcl::DistanceCallBack<S>) { return &Watch::measuredPair; }

    /// Asks a manager. Without a callback of the program there is none at all.
    double ask(const Manager& manager, Side side, bool has_callback) {
      const Stopwatch time;
      query->ask(manager, side, has_callback ? this : nullptr,
                 has_callback ? own(callback) : nullptr);
      return time.seconds() - seconds;
    }
  };

  Impl(std::unique_ptr<Manager> first, std::unique_ptr<Manager> second, ShadowOptions options)
      : options_(std::move(options)) {
    sides_[kFirst].manager = std::move(first);
    sides_[kSecond].manager = std::move(second);
    for (const Side side : {kFirst, kSecond}) {
      const Manager* const manager = sides_[side].manager.get();
      if (manager == nullptr || manager->size() > 0) {
        throw std::invalid_argument(joinedText("ShadowManager: ", kSides[side],
                                               " is null or has objects; pass an empty manager"));
      }
      sides_[side].fibers = dynamic_cast<const Fibers*>(manager);
    }
  }

  const Manager& manager(Side side) const { return *sides_[side].manager; }

  ShadowResult result() const {
    const Lock lock(mutex_);
    return result_;
  }

  void writeRecord(const std::string& path) const {
    const Lock lock(mutex_);
    write(path);
  }

  /// Makes the change in the first manager, and if that takes it in the second.
  void change(std::string_view call, const Objects& objects) {
    std::string line(call);
    guard([&] {
      const Lock lock(mutex_);
      if (call == "update") seeAll();
      for (Object* object : objects) {
        // What is unregistered may be gone.
        if (call != "unregisterObject" && object != nullptr) seeObject(object);
        line += " " + nameOf(object);
      }
    });
    const auto make = [&](Side side) {
      const Stopwatch time;
      makeChange<S>(*sides_[side].manager, call, objects);
      return time.seconds();
    };
    const double first_seconds = make(kFirst);
    double second_seconds = 0;
    const std::string problem = problemOf([&] {
      if (!is_lost_) second_seconds = make(kSecond);
    });
    guard([&] {
      const Lock lock(mutex_);
      ++result_.changes;
      result_.first.seconds += first_seconds;
      result_.second.seconds += second_seconds;
      record_.append(line);
      note(call, objects);
      if (!problem.empty()) {
        is_lost_ = true;
        differ(line, problem);
      } else if (running_ > 0 && sides_[kSecond].fibers != nullptr && !is_lost_) {
        differ(line, "a callback changes the manager, which FiberCollisionManager refuses");
      }
      shorten();
    });
    tell();
  }

  template <class Callback>
  void query(const char* call, Query query, void* cdata, Callback callback) {
    guard([&] { prepare(call, query); });
    // FCL's managers crash if they are given null.
    const bool is_null = callback == nullptr ||
                         (query.with == With::kObject && query.object == nullptr) ||
                         (query.with == With::kManager && query.other == nullptr);
    const bool asks = !is_lost_ && (!is_null || sides_[kSecond].fibers != nullptr);
    Watch<Callback> first{this, &query, callback, cdata}, second{this, &query, nullptr, nullptr};
    double first_seconds = 0, second_seconds = 0;
    // The second one comes first, because a callback may move objects.
    const std::string problem = problemOf([&] {
      if (asks) second_seconds = second.ask(manager(kSecond), kSecond, callback != nullptr);
    });
    const auto finish = [&] {
      guard([&] {
        const Lock lock(mutex_);
        ++result_.queries;
        result_.first.seconds += first_seconds;
        result_.second.seconds += second_seconds;
        result_.first.pairs += first.pairs.size();
        result_.second.pairs += second.pairs.size();
        record_.append(first.is_stopped ? joinedText(query.call, " stopped ", first.pairs.size())
                                        : query.call);
        if (!problem.empty()) {
          differ(query.call, problem);
        } else if (asks && query.changes == result_.changes && !is_broken_) {
          compare(query, first, second);
        }
        shorten();
      });
      tell();
    };
    ++running_;
    try {
      first_seconds = first.ask(manager(kFirst), kFirst, callback != nullptr);
      --running_;
    } catch (...) {
      --running_;
      if (first.is_stopped) finish();  // What it refuses by itself is not compared.
      throw;
    }
    finish();
  }

 private:
  struct Sided {
    std::unique_ptr<Manager> manager;
    const Fibers* fibers = nullptr;  // The manager, if it is one.
  };

  // --- What is known of the objects. The mutex is locked in all that follows.

  Entry& seeObject(Object* object) {
    const auto [place, is_new] = entries_.try_emplace(object);
    Entry& entry = place->second;
    if (is_new) entry.number = object_count_++;
    RecordedState state;
    state.shape = seeShape(object->collisionGeometry().get());
    const auto& pose = object->getTransform();
    for (std::size_t i = 0; i < 12; ++i) {
      state.pose[i] = double{pose(static_cast<int>(i / 4), static_cast<int>(i % 4))};
    }
    for (std::size_t i = 0; i < 6; ++i) {
      const auto& box = object->getAABB();
      state.box[i] = double{(i < 3 ? box.min_ : box.max_)[static_cast<int>(i % 3)]};
      const double far = std::fabs(state.box[i]);
      // FCL's boxes of planes end at the largest number.
      if (far < std::numeric_limits<S>::max() / 2) extent_ = std::max(extent_, 2 * far);
    }
    if (is_new || !isSame(entry.now, state)) {
      entry.now = state;
      if (is_new) entry.read = state;
      entry.margins = {-1, -1};
      record_.append(objectLine(entry.number, state));
    }
    return entry;
  }

  std::shared_ptr<const RecordedShape> seeShape(const fcl::CollisionGeometry<S>* geometry) {
    auto& known = shapes_[geometry];
    RecordedShape shape = recordedShape(geometry);
    if (known == nullptr || !isSame(*known, shape)) {
      shape.number = shape_count_++;
      record_.append(shapeLine(shape));
      known = std::make_shared<const RecordedShape>(std::move(shape));
    }
    return known;
  }

  void seeAll() {
    for (const auto& [sequence, object] : registered_) seeObject(object);
    is_dirty_ = false;
  }

  void see(std::initializer_list<Object*> objects) {
    const Lock lock(mutex_);
    for (Object* object : objects) {
      if (entries_.count(object) > 0) seeObject(object);
    }
  }

  /// Takes over what a change means for the objects.
  void note(std::string_view call, const Objects& objects) {
    if (call == "clear") {
      while (!registered_.empty()) forget(registered_.begin()->second);
    }
    if (call == "update") {
      for (const auto& [sequence, object] : registered_) setRead(object);
    }
    const bool is_ring = call == "registerRing", is_fiber = is_ring || call == "registerFiber";
    const bool is_new = call.substr(0, 8) == "register";
    is_dirty_ = is_dirty_ || is_new;
    fiber_count_ += is_fiber;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (objects[i] == nullptr) continue;
      if (is_new || call == "unregisterObject") forget(objects[i]);
      if (call == "unregisterObject") continue;
      Entry& entry = setRead(objects[i]);
      if (!is_new) continue;
      entry.sequence = ++sequence_;
      registered_[entry.sequence] = objects[i];
      if (is_fiber) entry.fiber = {fiber_count_, i, objects.size(), is_ring};
    }
    if (entries_.size() + shapes_.size() > 8 * registered_.size() + 4096) forgetUnused();
  }

  Entry& setRead(const Object* object) {
    Entry& entry = entries_.at(object);
    entry.read = entry.now;
    return entry;
  }

  void forget(const Object* object) {
    const auto found = entries_.find(object);
    if (found == entries_.end()) return;
    registered_.erase(found->second.sequence);
    found->second.sequence = 0;
    found->second.fiber = {};
  }

  /// Forgets objects that are not registered, which may be gone. They are written again when they
  /// are met again.
  void forgetUnused() {
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      entry = entry->second.sequence > 0 ? std::next(entry) : entries_.erase(entry);
    }
    for (auto shape = shapes_.begin(); shape != shapes_.end();) {
      shape = shape->second.use_count() > 1 ? std::next(shape) : shapes_.erase(shape);
    }
  }

  std::string nameOf(const Object* object) const {
    const auto found = entries_.find(object);
    return found == entries_.end() ? "unknown" : std::to_string(found->second.number);
  }

  /// The objects of a manager, and whether they are where it has read them.
  static std::vector<std::pair<Object*, bool>> objectsOf(const Manager& manager) {
    std::vector<std::pair<Object*, bool>> found;
    if (const auto* shadow = dynamic_cast<const ShadowManager*>(&manager)) {
      Impl& impl = *shadow->impl();
      const Lock lock(impl.mutex_);
      impl.seeAll();
      for (const auto& [sequence, object] : impl.registered_) {
        found.emplace_back(object, impl.entries_.at(object).isRead());
      }
      return found;
    }
    Objects objects;
    manager.getObjects(objects);
    for (Object* object : objects) {
      if (object != nullptr) found.emplace_back(object, true);
    }
    return found;
  }

  void prepare(const char* call, Query& query) {
    const auto* const shadow = dynamic_cast<const ShadowManager*>(query.other);
    query.is_itself = shadow != nullptr && shadow->impl().get() == this;
    std::vector<std::pair<Object*, bool>> partners;
    if (query.other != nullptr && !query.is_itself) partners = objectsOf(*query.other);
    if (query.object != nullptr) partners.emplace_back(query.object, true);
    const Lock lock(mutex_);
    if (query.with != With::kObject || is_dirty_) seeAll();
    query.changes = result_.changes;
    constexpr const char* kWith[] = {" self", " object", " manager"};
    query.call = call;
    query.call += query.is_itself ? " itself" : kWith[static_cast<int>(query.with)];
    for (const auto& [object, is_read] : partners) {
      query.partners[object] = is_read;
      query.call += " " + std::to_string(seeObject(object).number);
    }
  }

  // --- What is compared.

  bool isDecided(const Query& query, const Object* object, const Entry& entry) const {
    const auto partner = query.partners.find(object);
    return (entry.sequence == 0 || entry.isRead()) &&
           (partner == query.partners.end() || partner->second);
  }

  /// Whether a manager's options leave the pair out.
  bool isIgnored(const Entry& a, const Entry& b, bool is_in_both) const {
    const auto &p = a.fiber, &q = b.fiber;
    if (!is_in_both && (p.number == 0 || p.number != q.number)) return false;
    const std::size_t along = p.place < q.place ? q.place - p.place : p.place - q.place;
    const std::size_t apart = p.is_ring ? std::min(along, p.size - along) : along;
    return std::any_of(sides_.begin(), sides_.end(), [&](const Sided& side) {
      if (side.fibers == nullptr) return false;
      const FiberManagerOptions& options = side.fibers->options();
      const auto neighbors = static_cast<std::size_t>(options.ignored_neighbors);
      return options.ignored_arc_length > 0 || (is_in_both && neighbors > 0) || apart <= neighbors;
    });
  }

  /// What the manager's margins add to the pair. NaN if they cannot be read.
  double reachOf(Side side, Entry& a, Entry& b) const {
    const Fibers* const fibers = sides_[side].fibers;
    if (fibers == nullptr) return 0;
    for (Entry* entry : {&a, &b}) {
      double& margin = entry->margins[side];
      if (!(margin < 0)) continue;
      margin = std::numeric_limits<double>::quiet_NaN();
      problemOf([&] {  // The program's object may be gone by now.
        const RecordedObject<S> copy(makeShape<S>(*entry->now.shape), entry->now);
        margin = fibers->margin(&copy);
      });
    }
    return fibers->options().margin + a.margins[side] + b.margins[side];
  }

  /// Whether the manager has to hand on this pair.
  bool promises(Side side, const Gap& gap, double reach, const Entry& a, const Entry& b) const {
    const Fibers* const fibers = sides_[side].fibers;
    const bool boxes_meet = boxesApart(a.now.box, b.now.box) <
                            -16 * double{std::numeric_limits<S>::epsilon()} * extent_;
    if (fibers != nullptr && fibers->options().bounds == Bounds::kObjects && !boxes_meet) {
      return false;
    }
    return gap.high <= 0 || (gap.high <= reach && boxes_meet);
  }

  /// Whether it may hand on this pair. The program's manager may hand on any, if it is FCL's.
  bool allows(Side side, const Gap& gap, double reach, const Entry& a, const Entry& b) const {
    const Fibers* const fibers = sides_[side].fibers;
    if (fibers == nullptr && side == kFirst) return true;
    const RecordedBox p = hullOf(a.now), q = hullOf(b.now);
    double apart = boxesApart(p, q);
    if (fibers != nullptr) {
      const FiberManagerOptions& options = fibers->options();
      if (options.motion) return true;
      const bool is_round = a.now.shape->isRound() && b.now.shape->isRound();
      if (options.report == Report::kCapsules && is_round && options.bounds != Bounds::kObjects) {
        return !(gap.low > reach);
      }
      if (dynamic_cast<const LayeredAABBTreeCollisionManager<S>*>(fibers) == nullptr) {
        double centers = 0, radii = 0;  // Of balls around the boxes.
        for (std::size_t i = 0; i < 3; ++i) {
          centers = std::hypot(centers, (p[i] + p[3 + i] - q[i] - q[3 + i]) / 2);
          radii = std::hypot(radii, p[3 + i] - p[i] + q[3 + i] - q[i]);
        }
        apart = centers - radii;
      }
    }
    return !(apart > reach + 0x1p-20 * extent_);
  }

  using Collisions = Watch<fcl::CollisionCallBack<S>>;
  using Distances = Watch<fcl::DistanceCallBack<S>>;

  void compare(const Query& query, const Collisions& first, const Collisions& second) {
    struct Pair {
      const Object *a, *b;
      std::array<std::size_t, 2> counts{};
    };
    std::map<std::pair<std::size_t, std::size_t>, Pair> pairs;  // By the numbers of the objects.
    for (const Collisions* watch : {&first, &second}) {
      const Side side = watch == &first ? kFirst : kSecond;
      for (const auto& [a, b] : watch->pairs) {
        const bool is_asked = a != b && asksFor(query, a, b);
        if (is_asked) {
          std::pair numbers(entries_.at(a).number, entries_.at(b).number);
          const bool is_swapped = numbers.first > numbers.second;
          if (is_swapped) std::swap(numbers.first, numbers.second);
          ++pairs.try_emplace(numbers, Pair{is_swapped ? b : a, is_swapped ? a : b})
                .first->second.counts[side];
        }
        if (is_asked || side == kFirst) continue;  // FCL pairs an object with itself.
        return differ(query.call,
                      joinedText("the second manager hands on a pair that is not asked for: ",
                                 nameOf(a), " and ", nameOf(b)));
      }
    }
    for (const auto& [numbers, pair] : pairs) {
      comparePair(query, pair.a, pair.b, pair.counts, first.is_stopped);
    }
  }

  bool asksFor(const Query& query, const Object* a, const Object* b) const {
    const auto isManaged = [&](const Object* object) {
      const auto found = entries_.find(object);
      return found != entries_.end() && found->second.sequence > 0;
    };
    const auto isPartner = [&](const Object* object) { return query.partners.count(object) > 0; };
    if (query.with == With::kSelf || query.is_itself) return isManaged(a) && isManaged(b);
    return (isManaged(a) && isPartner(b)) || (isManaged(b) && isPartner(a));
  }

  void comparePair(const Query& query, const Object* p, const Object* q,
                   const std::array<std::size_t, 2>& counts, bool is_stopped) {
    Entry &a = entries_.at(p), &b = entries_.at(q);
    const bool is_in_both = query.with == With::kManager && a.sequence > 0 && b.sequence > 0 &&
                            query.partners.count(p) > 0 && query.partners.count(q) > 0;
    // FCL's tree pairs both orders if it is asked for itself.
    const std::size_t most[] = {is_in_both || query.is_itself ? 2U : 1U, is_in_both ? 2U : 1U};
    const auto isFew = [&](Side side) { return counts[side] > 0 && counts[side] <= most[side]; };
    if (isFew(kFirst) && isFew(kSecond)) return;
    if (!isDecided(query, p, a) || !isDecided(query, q, b) || isIgnored(a, b, is_in_both)) {
      ++result_.undecided;
      return;
    }
    const double reaches[] = {reachOf(kFirst, a, b), reachOf(kSecond, a, b)};
    const Gap gap = gapBetween(a.now, b.now, kIsFloat, std::fmax(reaches[0], reaches[1]));
    for (const Side side : {kFirst, kSecond}) {
      const char* problem = nullptr;
      if (counts[side] > most[side] && (side == kSecond || gap.high <= 0)) {
        problem = " hands on more than once";
      } else if (counts[side] == 0 && !(side == kFirst && is_stopped) &&
                 promises(side, gap, reaches[side], a, b)) {
        problem = " does not hand on";
      } else if (counts[side] > 0 && !allows(side, gap, reaches[side], a, b)) {
        problem = " hands on, although it is too far apart,";
      }
      if (problem == nullptr) continue;
      const bool boxes_meet = boxesApart(a.now.box, b.now.box) <= 0;
      return differ(
          query.call,
          joinedText(
              kSides[side], problem, " the pair of the objects ", a.number, " and ", b.number,
              gap.high <= 0 ? "; they touch, and their surfaces are " : "; their surfaces are ",
              std::isfinite(gap.low) ? gap.low : gap.high, " apart",
              boxes_meet ? "" : "; their boxes do not overlap",
              boxes_meet || gap.high > 0
                  ? ""
                  : ", so the program made them smaller or did not call computeAABB()",
              "; object ", a.number, ": ", describe(a.now), "; object ", b.number, ": ",
              describe(b.now)));
    }
  }

  /// The distance of a pair, as far as it decides anything.
  Gap measured(const Query& query, const Object* a, const Object* b) {
    const Lock lock(mutex_);
    const auto p = entries_.find(a), q = entries_.find(b);
    if (p == entries_.end() || q == entries_.end() || a == b || !isDecided(query, a, p->second) ||
        !isDecided(query, b, q->second) || isIgnored(p->second, q->second, false)) {
      return {-kInfinity, kInfinity};
    }
    return gapBetween(p->second.now, q->second.now, kIsFloat, kInfinity);
  }

  void compare(const Query& query, const Distances& first, const Distances& second) {
    const double pruned = std::min(first.least.low, double{first.left});
    const auto tell = [&](Side side, double own, double other) {
      differ(query.call, joinedText(kSides[side], " finds no pair nearer than ", own, ", but ",
                                    kSides[1 - side], " finds one at ", std::max(0.0, other)));
    };
    if (first.least.high < second.least.low && second.least.low > 0) {
      tell(kSecond, second.least.low, first.least.high);
    } else if (!first.is_stopped && second.least.high < pruned) {
      tell(kFirst, pruned, second.least.high);
    }
  }

  // --- The record and the result.

  void differ(const std::string& call, const std::string& problem) {
    if (result_.differences++ > 0) return;
    must_tell_ = true;
    result_.difference = joinedText("call ", result_.changes + result_.queries, ", ",
                                    call.substr(0, 80), ": ", problem);
    std::replace(result_.difference.begin(), result_.difference.end(), '\n', ' ');
    if (options_.file.empty()) return;
    std::string path = options_.file;
    for (int i = 2; std::filesystem::exists(path); ++i) path = joinedText(options_.file, "-", i);
    write(path);
    result_.file = path;
  }

  void write(const std::string& path) const {
    const std::string& difference = result_.difference;
    record_.write(
        path,
        joinedText(kRecordHead, "\nscalar ", kIsFloat ? "float" : "double", "\nfirst ",
                   managerLine(manager(kFirst)), "\nsecond ", managerLine(manager(kSecond)), "\n"),
        difference.empty() ? "" : "difference " + difference + "\n");
  }

  /// Begins the record anew if it is too long.
  void shorten() {
    if (record_.bytes() <= std::max(options_.record_limit, least_bytes_)) return;
    record_.clear();
    record_.append("snapshot");
    forgetUnused();
    std::set<std::shared_ptr<const RecordedShape>> written;
    std::size_t fiber = 0;
    std::vector<std::string> lines;
    for (const auto& [sequence, object] : registered_) {
      Entry& entry = entries_.at(object);
      if (written.insert(entry.now.shape).second) record_.append(shapeLine(*entry.now.shape));
      record_.append(objectLine(entry.number, entry.now));
      if (lines.empty() || entry.fiber.number != fiber) {
        fiber = entry.fiber.number;
        lines.push_back(fiber == 0            ? "registerObjects"
                        : entry.fiber.is_ring ? "registerRing"
                                              : "registerFiber");
      }
      lines.back() += " " + std::to_string(entry.number);
    }
    for (const std::string& call : lines) record_.append(call);
    least_bytes_ = 2 * record_.bytes();
  }

  /// Runs what serves the comparison alone, whose failure must not reach the program.
  template <class F>
  void guard(F f) noexcept {
    try {
      if (!is_broken_) f();
    } catch (const std::exception& error) {
      const Lock lock(mutex_);
      is_broken_ = true;
      result_.problem = error.what();
    }
  }

  void tell() {
    if (must_tell_.exchange(false) && options_.on_difference != nullptr) {
      options_.on_difference(result());
    }
  }

  static constexpr bool kIsFloat = std::is_same_v<S, float>;
  const ShadowOptions options_;
  std::array<Sided, 2> sides_;

  std::atomic<int> running_{0};         // Queries of the first manager.
  std::atomic<bool> is_lost_{false};    // Whether the second manager has missed a change.
  std::atomic<bool> is_broken_{false};  // Whether nothing is compared any more.
  std::atomic<bool> must_tell_{false};
  mutable std::mutex mutex_;  // Of all below.
  ShadowResult result_;
  Record record_{options_.record_limit > 0};
  std::unordered_map<const Object*, Entry> entries_;
  std::map<std::size_t, Object*> registered_;  // By sequence.
  std::unordered_map<const void*, std::shared_ptr<const RecordedShape>> shapes_;
  std::size_t sequence_ = 0, fiber_count_ = 0, object_count_ = 0, shape_count_ = 0;
  std::size_t least_bytes_ = 0;  // Of a record that is begun anew.
  double extent_ = 0;            // Twice the largest coordinate of a box so far.
  bool is_dirty_ = false;        // Whether the next query reads all objects.
};

template <typename S>
ShadowManager<S>::ShadowManager(std::unique_ptr<Manager> first, const FiberManagerOptions& options,
                                ShadowOptions shadow_options)
    : ShadowManager(std::move(first), std::make_unique<LayeredAABBTreeCollisionManager<S>>(options),
                    std::move(shadow_options)) {}

template <typename S>
ShadowManager<S>::ShadowManager(std::unique_ptr<Manager> first, std::unique_ptr<Manager> second,
                                ShadowOptions options)
    : impl_(std::make_shared<Impl>(std::move(first), std::move(second), std::move(options))) {}

// FCL's base class is not moved, because nothing uses its members.
template <typename S>
ShadowManager<S>::ShadowManager(ShadowManager&& other) noexcept : impl_(std::move(other.impl_)) {}

template <typename S>
ShadowManager<S>& ShadowManager<S>::operator=(ShadowManager&& other) noexcept {
  impl_ = std::move(other.impl_);
  return *this;
}

template <typename S>
ShadowManager<S>::~ShadowManager() = default;

template <typename S>
std::shared_ptr<typename ShadowManager<S>::Impl> ShadowManager<S>::impl() const {
  if (impl_ != nullptr) return impl_;
  throw std::logic_error("ShadowManager: it was moved from; assign to it first");
}

template <typename S>
void ShadowManager<S>::change(const char* call, const std::vector<Object*>& objects) {
  impl()->change(call, objects);
}

template <typename S>
void ShadowManager<S>::query(With with, Object* object, Manager* other, void* cdata,
                             fcl::CollisionCallBack<S> callback) const {
  impl()->query("collide", {with, object, other}, cdata, callback);
}

template <typename S>
void ShadowManager<S>::query(With with, Object* object, Manager* other, void* cdata,
                             fcl::DistanceCallBack<S> callback) const {
  impl()->query("distance", {with, object, other}, cdata, callback);
}

template <typename S>
const typename ShadowManager<S>::Manager& ShadowManager<S>::first() const {
  return impl()->manager(kFirst);
}

template <typename S>
const typename ShadowManager<S>::Manager& ShadowManager<S>::second() const {
  return impl()->manager(kSecond);
}

template <typename S>
ShadowResult ShadowManager<S>::result() const {
  return impl()->result();
}

template <typename S>
void ShadowManager<S>::writeRecord(const std::string& path) const {
  impl()->writeRecord(path);
}

template class ShadowManager<float>;
template class ShadowManager<double>;

}  // namespace fcl_fibers
