// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/manager_state.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "broadphase/new_objects.h"
#include "broadphase/pair_rules.h"
#include "joined_text.h"

namespace fcl_fibers::broadphase {

using fibers::throwInvalidArgument;
using geometry::Frame;
using geometry::Segment;

template <typename S>
SegmentId rootsOf(const char* call, const std::vector<fcl::CollisionObject<S>*>& fiber,
                  const FiberObstacles& obstacles) {
  if (obstacles.root_segments < 0) {
    throwInvalidArgument(call, "root_segments is " + std::to_string(obstacles.root_segments) +
                                   "; give 0 or more segments");
  }
  if (!(obstacles.root_length >= 0 && std::isfinite(obstacles.root_length))) {
    throwInvalidArgument(call, joinedText("root_length is ", obstacles.root_length,
                                          "; give a finite length of 0 or more"));
  }
  std::size_t by_length = 0;
  for (double start = 0; by_length < fiber.size() && start < obstacles.root_length; ++by_length) {
    const fcl::CollisionObject<S>* object = fiber[by_length];
    if (object == nullptr || kindOf(*object) == ObjectKind::kNothing) break;
    start += lengthInFiber(*object);
  }
  const auto by_number = static_cast<std::size_t>(obstacles.root_segments);
  return static_cast<SegmentId>(std::min(fiber.size(), std::max(by_length, by_number)));
}

namespace {

/// Young segments as an update has read them.
class ReadSource final : public index::SegmentSource {
 public:
  ReadSource(const std::vector<Segment>& segments, SegmentId begin)
      : segments_(segments), begin_(begin) {}

  bool read(const SegmentId* ids, int count, int /*ahead*/, const Frame& /*frame*/,
            index::SegmentBlock& out, index::BlockMask& present) const override {
    for (int i = 0; i < count; ++i) {
      out.set(i, segments_[static_cast<std::size_t>(ids[i] - begin_)]);
    }
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const Frame& /*frame*/) const override { return true; }
  bool isFasterInOrder() const override { return true; }
  [[noreturn]] void refuse(SegmentId /*id*/, const Frame& /*frame*/) const override {
    throw std::logic_error("fcl_fibers: every segment has been read");
  }

 private:
  const std::vector<Segment>& segments_;
  const SegmentId begin_;
};

}  // namespace

template <typename S>
ManagerState<S>::ManagerState(bool wrapped_spheres, const FiberManagerOptions& options)
    : options_(options),
      registry_(fibers::neighborRule(options)),
      generations_(fibers::indexOptions(options, wrapped_spheres), options.motion,
                   /*lives=*/options.skin != 0),
      obstacles_(options) {
  if (options.skin != 0) live_.emplace(options.skin);
}

template <typename S>
ManagerState<S>::ManagerState(const char* call, const ManagerState& original,
                              const Objects& objects)
    : ManagerState(original.generations_.options().wrapped_spheres, original.options_) {
  if (objects.size() != original.registry_.size()) {
    throwInvalidArgument(call, std::to_string(objects.size()) + " objects are given for " +
                                   std::to_string(original.registry_.size()) +
                                   "; give one for each object of getObjects(), in that order");
  }
  // The original's first query may be building.
  const std::lock_guard<std::mutex> lock(original.build_mutex_);
  const fibers::FiberTable& fibers = original.registry_.fibers();
  bool has_same_segments = true;
  named(call, nameOfPlace, [&] {
    std::size_t i = 0;
    for (SegmentId id = 0; id < original.registry_.idCount(); ++id) {
      if (original.registry_[id] == nullptr) continue;
      prefetchObject<S>([&](std::size_t k) { return objects[k]; }, i, objects.size());
      readNew(call, objects, i, options_.bounds);
      const ObjectKind kind = kindOf(*objects[i]);
      if (!mayBeInFiber(kind) && original.registry_.isOfSeveral(original.registry_[id])) {
        throwInvalidArgument(call, nameOf(i) +
                                       " is not a capsule, cylinder or box, but replaces a "
                                       "segment of a fiber; pass a capsule, cylinder or box");
      }
      if (i + 1 == objects.size() && original.last_registered_ && kind == ObjectKind::kCapsule) {
        // If a box counts in place of the capsule, it has no end point to continue from.
        last_registered_ = readNew(call, objects, i, Bounds::kShapes);
      }
      has_same_segments &= isBesideTree(kind, options_) == original.obstacles_.isBeside(id);
      if (!isRound(kind)) {
        obstacles_.addCopy(original.obstacles_, objects[i], id, fibers.partyOf(id).categories,
                           fibers.isSolid(id), fibers.isRigid(id));
        // The triangles are those of the original, unless they differ.
        if (countsTriangles(options_)) requireMesh(objects, i, fibers.isSolid(id));
      }
      ++i;
    }
  });
  if (const auto duplicate = registry_.copy(original.registry_, objects)) {
    throwInvalidArgument(call, nameOf(*duplicate) + " is passed twice; pass each object once");
  }
  if (!original.hasTree() || !has_same_segments) return;
  generations_.copy(original.generations_);
  removed_ = original.removed_;
  removed_young_ = original.removed_young_;
  state_ = State::kUnread;
}

// --- Registering ---

/// Refuses one of the objects of a call if it is a mesh that cannot be read.
template <typename S>
void ManagerState<S>::requireMesh(const Objects& objects, std::size_t i, bool is_solid) {
  if (!(countsTriangles(options_) || is_solid) || !isMesh(*objects[i])) return;
  MeshCache unused;
  readBeside(*objects[i], is_solid, Frame{}, Bounds::kShapes,
             countsTriangles(options_) ? &obstacles_.cache() : &unused, static_cast<SegmentId>(i));
}

/// Joints of a fiber that is to be the table's next one.
template <typename S>
std::vector<fibers::Joint> ManagerState<S>::jointsOf(
    const char* call, const Objects& fiber, const std::vector<FiberJoint<Object>>& joints) const {
  const fibers::FiberTable& table = registry_.fibers();
  std::vector<fibers::Joint> result;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const FiberJoint<Object>& joint = joints[i];
    const auto refuse = [&](const std::string& what) {
      throwInvalidArgument(call, "joint " + std::to_string(i) + what);
    };
    if (joint.point > fiber.size()) {
      refuse(" is at point " + std::to_string(joint.point) + "; give one from 0 to " +
             std::to_string(fiber.size()) + ", the number of segments");
    }
    const fibers::FiberPoint own{table.nextNumber(), static_cast<SegmentId>(joint.point)};
    const SegmentId id = registry_.find(joint.segment);
    const auto place = std::find(fiber.begin(), fiber.end(), joint.segment) - fiber.begin();
    const SegmentId number = static_cast<SegmentId>(place) + (joint.at_end ? 1 : 0);
    const bool is_known = id != Registry::kNotFound;
    if (is_known ? !table.hasNeighborsOf(id) : place == std::ptrdiff_t(fiber.size())) {
      refuse(
          " names an object that is no segment of a fiber; register that fiber before by "
          "registerFiber()");
    }
    result.emplace_back(
        own, is_known ? table.pointOf(id, joint.at_end) : fibers::FiberPoint{own.fiber, number});
  }
  return result;
}

template <typename S>
void ManagerState<S>::add(const char* call, const Objects& added, const Kind& kind,
                          const std::vector<FiberJoint<Object>>& joints) {
  refuseDuringQuery(call);
  const std::vector<fibers::Joint> joined = jointsOf(call, added, joints);
  if (added.empty()) return;
  // An obstacle with filters of its own neither continues a fiber nor is continued.
  const bool may_continue = kind.categories == tree::kAllCategories;
  const Segment* last = may_continue && last_registered_ ? &*last_registered_ : nullptr;
  NewObjects<S> fresh(call, added, options_);
  named(call, nameOfPlace, [&] {
    fresh.read(kind.has_neighbors, last, generations_.executor());
    for (const std::size_t i : fresh.others) requireMesh(added, i, kind.is_solid);
  });
  if (!fresh.others.empty()) obstacles_.reserve(added, fresh.others);
  const SegmentId first = registry_.idCount();
  constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<SegmentId>::max()) / 2;
  if (added.size() > kMost - registry_.objects().size()) {
    throwInvalidArgument(call, "a manager holds at most 2^30 - 1 objects; use several managers");
  }
  if (const auto duplicate =
          registry_.add(added, fresh.starts_fiber, kind, fresh.lengths, joined)) {
    throwInvalidArgument(call,
                         nameOf(*duplicate) + " is registered already; register each object once");
  }
  for (const std::size_t i : fresh.others) {
    obstacles_.add(added[i], first + static_cast<SegmentId>(i), kind.categories, kind.is_solid,
                   kind.is_rigid);
  }
  last_registered_ = may_continue ? fresh.last : std::nullopt;
  if (!hasTree()) return;
  if (state_ == State::kReady && hasTooManyYoung()) {
    markStale();
  } else if (state_ != State::kUnread) {
    state_ = State::kGrown;
  }
}

template <typename S>
bool ManagerState<S>::hasTooManyYoung() const {
  const auto young = static_cast<std::size_t>(registry_.idCount() - generations_.youngBegin());
  return Generations::areTooMany(young, removed_young_, registry_.size());
}

/// Whether so few objects were registered since the last update that more may follow one by one.
template <typename S>
bool ManagerState<S>::hasFewUnread() const {
  constexpr std::size_t kFew = 16;
  const auto end = std::max(generations_.end(),
                            generations_.youngBegin() + static_cast<SegmentId>(young_.size()));
  return static_cast<std::size_t>(registry_.idCount() - end) <=
         std::max(kFew, Generations::mostYoung(registry_.size()));
}

template <typename S>
void ManagerState<S>::remove(const char* call, const Object* object) {
  refuseDuringQuery(call);
  const SegmentId id = managedId(call, object, "object");
  Objects before;
  // Calls that may throw come first.
  keepLastIds();
  if ((options_.motion || live_) && registry_.nextRemovalRenumbers()) {
    before = registry_.objects();
    markStale();
    generations_.keepStarts();
  }
  const bool was_in_tree = !obstacles_.isBeside(id);
  const bool keeps_ids = registry_.remove(object);
  last_registered_.reset();
  obstacles_.remove(id);
  if (!keeps_ids) {
    obstacles_.renumber(registry_);
    const auto newId = [&](SegmentId old) {
      return registry_.find(before[static_cast<std::size_t>(old)]);
    };
    generations_.renumberStarts(newId);
    if (last_ids_) {
      for (SegmentId& id : last_ids_->now) {
        if (id != Registry::kNotFound) id = newId(id);
      }
    }
  }
  if (generations_.isYoung(id)) {
    ++removed_young_;
  } else if (was_in_tree) {
    ++removed_;
  }
  const std::size_t in_main = generations_.main().leaves().size();
  if (!keeps_ids || removed_ > std::min(registry_.size(), in_main) / 8) markStale();
  if (registry_.fibers().hasUnsettledJoints()) {
    // The next query finds which fibers are joined still. The list lacks what were neighbours.
    generations_.forgetList();
    if (state_ == State::kReady) state_ = State::kGrown;
  }
  if (registry_.size() == 0) state_ = State::kStale;  // no object is left that could be refused
}

template <typename S>
void ManagerState<S>::clear(const char* call) {
  refuseDuringQuery(call);
  keepLastIds();
  if (last_ids_) last_ids_->now.assign(last_ids_->now.size(), Registry::kNotFound);
  registry_.clear();
  generations_.clear();
  young_.clear();
  obstacles_.clear();
  last_registered_.reset();
  state_ = State::kStale;
}

// --- Steps ---

template <typename S>
void ManagerState<S>::setStep(const char* call, bool begins) {
  refuseDuringQuery(call);
  if (!options_.motion) {
    throwInvalidArgument(call,
                         "the manager has no steps; construct it with FiberManagerOptions::motion");
  }
  if (begins) setup(call);
  obstacles_.setStep(begins);
  begins ? generations_.beginStep() : generations_.endStep();
}

// --- Reading the objects ---

template <typename S>
void ManagerState<S>::readAll(const char* call, bool keeps_tree) {
  refuseDuringQuery(call);
  // Objects that come one by one, with an update after each, are read each time. A build waits
  // until a query has needed the young index: then the next update builds all into one.
  const std::size_t in_main = generations_.main().leaves().size();
  const bool joins_young =
      state_ == State::kReady ? hasTooManyYoung() : !hasFewUnread() || young_.size() > in_main;
  const State before = keeps_tree && !joins_young ? State::kUnread : State::kStale;
  state_ = State::kFailed;
  // Steps and the list need all indexes.
  catchUp(call, before, /*builds_young=*/options_.motion || live_);
}

template <typename S>
void ManagerState<S>::update(const char* call) {
  // The list has what is in the main index, and nothing that is gone may stay there.
  const bool has_all = !live_ || (registry_.idCount() == generations_.youngBegin() &&
                                  removed_ + removed_young_ == 0);
  readAll(call, hasTree() && has_all);
  if (!live_) return;
  state_ = State::kFailed;
  renewList();
  state_ = State::kReady;
}

template <typename S>
void ManagerState<S>::update(const char* call, const Objects& moved) {
  refuseDuringQuery(call);
  std::vector<SegmentId> ids;
  ids.reserve(moved.size());
  for (std::size_t i = 0; i < moved.size(); ++i) {
    if (moved[i] == nullptr) {
      throwInvalidArgument(call, nameOf(i) + " is null; pass registered objects");
    }
    const SegmentId id = registry_.find(moved[i]);
    if (id != Registry::kNotFound) ids.push_back(id);
  }
  const auto name = [&](SegmentId id) {
    const auto place = std::find(moved.begin(), moved.end(), registry_[id]) - moved.begin();
    return nameOf(static_cast<std::size_t>(place));
  };
  if (ids.empty()) return;
  // One sweep over all nodes costs less than the way up from each of many segments.
  const bool are_many = 4 * ids.size() > registry_.size();
  if (!hasTree() || state_ == State::kUnread || are_many) return readAll(call, hasTree());
  if (state_ == State::kRead) catchUp(call, State::kRead);
  const State before = state_;
  state_ = State::kFailed;
  std::vector<SegmentId> in_tree;
  std::vector<Segment> segments;
  in_tree.reserve(ids.size());
  segments.reserve(ids.size());
  for (const SegmentId id : ids) {
    const Object& object = *registry_[id];
    if (obstacles_.isBeside(id)) continue;
    if (countsTriangles(options_) && isMesh(object)) {
      throwInvalidArgument(call, name(id) + ": " + kIsMeshNow);
    }
    Segment segment;
    if (readSegment(object, frame(), options_.bounds, segment, countsTriangles(options_)) !=
        nullptr) {
      // If the object is valid and only the frame cannot hold it, a build chooses another frame.
      named(call, name, [&] { requireSegment(object, Frame{}, options_.bounds, id); });
      return catchUp(call, State::kStale);
    }
    if (id >= generations_.end()) continue;  // it is in no index yet
    in_tree.push_back(id);
    segments.push_back(segment);
  }
  named(call, name, [&] { obstacles_.readSome(ids, frame()); });
  catchUp(call, generations_.refitSome(in_tree, segments) ? before : State::kStale);
}

// --- The list ---

/// The pairs within the main index.
template <typename S>
class ManagerState<S>::OwnPairing final : public live::Pairing {
 public:
  /// @pre all objects of the state that are in a tree are in the main index
  explicit OwnPairing(ManagerState& state)
      : state_(state),
        index_(state.generations_.main()),
        rules_(state.registry_, &state.registry_),
        side_{&index_.leaves(), &index_.segments(), index_.reach()} {}

  int sideCount() const override { return 1; }
  const live::SegmentsNow& side(int /*i*/) const override { return side_; }
  double margin() const override { return index_.margin(); }
  double usualReach() const override { return index_.usualReach(); }
  parallel::Executor* executor() const override { return index_.executor(); }

  tree::Visit search(double beyond, const index::PairFilter& seen, index::PairSink& sink) override {
    index::Question question;
    question.wanted = &seen;
    question.beyond = beyond / index_.frame().scale;
    if (beyond > 0) index_.fitBeyond(question.beyond);
    return index_.search(sink, question);
  }
  std::size_t keepTouching(tree::Pair* pairs, std::size_t count) const override {
    return index_.keepTouching(pairs, count);
  }
  std::size_t sift(tree::Pair* pairs, std::size_t count) const override {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto [a, b] = std::minmax(pairs[i].a, pairs[i].b);
      const tree::Pair pair{a, b};
      if (rules_.report(a, b, state_.registry_[b])) pairs[kept++] = pair;
    }
    return kept;
  }
  SegmentId nameNow(SegmentId last) const override { return state_.idNow(last); }

 private:
  const ManagerState& state_;
  index::SegmentIndex& index_;
  const PairRules<S> rules_;
  const live::SegmentsNow side_;
};

template <typename S>
void ManagerState<S>::renewList() {
  const index::SegmentIndex& main = generations_.main();
  const bool has_same_leaves = main.buildCount() == listed_build_ && main.frame() == listed_frame_;
  OwnPairing pairing(*this);
  live_->update(pairing, frame().scale,
                has_same_leaves ? live::LiveList::Last::kSame : live::LiveList::Last::kOtherLeaves);
  listed_build_ = main.buildCount();
  listed_frame_ = main.frame();
  ended_ = last_ids_ ? std::move(last_ids_->objects) : Objects();
  last_ids_.reset();
  generations_.use(*live_);
}

/// An object is about to go, and ids may change with it.
template <typename S>
void ManagerState<S>::keepLastIds() {
  if (!live_ || last_ids_) return;
  LastIds ids{registry_.objects(), {}};
  ids.now.resize(ids.objects.size());
  std::iota(ids.now.begin(), ids.now.end(), 0);
  last_ids_ = std::move(ids);
}

/// The id of an object of the last update() of the list. If it is gone, a negative one of its own.
template <typename S>
SegmentId ManagerState<S>::idNow(SegmentId last) const {
  if (!last_ids_) return last;
  const SegmentId id = last_ids_->now[static_cast<std::size_t>(last)];
  return id != Registry::kNotFound && registry_[id] != nullptr ? id : ~last;
}

template <typename S>
const live::LiveList& ManagerState<S>::live(const char* call) const {
  if (!live_) {
    throwInvalidArgument(call,
                         "the manager has no list; construct it with FiberManagerOptions::skin");
  }
  return *live_;
}

/// Several threads may query first; one of them builds.
template <typename S>
void ManagerState<S>::makeReady(const char* call) const {
  if (state_.load(std::memory_order_acquire) == State::kReady) return;
  const std::lock_guard<std::mutex> lock(build_mutex_);
  if (state_ == State::kReady) return;
  if (state_ == State::kFailed) {
    throwInvalidArgument(call,
                         "the last update failed; mend what its error named and call update()");
  }
  catchUp(call, state_);
}

/// Reads what is not up to date in this state, and makes all ready.
/// @param builds_young  otherwise what is young is only read
template <typename S>
void ManagerState<S>::catchUp(const char* call, State state, bool builds_young) const {
  if (state_ == State::kUnread) state_ = State::kStale;  // in case an object is refused
  const Source source = this->source(call);
  const bool has_new = registry_.idCount() > generations_.end();
  SegmentId read_anew = registry_.idCount();
  if (has_new && !builds_young) generations_.forgetYoung();
  bool keeps_trees = hasTree(state) && !(state == State::kGrown && hasTooManyYoung()) &&
                     (state != State::kUnread || generations_.refit(source));
  if (keeps_trees && has_new && !builds_young) {
    keeps_trees = readYoung(source);
  } else if (keeps_trees && has_new) {
    const SegmentId begin = generations_.youngBegin(), end = registry_.idCount();
    const tree::Fibers fibers = segmentsFrom(begin);
    if (state != State::kRead) read_anew = begin;
    keeps_trees = state == State::kRead
                      ? generations_.buildYoung(ReadSource(young_, begin), end, fibers)
                      : generations_.buildYoung(source, end, fibers);
  }
  if (!keeps_trees) {
    if (state_ == State::kGrown) state_ = State::kStale;
    const tree::Fibers fibers = segmentsFrom(0);
    generations_.build(source, frameFor(source, fibers.ids), registry_.idCount(), fibers);
    removed_ = removed_young_ = 0;
    young_.clear();
  }
  named(
      call, [&](SegmentId id) { return source.nameOf(id); },
      [&] { obstacles_.read(frame(), !keeps_trees || state == State::kUnread, read_anew); });
  registry_.settleJoints();
  const bool waits = !builds_young && (has_new || !keeps_trees);
  state_.store(waits ? State::kRead : State::kReady, std::memory_order_release);
}

/// Reads the young segments. Returns false if an object is refused, or the frame cannot hold a
/// segment.
template <typename S>
bool ManagerState<S>::readYoung(const Source& source) const {
  const SegmentId begin = generations_.youngBegin(), end = registry_.idCount();
  young_.resize(static_cast<std::size_t>(end - begin));
  constexpr SegmentId kBlock = index::SegmentBlock::kCapacity;
  for (SegmentId first = begin; first < end; first += kBlock) {
    SegmentId ids[kBlock];
    std::iota(ids, ids + kBlock, first);
    const int count = std::min(kBlock, end - first);
    index::SegmentBlock block;
    index::BlockMask present = 0;
    if (!source.read(ids, count, 0, frame(), block, present)) return false;
    for (; present != 0; present &= present - 1) {
      const int i = __builtin_ctzll(present);
      if (!isInFloatRange(block[i])) return false;
      young_[static_cast<std::size_t>(first - begin + i)] = block[i];
    }
  }
  return true;
}

/// All objects from an id on except those beside the tree.
template <typename S>
tree::Fibers ManagerState<S>::segmentsFrom(SegmentId begin) const {
  const bool are_all = begin == 0 && registry_.hasEveryId() && obstacles_.beside().ids().empty();
  if (are_all) return registry_.fibers().segments(generations_.executor());
  auto next = obstacles_.beside().ids().begin();
  const auto end = obstacles_.beside().ids().end();
  return registry_.fibersFrom(begin, [&](SegmentId id) {
    while (next != end && *next < id) ++next;
    return next == end || *next != id;
  });
}

// --- Asking ---

template <typename S>
SegmentId ManagerState<S>::managedId(const char* call, const Object* object,
                                     const std::string& name) const {
  if (object == nullptr) throwInvalidArgument(call, name + " is null; pass a registered object");
  const SegmentId id = registry_.find(object);
  if (id == Registry::kNotFound) {
    throwInvalidArgument(call, name + " is not registered; register it first");
  }
  return id;
}

template <typename S>
std::shared_ptr<const Mesh> ManagerState<S>::knownMesh(const Object& object) const {
  const std::lock_guard<std::mutex> lock(build_mutex_);
  const auto* entry = obstacles_.beside(registry_.find(&object));
  if (entry != nullptr && entry->is_read) {
    if (const auto& mesh = obstacles_.withTriangles(*entry, frame()).end.mesh) return mesh;
  }
  return obstacles_.cache().find(object.collisionGeometry());
}

template <typename S>
bool ManagerState<S>::movedSinceUpdate() const {
  const std::lock_guard<std::mutex> lock(build_mutex_);
  if (state_ == State::kFailed) return true;
  if (!hasTree() || state_ == State::kUnread) return false;  // the next query reads all
  if (state_ == State::kRead) catchUp("movedSinceUpdate", State::kRead);
  return !generations_.isFitted(source("movedSinceUpdate")) ||
         !obstacles_.isCurrent(generations_.frame());
}

template <typename S>
std::size_t ManagerState<S>::memoryUsage() const {
  const std::lock_guard<std::mutex> lock(build_mutex_);  // a first query may be building
  return sizeof(*this) + registry_.memoryUsage() + generations_.memoryUsage() +
         obstacles_.memoryUsage() + young_.capacity() * sizeof(Segment) +
         (live_ ? live_->memoryUsage() : 0) + ended_.capacity() * sizeof(Object*) +
         (last_ids_ ? last_ids_->objects.size() * (sizeof(Object*) + sizeof(SegmentId)) : 0);
}

template SegmentId rootsOf(const char*, const std::vector<fcl::CollisionObject<float>*>&,
                           const FiberObstacles&);
template SegmentId rootsOf(const char*, const std::vector<fcl::CollisionObject<double>*>&,
                           const FiberObstacles&);
template class ManagerState<float>;
template class ManagerState<double>;

}  // namespace fcl_fibers::broadphase
