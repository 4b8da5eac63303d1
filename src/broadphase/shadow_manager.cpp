// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/shadow_manager.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <stdexcept>
#include <typeinfo>
#include <unordered_map>
#include <utility>

#include "broadphase/shadow_objects.h"
#include "broadphase/shadow_record.h"
#include "joined_text.h"

namespace fcl_fibers {
namespace {

using namespace broadphase;
using Lock = std::lock_guard<std::mutex>;
using Side = std::size_t;  // kFirst or kSecond

double secondsNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// What a call throws, in words; empty if it does not.
template <class F>
std::string problemOf(F f) {
  try {
    return f(), std::string();
  } catch (const std::exception& error) {
    return joinedText("the second manager throws: ", error.what());
  } catch (...) {
    return "the second manager throws what is no std::exception";
  }
}

}  // namespace

template <typename S>
struct ShadowManager<S>::Impl {
  using Fibers = FiberCollisionManager<S>;
  using Objects = std::vector<Object*>;
  using Query = ShadowQuery<S>;
  // By the numbers of the objects.
  using Pairs = std::map<std::pair<double, double>, ShadowPair<S>>;

  /// Takes the pairs of one manager in one query.
  struct Watch {
    Impl& impl;
    const Query& query;
    Pairs& pairs;
    const Callback& callback;  // The program's, or none for the second manager.
    const Side side;

    std::size_t count = 0;    // Of pairs.
    bool is_foreign = false;  // Whether it has handed on a pair that is not asked for.
    bool is_stopped = false;  // By the program's callback, also if that threw.
    double seconds = 0;       // In the manager.
    Gap least = {kInfinity, kInfinity};
    S left = std::numeric_limits<S>::max();  // The distance that the callbacks left.

    bool visit(Object* a, Object* b, S* dist) {
      seconds += secondsNow();
      impl.guard([&] {
        const Lock lock(impl.mutex_);
        ++count;
        if (query.isOf("Object")) impl.objects_.seeKnown({a, b});
        const ShadowEntry<S>*p = impl.objects_.find(a), *q = impl.objects_.find(b);
        const auto isMet = [&](const ShadowEntry<S>* entry) {
          return entry != nullptr &&
                 (entry->is_registered || query.partners.count(entry->object) > 0);
        };
        if (p == q || !isMet(p) || !isMet(q) || !(p->is_registered || q->is_registered)) {
          is_foreign = true;
        } else if (dist != nullptr) {
          measure(*p, *q, *dist);
        } else {
          if (p->number() > q->number()) std::swap(p, q);
          ++pairs.insert({{p->number(), q->number()}, {p, q, {}}}).first->second.counts[side];
        }
      });
      bool stops = dist != nullptr && *dist <= 0;
      if (side == kFirst) {
        is_stopped = true;
        is_stopped = stops = callback(a, b, dist);
      }
      if (dist != nullptr) left = *dist;
      seconds -= secondsNow();
      return stops;
    }
    void measure(const ShadowEntry<S>& a, const ShadowEntry<S>& b, S& dist) {
      const Gap gap = impl.objects_.gapOf(query, a, b);
      if (!(gap.high < kInfinity)) return;
      least = {std::min(least.low, gap.low), std::min(least.high, gap.high)};
      if (side == kSecond) dist = std::min(dist, S(std::max(0.0, gap.low)));
    }

    /// Asks the manager, with another one of the same side.
    void ask() {
      seconds -= secondsNow();
      const Manager& manager = *impl.sides_[side];
      const auto pass = [&](auto... to) {
        // Without a callback of the program there is none at all.
        Watch* const data = callback == nullptr ? nullptr : this;
        fcl::CollisionCallBack<S> collided = [](Object* a, Object* b, void* watch) {
          return static_cast<Watch*>(watch)->visit(a, b, nullptr);
        };
        fcl::DistanceCallBack<S> measured = [](Object* a, Object* b, void* watch, S& dist) {
          return static_cast<Watch*>(watch)->visit(a, b, &dist);
        };
        query.isForDistances() ? manager.distance(to..., data, data == nullptr ? nullptr : measured)
                               : manager.collide(to..., data, data == nullptr ? nullptr : collided);
      };
      const auto* const shadow = dynamic_cast<const ShadowManager*>(query.other);
      Manager* const to = shadow == nullptr ? query.other : shadow->impl()->sides_[side].get();
      if (query.isOf("Self")) {
        pass();
      } else if (query.isOf("Object")) {
        pass(query.object);
      } else if (side == kFirst || to == nullptr || impl.fibers_[side] != nullptr ||
                 typeid(*to) == typeid(manager)) {
        pass(to);
      } else {  // FCL's managers cast the other one to their own class.
        for (const auto& [object, partner] : query.partners) pass(const_cast<Object*>(object));
      }
      seconds += secondsNow();
    }
  };

  Impl(std::unique_ptr<Manager> first, std::unique_ptr<Manager> second, ShadowOptions options)
      : options_(std::move(options)),
        sides_{std::move(first), std::move(second)},
        fibers_{dynamic_cast<const Fibers*>(sides_[kFirst].get()),
                dynamic_cast<const Fibers*>(sides_[kSecond].get())},
        objects_(fibers_, options_.record_limit) {
    for (const Side side : {kFirst, kSecond}) {
      require(sides_[side] != nullptr && sides_[side]->size() == 0,
              joinedText("ShadowManager: ", kSides[side],
                         " is null or has objects; pass an empty manager"));
    }
  }

  ShadowResult result() const {
    const Lock lock(mutex_);
    return result_;
  }

  /// Makes the change in the first manager, and if that takes it in the second.
  void change(const std::string& call, const Objects& objects) {
    RecordLine line{call, {}};
    guard([&] {
      const Lock lock(mutex_);
      if (call == "update" || call == "setup" || call == "beginStep") seeAll();
      for (Object* object : objects) {
        // What is unregistered may be gone.
        if (call != "unregisterObject" && object != nullptr) objects_.see(object);
        const ShadowEntry<S>* const entry = objects_.find(object);
        line.numbers.push_back(entry == nullptr ? -1 : entry->number());
      }
    });
    const double start = secondsNow();
    makeChange<S>(*sides_[kFirst], call, objects);
    const double middle = secondsNow();
    std::string problem = problemOf([&] {
      if (!is_lost_) makeChange<S>(*sides_[kSecond], call, objects);
    });
    guard([&] {
      const Lock lock(mutex_);
      ++result_.changes;
      result_.first.seconds += middle - start;
      result_.second.seconds += secondsNow() - middle;
      objects_.append(line);
      objects_.note(call, objects, sides_[kFirst]->size());
      is_dirty_ = is_dirty_ || call.substr(0, 8) == "register";
      is_lost_ = is_lost_ || !problem.empty();
      if (!is_lost_ && running_ > 0 && fibers_[kSecond] != nullptr) {
        problem = "a callback changes the manager, which FiberCollisionManager refuses";
      }
      if (!problem.empty()) differ(call, problem);
    });
    tell();
  }

  void query(Query query, const Callback& callback) {
    guard([&] { prepare(query); });
    // FCL's managers crash if they are given null.
    const bool asks = !is_lost_ && callback != nullptr &&
                      (query.isOf("Self") || query.object != nullptr || query.other != nullptr);
    Pairs pairs;
    Watch first{*this, query, pairs, callback, kFirst};
    Watch second{*this, query, pairs, callback, kSecond};
    // The second one comes first, because a callback may move objects.
    const std::string problem = problemOf([&] {
      if (asks) second.ask();
    });
    const auto finish = [&] {
      --running_;
      guard([&] {
        const Lock lock(mutex_);
        ++result_.queries;
        result_.first.seconds += first.seconds;
        result_.second.seconds += second.seconds;
        result_.first.pairs += first.count;
        result_.second.pairs += second.count;
        if (first.is_stopped) query.line.numbers[0] = double(first.count);
        objects_.append(query.line);
        if (!problem.empty()) return differ(query.line.word, problem);
        if (asks && query.changes == result_.changes) compare(query, first, second);
      });
      tell();
    };
    ++running_;
    try {
      first.ask();
    } catch (...) {
      first.is_stopped ? finish() : void(--running_);  // What it refuses by itself is no query.
      throw;
    }
    finish();
  }

  // The mutex is locked in what follows.

  void seeAll() {
    Objects objects;
    sides_[kFirst]->getObjects(objects);
    objects_.seeKnown(objects);
    is_dirty_ = false;
  }

  void prepare(Query& query) {
    const auto* const shadow = dynamic_cast<const ShadowManager*>(query.other);
    const auto* const fibers = dynamic_cast<const Fibers*>(query.other);
    const std::shared_ptr<Impl> other = shadow == nullptr ? nullptr : shadow->impl();
    query.is_itself = other.get() == this;
    if (query.is_itself) query.line.word.replace(query.line.word.find("Manager"), 7, "Itself");
    Objects partners;
    if (query.other != nullptr && !query.is_itself) query.other->getObjects(partners);
    if (query.object != nullptr) partners.push_back(query.object);
    for (const Object* object : partners) {
      query.partners[object].rests = fibers == nullptr || !fibers->options().motion;
    }
    if (other != nullptr && !query.is_itself) {
      const Lock lock(other->mutex_);
      other->seeAll();
      for (auto& [object, partner] : query.partners) {
        partner = other->objects_.asPartner(object);
      }
    }
    const Lock lock(mutex_);
    if (!query.isOf("Object") || is_dirty_) seeAll();
    query.changes = result_.changes;
    for (Object* object : partners) query.line.numbers.push_back(objects_.see(object).number());
  }

  void compare(const Query& query, const Watch& first, const Watch& second) {
    const double pruned = std::min(first.least.low, double{first.left});
    if ((first.least.high < second.least.low && second.least.low > 0) ||
        (!first.is_stopped && second.least.high < pruned)) {
      differ(query.line.word,
             joinedText("the least distance is ", first.least.high, " in ", kSides[kFirst], " and ",
                        second.least.high, " in ", kSides[kSecond]));
    }
    // FCL pairs an object with itself.
    if (second.is_foreign) differ(query.line.word, "the second manager invents a pair");
    for (const auto& [numbers, pair] : first.pairs) {
      const std::string problem = objects_.judge(query, pair, first.is_stopped);
      if (problem == objects_.kUndecided) {
        ++result_.undecided;
      } else if (!problem.empty()) {
        differ(query.line.word, problem);
      }
    }
  }

  void differ(const std::string& call, const std::string& problem) {
    if (result_.differences++ > 0) return;
    must_tell_ = true;
    result_.difference =
        joinedText("call ", result_.changes + result_.queries, ", ", call, ": ", problem);
    std::replace(result_.difference.begin(), result_.difference.end(), '\n', ' ');
    if (options_.file.empty()) return;
    std::string path = options_.file;
    for (int i = 2; std::filesystem::exists(path); ++i) path = joinedText(options_.file, "-", i);
    write(path);
    result_.file = path;
  }

  void write(const std::string& path) const {
    objects_.write(path, nameOf(*sides_[kFirst]), nameOf(*sides_[kSecond]), result_.difference);
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
    if (!must_tell_.exchange(false) || options_.on_difference == nullptr) return;
    options_.on_difference(result());  // Without the lock, as it may ask.
  }

  const ShadowOptions options_;
  const std::array<std::unique_ptr<Manager>, 2> sides_;
  const std::array<const Fibers*, 2> fibers_;  // The managers that are one, else null.

  std::atomic<int> running_{0};         // Queries of the first manager.
  std::atomic<bool> is_lost_{false};    // Whether the second manager has missed a change.
  std::atomic<bool> is_broken_{false};  // Whether nothing is compared any more.
  std::atomic<bool> must_tell_{false};
  mutable std::mutex mutex_;  // Of all below.
  ShadowResult result_;
  ShadowObjects<S> objects_;
  bool is_dirty_ = false;  // Whether the next query reads all objects.
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

template <typename S>
std::shared_ptr<typename ShadowManager<S>::Impl> ShadowManager<S>::impl() const {
  if (impl_ != nullptr) return impl_;
  throw std::logic_error("ShadowManager: it was moved from; assign to it first");
}

template <typename S>
void ShadowManager<S>::change(const std::string& call, const std::vector<Object*>& objects) {
  impl()->change(call, objects);
}

template <typename S>
void ShadowManager<S>::query(const std::string& call, Object* object, Manager* other,
                             const Callback& callback) const {
  impl()->query({{call, {0}}, object, other}, callback);
}

template <typename S>
const typename ShadowManager<S>::Manager& ShadowManager<S>::first() const {
  return *impl()->sides_[kFirst];
}

template <typename S>
ShadowResult ShadowManager<S>::result() const {
  return impl()->result();
}

template <typename S>
void ShadowManager<S>::writeRecord(const std::string& path) const {
  const auto state = impl();
  const Lock lock(state->mutex_);
  state->write(path);
}

template class ShadowManager<float>;
template class ShadowManager<double>;

}  // namespace fcl_fibers
