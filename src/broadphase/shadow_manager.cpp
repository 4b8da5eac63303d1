// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/shadow_manager.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <unordered_map>
#include <utility>

#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "broadphase/shadow_record.h"
#include "joined_text.h"

namespace fcl_fibers {
namespace {

using namespace broadphase;
using Lock = std::lock_guard<std::mutex>;
using Side = std::size_t;  // kFirst or kSecond
constexpr Side kFirst = 0, kSecond = 1;
constexpr const char* kSides[] = {"the first manager", "the second manager"};
constexpr char kLimit[] = "limit";  // The last call of a record that has reached its limit.

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

/// Calls visit(option, the largest number of it) for each option on which pairs depend.
template <class Visit>
void visitOptions(FiberManagerOptions& options, Visit visit) {
  visit(options.topology, 1);
  visit(options.report, 1);
  visit(options.ignored_neighbors, std::numeric_limits<int>::max());
  visit(options.ignored_arc_length, kInfinity);
  visit(options.margin, kInfinity);
  visit(options.bounds, 2);
  visit(options.motion, 1);
}

/// A manager in a record: `boxes` or `spheres` with the options, or the name of another class.
template <typename S>
std::string nameOf(const fcl::BroadPhaseCollisionManager<S>& manager) {
  const auto* const ours = dynamic_cast<const FiberCollisionManager<S>*>(&manager);
  if (ours == nullptr) return typeid(manager).name();
  const bool is_boxes = dynamic_cast<const LayeredAABBTreeCollisionManager<S>*>(ours) != nullptr;
  RecordLine line{is_boxes ? "boxes" : "spheres", {}};
  FiberManagerOptions options = ours->options();
  visitOptions(options, [&](auto option, double) { line.numbers.push_back(double(option)); });
  return line.text();
}

/// Makes the manager of a name, FCL's tree if there is none.
template <typename S>
std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeManager(const std::string& name) {
  if (name.find("Naive") != name.npos) return std::make_unique<fcl::NaiveCollisionManager<S>>();
  const bool is_boxes = name.substr(0, 6) == "boxes ";
  if (!is_boxes && name.substr(0, 8) != "spheres ") {
    return std::make_unique<fcl::DynamicAABBTreeCollisionManager<S>>();
  }
  const RecordLine line = RecordLine::parse(name);
  require(line.numbers.size() == 7, "the manager has another count of options");
  FiberManagerOptions options;
  std::size_t at = 0;
  visitOptions(options, [&](auto& option, double most) {
    require(line.numbers[at] >= 0 && line.numbers[at] <= most, "an option is out of range");
    option = static_cast<std::decay_t<decltype(option)>>(line.numbers[at++]);
  });
  if (is_boxes) return std::make_unique<LayeredAABBTreeCollisionManager<S>>(options);
  return std::make_unique<WrappedSphereTreeCollisionManager<S>>(options);
}

/// Makes the change of this name in the manager.
template <typename S>
void makeChange(fcl::BroadPhaseCollisionManager<S>& manager, const std::string& call,
                const std::vector<fcl::CollisionObject<S>*>& objects) {
  auto* const one = objects.size() == 1 ? objects[0] : nullptr;
  auto* const fibers = dynamic_cast<FiberCollisionManager<S>*>(&manager);
  const bool is_ring = call == "registerRing", is_fiber = is_ring || call == "registerFiber";
  if (is_fiber && fibers != nullptr) {
    return fibers->registerFiber(objects, is_ring ? FiberEnds::kClosed : FiberEnds::kOpen);
  }
  if (is_fiber || call == "registerObjects") return manager.registerObjects(objects);
  if (call == "registerObject") return manager.registerObject(one);
  if (call == "unregisterObject") return manager.unregisterObject(one);
  if (call == "updateObjects") return manager.update(objects);
  if (call == "updateObject") return manager.update(one);
  if (call == "update") return manager.update();
  if (call == "setup") return manager.setup();
  if (call == "clear") return manager.clear();
  require(false, "there is no such call");
}

template <class Map, class IsUnused>
void eraseIf(Map& map, IsUnused isUnused) {
  for (auto at = map.begin(); at != map.end();) {
    at = isUnused(at->second) ? map.erase(at) : std::next(at);
  }
}

}  // namespace

template <typename S>
struct ShadowManager<S>::Impl {
  using Fibers = FiberCollisionManager<S>;
  using Objects = std::vector<Object*>;
  /// A callback of collide, for which the distance is null, or of distance.
  using Callback = std::function<bool(Object* a, Object* b, S* dist)>;
  static constexpr bool kIsFloat = std::is_same_v<S, float>;

  struct Query {
    With with;
    Object* object;
    Manager* other;
    bool is_distance;
    RecordLine line = {};  // As in the record.
    // Objects that are not this manager's, and whether they have moved since they were read.
    std::unordered_map<const Object*, bool> partners = {};
    bool is_itself = false;
    std::size_t changes = 0;  // When it began.
  };

  /// What is known of an object, by its address.
  struct Entry {
    const Object* object = nullptr;
    RecordedObject now = {};  // As last seen.
    bool is_registered = false;
    bool is_moved = false;               // Since it was registered or updated.
    std::array<double, 2> margins = {};  // As each manager counts them; NaN if unknown.

    double number() const { return now.line.numbers[0]; }
  };

  struct Pair {
    const Entry *a, *b;
    std::array<std::size_t, 2> counts;  // How often each manager has handed it on.
  };
  using Pairs = std::map<std::pair<double, double>, Pair>;  // By the numbers of the objects.

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
        if (query.with == With::kObject) impl.seeKnown({a, b});
        const Entry *p = impl.find(a), *q = impl.find(b);
        const auto isMet = [&](const Entry* entry) {
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
    void measure(const Entry& a, const Entry& b, S& dist) {
      const Gap gap = impl.isDecided(query, a, b) ? gapBetween(a.now, b.now, kIsFloat) : Gap();
      if (!(gap.high < kInfinity)) return;
      least = {std::min(least.low, gap.low), std::min(least.high, gap.high)};
      if (side == kSecond || impl.is_replay_) dist = std::min(dist, S(std::max(0.0, gap.low)));
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
        query.is_distance ? manager.distance(to..., data, data == nullptr ? nullptr : measured)
                          : manager.collide(to..., data, data == nullptr ? nullptr : collided);
      };
      const auto* const shadow = dynamic_cast<const ShadowManager*>(query.other);
      Manager* const to = shadow == nullptr ? query.other : shadow->impl()->sides_[side].get();
      if (query.with == With::kSelf) {
        pass();
      } else if (query.with == With::kObject) {
        pass(query.object);
      } else if (side == kFirst || to == nullptr || impl.fibers_[side] != nullptr ||
                 typeid(*to) == typeid(manager)) {
        pass(to);
      } else {  // FCL's managers cast the other one to their own class.
        for (const auto& [object, is_moved] : query.partners) pass(const_cast<Object*>(object));
      }
      seconds += secondsNow();
    }
  };

  Impl(std::unique_ptr<Manager> first, std::unique_ptr<Manager> second, ShadowOptions options)
      : options_(std::move(options)), sides_{std::move(first), std::move(second)} {
    for (const Side side : {kFirst, kSecond}) {
      require(sides_[side] != nullptr && sides_[side]->size() == 0,
              joinedText("ShadowManager: ", kSides[side],
                         " is null or has objects; pass an empty manager"));
      fibers_[side] = dynamic_cast<const Fibers*>(sides_[side].get());
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
      if (call == "update") seeAll();
      for (Object* object : objects) {
        // What is unregistered may be gone.
        if (call != "unregisterObject" && object != nullptr) see(object);
        const Entry* const entry = find(object);
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
      append(line);
      note(call, objects);
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
                      (query.with != With::kObject || query.object != nullptr) &&
                      (query.with != With::kManager || query.other != nullptr);
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
        append(query.line);
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

  // --- What is known of the objects. The mutex is locked in all that follows.

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
    if (!is_new && entry.now.line == now.line) return entry;
    append(now.line);
    entry.object = object;
    entry.now = std::move(now);
    entry.is_moved = !is_new;
    for (const Side side : {kFirst, kSecond}) {
      if (fibers_[side] == nullptr) continue;
      entry.margins[side] = std::numeric_limits<double>::quiet_NaN();
      problemOf([&] { entry.margins[side] = fibers_[side]->margin(object); });
    }
    for (std::size_t i = kBox; i < kEnd; ++i) {
      // FCL's boxes of planes end at the largest number.
      const double far = std::fabs(entry.now.line.numbers[i]);
      if (far < std::numeric_limits<S>::max() / 2) extent_ = std::max(extent_, 2 * far);
    }
    return entry;
  }

  void seeKnown(const Objects& objects) {
    for (Object* object : objects) {
      if (find(object) != nullptr) see(object);
    }
  }

  void seeAll() {
    Objects objects;
    sides_[kFirst]->getObjects(objects);
    seeKnown(objects);
    is_dirty_ = false;
  }

  /// Takes over what a change means for the objects.
  void note(const std::string& call, const Objects& objects) {
    const bool registers = call.substr(0, 8) == "register";
    is_dirty_ = is_dirty_ || registers;
    if (call == "clear" || call == "update") {
      for (auto& [object, entry] : entries_) {
        entry.is_moved = false;
        entry.is_registered = entry.is_registered && call != "clear";
      }
    }
    for (const Object* object : objects) {
      Entry* const entry = find(object);
      if (entry == nullptr) continue;
      entry->is_moved = false;
      if (registers || call == "unregisterObject") entry->is_registered = registers;
    }
    // Others may be gone. They are written again when they are met again.
    if (entries_.size() + shapes_.size() < 8 * sides_[kFirst]->size() + 4096) return;
    eraseIf(entries_, [](const Entry& entry) { return !entry.is_registered; });
    eraseIf(shapes_, [](const auto& shape) { return shape.use_count() == 1; });
  }

  void prepare(Query& query) {
    const auto* const shadow = dynamic_cast<const ShadowManager*>(query.other);
    const std::shared_ptr<Impl> other = shadow == nullptr ? nullptr : shadow->impl();
    query.is_itself = other.get() == this;
    Objects partners;
    if (query.other != nullptr && !query.is_itself) query.other->getObjects(partners);
    if (query.object != nullptr) partners.push_back(query.object);
    for (const Object* object : partners) query.partners[object] = false;
    if (other != nullptr && !query.is_itself) {
      const Lock lock(other->mutex_);
      other->seeAll();
      for (auto& [object, is_moved] : query.partners)
        is_moved = other->entries_.at(object).is_moved;
    }
    const Lock lock(mutex_);
    if (query.with != With::kObject || is_dirty_) seeAll();
    query.changes = result_.changes;
    constexpr const char* kWith[] = {"Self", "Object", "Manager"};
    query.line = {query.is_distance ? "distance" : "collide", {0}};
    query.line.word += query.is_itself ? "Itself" : kWith[int(query.with)];
    for (Object* object : partners) query.line.numbers.push_back(see(object).number());
  }

  // --- What is compared.

  /// Whether both are where they were updated, and no option of a manager leaves the pair out.
  bool isDecided(const Query& query, const Entry& p, const Entry& q) const {
    for (const Entry* entry : {&p, &q}) {
      const auto partner = query.partners.find(entry->object);
      const bool is_moved_there = partner != query.partners.end() && partner->second;
      if ((entry->is_moved && entry->is_registered) || is_moved_there) return false;
    }
    return std::none_of(fibers_.begin(), fibers_.end(), [&](const Fibers* fibers) {
      if (fibers == nullptr) return false;
      if (!fibers->isRegistered(p.object) || !fibers->isRegistered(q.object)) return false;
      const FiberSegment a = fibers->fiberSegment(p.object), b = fibers->fiberSegment(q.object);
      const auto neighbors = std::size_t(fibers->options().ignored_neighbors);
      const auto [low, high] = std::minmax(a.segment, b.segment);
      return a.fiber == b.fiber &&
             (fibers->options().ignored_arc_length > 0 || high - low <= neighbors ||
              low < neighbors);  // The fiber may be a ring.
    });
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
    for (const auto& [numbers, pair] : first.pairs) comparePair(query, pair, first.is_stopped);
  }

  void comparePair(const Query& query, const Pair& pair, bool is_stopped) {
    const Entry &a = *pair.a, &b = *pair.b;
    const std::array<std::size_t, 2>& counts = pair.counts;
    const bool is_in_both = query.with == With::kManager && a.is_registered && b.is_registered &&
                            query.partners.count(a.object) + query.partners.count(b.object) == 2;
    // FCL's tree pairs both orders if it is asked for itself.
    const std::size_t most[] = {is_in_both || query.is_itself ? 2U : 1U, is_in_both ? 2U : 1U};
    const auto isFew = [&](Side side) { return counts[side] > 0 && counts[side] <= most[side]; };
    if (isFew(kFirst) && isFew(kSecond)) return;
    if (!isDecided(query, a, b)) {
      ++result_.undecided;
      return;
    }
    const Gap gap = gapBetween(a.now, b.now, kIsFloat);
    const double apart =
        std::max((a.now.low() - b.now.high()).maxCoeff(), (b.now.low() - a.now.high()).maxCoeff());
    const bool boxes_meet = apart < -16 * double{std::numeric_limits<S>::epsilon()} * extent_;
    for (const Side side : {kFirst, kSecond}) {
      const FiberManagerOptions options =
          fibers_[side] == nullptr ? FiberManagerOptions() : fibers_[side]->options();
      const bool is_by_box = fibers_[side] != nullptr && options.bounds == Bounds::kObjects;
      const bool is_exact = options.report == Report::kCapsules && !is_by_box &&
                            a.now.shape->isRound() && b.now.shape->isRound();
      const double reach = options.margin + a.margins[side] + b.margins[side];
      const bool must = gap.high <= (boxes_meet ? reach : is_by_box ? -kInfinity : 0);
      const bool may = (fibers_[side] == nullptr && side == kFirst) || options.motion ||
                       !(is_exact ? gap.low > reach : gap.volumes > reach + 0x1p-20 * extent_);
      const char* problem = nullptr;
      if (counts[side] > most[side] && (side == kSecond || gap.high <= 0)) {
        problem = " hands on more than once";
      } else if (counts[side] == 0 && must && !(side == kFirst && is_stopped)) {
        problem = " does not hand on";
      } else if (counts[side] > 0 && !may) {
        problem = " hands on, although it is too far apart,";
      }
      if (problem == nullptr) continue;
      return differ(
          query.line.word,
          joinedText(kSides[side], problem, " the pair of the objects ", a.number(), " and ",
                     b.number(), gap.high <= 0 ? "; they touch" : "", "; their surfaces are ",
                     gap.low, " to ", gap.high, " apart; their boxes ",
                     apart <= 0 ? "overlap" : "do not overlap: is computeAABB() missing?",
                     "; object ", a.number(), ": ", a.now.describe(), "; object ", b.number(), ": ",
                     b.now.describe()));
    }
  }

  // --- The record and the result.

  void append(const RecordLine& line) {
    if (bytes_ > options_.record_limit) return;
    lines_.push_back(line.text());
    bytes_ += sizeof(std::string) + lines_.back().size();
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
    const std::string draft = path + ".part";
    std::ofstream file(draft, std::ios::binary);
    file << kRecordHead << '\n'
         << (kIsFloat ? "float\n" : "double\n") << nameOf(*sides_[kFirst]) << '\n'
         << nameOf(*sides_[kSecond]) << '\n';
    for (const std::string& line : lines_) file << line << '\n';
    if (bytes_ > options_.record_limit) file << kLimit << '\n';
    if (!result_.difference.empty()) file << "difference " << result_.difference << '\n';
    file << "end\n";
    file.close();
    std::error_code error;
    if (file) std::filesystem::rename(draft, path, error);
    if (file && !error) return;
    std::filesystem::remove(draft, error);
    throw std::runtime_error(path +
                             ": the record cannot be written; check the folder and its space");
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
  std::array<const Fibers*, 2> fibers_ = {};  // The managers that are one.

  bool is_replay_ = false;            // Whether distances are measured for the first manager, too.
  std::atomic<int> running_{0};       // Queries of the first manager.
  std::atomic<bool> is_lost_{false};  // Whether the second manager has missed a change.
  std::atomic<bool> is_broken_{false};  // Whether nothing is compared any more.
  std::atomic<bool> must_tell_{false};
  mutable std::mutex mutex_;  // Of all below.
  ShadowResult result_;
  std::deque<std::string> lines_;  // Of the record.
  std::size_t bytes_ = 0;          // Of these lines.
  std::unordered_map<const Object*, Entry> entries_;
  std::unordered_map<const void*, std::shared_ptr<const RecordedShape>> shapes_;
  double object_count_ = 0, shape_count_ = 0;
  double extent_ = 0;      // Twice the largest coordinate of a box so far.
  bool is_dirty_ = false;  // Whether the next query reads all objects.
};

/// Makes the calls of a record.
template <typename S>
class ShadowManager<S>::Player {
 public:
  Player(const std::string& first, const std::string& second)
      : first_(first), second_(second), both_(makeBoth()) {
    play({"bounds", std::vector<double>(kSizes, kUnknown)});
    play({"object", std::vector<double>(kEnd, kUnknown)});
  }

  /// @param number  that of the line
  ShadowReplay play(std::istream& lines, std::size_t& number) {
    ShadowReplay replay;
    const auto text = [&](Side side, const std::string& recorded) {
      const std::string name = nameOf(*both_->impl_->sides_[side]);
      return name == recorded ? name : name + " in place of " + recorded;
    };
    replay.managers = text(kFirst, first_) + ", and beside it " + text(kSecond, second_);
    for (std::string line; ++number, std::getline(lines, line) && line != "end";) {
      if (line.substr(0, 11) == "difference ") {
        replay.recorded = line.substr(11);
      } else if (line == kLimit) {
        replay.managers += ", up to the limit of the record";
      } else if (replay.result.differences == 0) {
        play(RecordLine::parse(line));
        replay.result = both_->result();
      }
    }
    return replay;
  }

 private:
  using Objects = std::vector<Object*>;
  using Shape = std::shared_ptr<fcl::CollisionGeometry<S>>;
  struct Played final : Object {
    Played() : Object(std::shared_ptr<fcl::CollisionGeometry<S>>()) {}
    void set(const Shape& shape, const RecordLine& line) {
      // FCL's trees may crash with boxes that are NaN or so large as those of planes.
      const auto bounded = [](double x) { return x > -1e15 ? std::min(x, 1e15) : -1e15; };
      const RecordedObject state{nullptr, line};
      this->cgeom = shape;
      this->cgeom_const = shape;
      this->t.affine() = state.pose().template cast<S>();
      this->aabb.min_ = state.low().unaryExpr(bounded).template cast<S>();
      this->aabb.max_ = state.high().unaryExpr(bounded).template cast<S>();
    }
  };
  std::unique_ptr<ShadowManager> makeBoth() const {
    auto both = std::make_unique<ShadowManager>(makeManager<S>(first_), makeManager<S>(second_),
                                                ShadowOptions{"", 0, nullptr});
    both->impl_->is_replay_ = true;
    return both;
  }

  template <class Map>
  static auto& at(Map& map, double number) {
    const auto found = map.find(number);
    require(number >= kUnknown && found != map.end(), "there is no such number so far");
    return found->second;
  }

  void play(const RecordLine& line) {
    const auto& [call, n] = line;
    if (call == "object") {
      require(n.size() == kEnd, "the object has another count of numbers");
      return objects_[n[0]].set(at(shapes_, n[1]), line);
    }
    if (const Shape shape = makeShape<S>(line)) {
      shapes_[n[0]] = shape;
      return;
    }
    const bool is_query = call.substr(0, 7) == "collide" || call.substr(0, 8) == "distance";
    require(!is_query || !n.empty(), "the query has no numbers");
    Objects objects;
    for (std::size_t i = is_query; i < n.size(); ++i) objects.push_back(&at(objects_, n[i]));
    if (is_query) return query(call, objects, n[0]);
    require(call.back() != 't' || objects.size() == 1, "the call needs one object");
    const auto* const one = objects.empty() ? nullptr : both_->impl()->find(objects[0]);
    require(call != "unregisterObject" || first_.find("Naive") != first_.npos ||
                (one != nullptr && one->is_registered),
            "the object is not registered, and FCL's tree would crash");
    both_->change(call.c_str(), objects);
  }

  void query(const std::string& call, const Objects& objects, double most) {
    const bool is_distance = call[0] == 'd';
    const std::string with = call.substr(is_distance ? 8 : 7);
    double pairs = 0;  // The callback ends the query where the program's did.
    const auto visit = [&](Object*, Object*, S*) { return ++pairs == most; };
    const auto ask = [&](With to, Object* object, Manager* other) {
      both_->impl()->query({to, object, other, is_distance}, visit);
    };
    if (with == "Self") return ask(With::kSelf, nullptr, nullptr);
    if (with == "Itself") return ask(With::kManager, nullptr, both_.get());
    if (with == "Object" && objects.size() == 1) return ask(With::kObject, objects[0], nullptr);
    require(with == "Manager", "there is no such query");
    const std::unique_ptr<ShadowManager> other = makeBoth();
    for (Object* const object : objects) other->registerObject(object);
    other->setup();
    ask(With::kManager, nullptr, other.get());
  }

  static constexpr double kUnknown = -1;  // An object that the program never registered.
  const std::string first_, second_;
  std::map<double, Shape> shapes_;
  std::map<double, Played> objects_;
  std::unique_ptr<ShadowManager> both_;
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
  typename Impl::Callback call;
  if (callback != nullptr) call = [=](Object* a, Object* b, S*) { return callback(a, b, cdata); };
  impl()->query({with, object, other, false}, call);
}

template <typename S>
void ShadowManager<S>::query(With with, Object* object, Manager* other, void* cdata,
                             fcl::DistanceCallBack<S> callback) const {
  typename Impl::Callback call;
  if (callback != nullptr) call = [=](auto a, auto b, S* d) { return callback(a, b, cdata, *d); };
  impl()->query({with, object, other, true}, call);
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

ShadowReplay replayRecord(const std::string& path) {
  std::size_t number = 1;
  try {
    std::ifstream file(path, std::ios::binary);
    std::string head, scalar, first, second, tail(5, ' ');
    require(bool(std::getline(file, head)), "it cannot be read, or is empty");
    require(head == kRecordHead,
            joinedText("it is no record of this version, which begins with '", kRecordHead, "'"));
    file.seekg(-5, std::ios::end).read(&tail[0], 5);
    require(tail == "\nend\n", "the record is cut: its last line is not 'end'");
    file.seekg(std::streamoff(head.size()) + 1);
    for (std::string* line : {&scalar, &first, &second}) std::getline(file, *line);
    number = 4;
    if (scalar == "float") return ShadowManager<float>::Player(first, second).play(file, number);
    require(scalar == "double", "the scalar is neither float nor double");
    return ShadowManager<double>::Player(first, second).play(file, number);
  } catch (const std::exception& error) {
    throw std::runtime_error(joinedText(path, ":", number, ": ", error.what()));
  }
}

}  // namespace fcl_fibers
