// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_collision_manager.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "broadphase/fcl_layout.h"
#include "broadphase/fiber_registry.h"
#include "broadphase/object_members.h"
#include "broadphase/object_segments.h"
#include "geometry/always_inline.h"
#include "geometry/sphere.h"
#include "geometry/touch.h"
#include "tree/scene.h"

namespace fcl_fibers {
namespace {

using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using tree::Scene;
using tree::SegmentId;
using tree::Visit;

[[noreturn]] void refuse(const char* call, const std::string& what) {
  throw std::invalid_argument(std::string("fcl_fibers: ") + call + ": " + what);
}

std::string nameOf(std::size_t index) { return "object " + std::to_string(index); }

/// What a query does with the pairs it finds: on_pair(a, b).
template <class F>
class PairsTo : public tree::PairSink {
 public:
  explicit PairsTo(F on_pair) : on_pair_(std::move(on_pair)) {}

  Visit take(const tree::Pair* pairs, std::size_t count) override {
    for (const tree::Pair* pair = pairs; pair != pairs + count; ++pair) {
      if (on_pair_(pair->a, pair->b) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

 private:
  F on_pair_;
};

/// The same for distances: on_pair(a, b, limit).
template <class F>
class NearestTo : public tree::NearestVisitor {
 public:
  explicit NearestTo(F on_pair) : on_pair_(std::move(on_pair)) {}

  Visit visit(SegmentId a, SegmentId b, double& limit) override { return on_pair_(a, b, limit); }

 private:
  F on_pair_;
};

}  // namespace

template <typename S>
class FiberCollisionManager<S>::Impl {
 public:
  using Registry = broadphase::FiberRegistry<S>;
  using Fibers = typename Registry::Kind;
  using ObjectMembers = broadphase::ObjectMembers<S>;

  Impl(Hierarchy hierarchy, const FiberManagerOptions& options)
      : options_(options),
        is_wrapped_(hierarchy == Hierarchy::kWrappedSpheres),
        neighbors_(options.ignored_neighbors, options.ignored_arc_length),
        registry_(options.ignored_arc_length > 0  ? Registry::Keep::kLinksAndArcs
                  : options.ignored_neighbors > 0 ? Registry::Keep::kLinks
                                                  : Registry::Keep::kNothing),
        scene_({hierarchy == Hierarchy::kWrappedSpheres, options.topology == Topology::kSuperThread,
                options.report == Report::kCapsules, options.margin, options.threads}) {}

  /// A manager as `original`, of these objects. Queries of the original may run meanwhile.
  Impl(const char* call, Hierarchy hierarchy, const FiberManagerOptions& options,
       const Impl& original, const std::vector<Object*>& objects)
      : Impl(hierarchy, options) {
    if (objects.size() != original.registry_.size()) {
      refuse(call, std::to_string(objects.size()) + " objects for " +
                       std::to_string(original.registry_.size()) +
                       "; pass one for each that getObjects() gives, in its order");
    }
    std::size_t i = 0;
    for (const Object* model : original.registry_.objects()) {
      if (model == nullptr) continue;
      prefetchObject(objects, i + kPrefetchAhead);
      const Segment segment = readNew(call, objects, i);
      if (isCapsule(*model) && !isCapsule(*objects[i])) {
        refuse(call, nameOf(i) + " is no capsule, and the original's is one; pass a capsule");
      }
      if (++i == objects.size() && original.last_registered_) last_registered_ = segment;
    }
    if (const auto duplicate = registry_.copy(original.registry_, objects)) {
      refuse(call, nameOf(*duplicate) + " is there twice; pass each object once");
    }
    // A first query of the original may be building.
    const std::lock_guard<std::mutex> lock(original.build_mutex_);
    if (!original.hasTree()) return;
    scene_.copy(original.scene_);
    late_ = original.late_;
    late_read_ = 0;
    gone_ = original.gone_;
    in_scene_ = original.in_scene_;
    state_ = State::kCloned;
  }

  static const FiberManagerOptions& checked(const FiberManagerOptions& options) {
    broadphase::requireLayoutOfFcl();
    constexpr const char* kCall = "FiberManagerOptions";
    if (options.ignored_neighbors < 0) {
      refuse(kCall, "ignored_neighbors is " + std::to_string(options.ignored_neighbors) +
                        "; set 0 or more");
    }
    if (!(options.ignored_arc_length >= 0) || !std::isfinite(options.ignored_arc_length)) {
      refuse(kCall, "ignored_arc_length is " + std::to_string(options.ignored_arc_length) +
                        "; set a finite length of 0 or more");
    }
    if (!(options.margin >= 0) || !std::isfinite(options.margin)) {
      refuse(kCall,
             "margin is " + std::to_string(options.margin) + "; set a finite length of 0 or more");
    }
    if (options.threads < 1) {
      refuse(kCall, "threads is " + std::to_string(options.threads) + "; set 1 or more");
    }
    return options;
  }

  const Registry& registry() const { return registry_; }

  // --- Registering ---

  void add(const char* call, const std::vector<Object*>& added, Fibers fibers,
           tree::Group group = tree::kNoGroup) {
    refuseDuringQuery(call);
    if (added.size() > static_cast<std::size_t>(std::numeric_limits<SegmentId>::max()) / 2 -
                           registry_.objects().size()) {
      refuse(call, "too many objects; use several managers");
    }
    // Objects are read here to refuse the bad ones early and to guess fibers; where they will be
    // when the tree is built may be elsewhere.
    std::vector<bool> starts_fiber(added.size());
    std::vector<double> lengths(options_.ignored_arc_length > 0 ? added.size() : 0);
    std::optional<Segment> previous = last_registered_;
    for (std::size_t i = 0; i < added.size(); ++i) {
      prefetchObject(added, i + kPrefetchAhead);
      Segment segment = readNew(call, added, i);
      const bool is_capsule = isCapsule(*added[i]);
      // Its box, if that is what counts, does not run along the fiber.
      if (is_capsule && segment.isBox()) {
        segment = read(call, added[i], Frame{}, Bounds::kShapes, [i] { return nameOf(i); });
      }
      if (!lengths.empty()) lengths[i] = norm(segment.b - segment.a);
      if (fibers != Fibers::kGuessed) {
        if (!is_capsule) {
          refuse(call, nameOf(i) + " is no capsule; register it by registerObject() instead");
        }
        starts_fiber[i] = i == 0;
      } else {
        starts_fiber[i] = !(is_capsule && previous && shareEnd(*previous, segment));
        previous = is_capsule ? std::optional<Segment>(segment) : std::nullopt;
      }
    }
    // What may throw comes first.
    const bool are_late = hasTree() && late_.size() + added.size() <= mostLate(added.size());
    if (are_late) late_.reserve(late_.size() + added.size());
    if (const auto duplicate = registry_.add(added, starts_fiber, fibers, lengths, group)) {
      refuse(call, nameOf(*duplicate) + " is registered already; register each object once");
    }
    if (!added.empty()) {
      last_registered_ = previous;
      if (fibers != Fibers::kGuessed) last_registered_.reset();
      are_late ? addLate(added.size()) : markStale();
    }
  }

  void remove(const char* call, const Object* object) {
    refuseDuringQuery(call);
    const SegmentId id = managedId(call, object, "object");
    last_registered_.reset();
    const bool keeps_ids = registry_.remove(object);
    if (const auto late = findLate(id); late != late_.end()) {
      if (static_cast<std::size_t>(late - late_.begin()) < late_read_) --late_read_;
      late_.erase(late);
    } else {
      ++gone_;
    }
    if (!keeps_ids || isUnbounded(id) || gone_ > registry_.size() / 8) markStale();
    if (registry_.size() == 0) state_ = State::kStale;  // nothing is left that could be refused
  }

  void clear(const char* call) {
    refuseDuringQuery(call);
    registry_.clear();
    scene_.clear();
    late_.clear();
    late_read_ = 0;
    last_registered_.reset();
    state_ = State::kStale;
  }

  // --- Reading the objects ---

  void setup(const char* call) {
    if (state_ == State::kReady) return;
    refuseDuringQuery(call);
    catchUp(call);
  }

  void update(const char* call) {
    refuseDuringQuery(call);
    const bool is_built = hasTree();
    state_ = State::kRefused;
    is_built ? readAndFit(call) : readAndBuild(call);
  }

  void update(const char* call, const std::vector<Object*>& moved) {
    refuseDuringQuery(call);
    std::vector<SegmentId> ids;
    ids.reserve(moved.size());
    for (std::size_t i = 0; i < moved.size(); ++i) {
      if (moved[i] == nullptr) refuse(call, nameOf(i) + " is null; pass registered objects");
      const SegmentId id = registry_.find(moved[i]);
      if (id != Registry::kNotFound) ids.push_back(id);
    }
    if (ids.empty()) return;
    // A sweep over the whole tree costs less than the ways up from many segments.
    if (!hasTree() || state_ == State::kCloned || 4 * ids.size() > registry_.size()) {
      return update(call);
    }
    state_ = State::kRefused;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      Segment segment;
      if (registry_.find(moved[i]) == Registry::kNotFound ||
          broadphase::readSegment(*moved[i], scene_.frame(), options_.bounds, segment) == nullptr) {
        continue;
      }
      // It may be the frame that does not hold it: the scene gets another.
      read(call, moved[i], Frame{}, options_.bounds, [i] { return nameOf(i); });
      return readAndBuild(call);
    }
    const auto first_late =
        std::partition(ids.begin(), ids.end(), [this](SegmentId id) { return !isLate(id); });
    for (auto id = first_late; id != ids.end(); ++id) reader(call)(*id, findLate(*id)->segment);
    ids.erase(first_late, ids.end());
    if (!scene_.updateSome(ids, reader(call))) return readAndBuild(call);
    readLate(call);
  }

  // --- Queries ---

  void collide(const char* call, void* cdata, fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    const auto report = [&](SegmentId a, SegmentId b) {
      if (a > b) std::swap(a, b);
      if (isGone(a) || isGone(b) || areNeighbors(a, b)) return Visit::kContinue;
      return callback(objectOf(a), objectOf(b), cdata) ? Visit::kStop : Visit::kContinue;
    };
    PairsTo sink(report);
    if (scene_.findPairs(sink) == Visit::kStop) return;
    findOutside(report);
  }

  void distance(const char* call, void* cdata, fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    NearestCall nearest(*this, cdata, callback);
    const auto report = [&](SegmentId a, SegmentId b, double& limit) {
      if (a > b) std::swap(a, b);
      return isGone(a) || isGone(b) || areNeighbors(a, b)
                 ? Visit::kContinue
                 : nearest.call(objectOf(a), objectOf(b), limit);
    };
    NearestTo visitor([&](SegmentId a, SegmentId b, double& limit) {
      if (options_.report == Report::kCapsules) {
        const Segment& q = scene_.segment(b);
        if (!mayBeNearer(a, q, endPointError(q), limit)) return Visit::kContinue;
      }
      return report(a, b, limit);
    });
    if (scene_.findNearest(nearest.limit(), visitor) == Visit::kStop) return;
    forEachOutside([&](SegmentId b) {
      const Segment segment = segmentOf(b);
      return findNearestOne(segment, endPointError(segment), registry_.groupOf(b), nearest,
                            [&](SegmentId a, double& limit) {
                              return isPairOf(a, b) ? report(a, b, limit) : Visit::kContinue;
                            });
    });
  }

  void collide(const char* call, Object* object, void* cdata,
               fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    if (object == nullptr) refuse(call, "the object is null; pass an object");
    const QueryScope scope(*this, call);
    collideOne(readQueryObject(call, object), object, cdata, callback);
  }

  void distance(const char* call, Object* object, void* cdata,
                fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    if (object == nullptr) refuse(call, "the object is null; pass an object");
    const QueryScope scope(*this, call);
    NearestCall nearest(*this, cdata, callback);
    distanceOne(readQueryObject(call, object), object, nearest);
  }

  /// Objects of a manager that is none of ours. They are read one by one, when it is their turn, so
  /// that a query that ends early costs no more than it has to.
  void collideAll(const char* call, const std::vector<Object*>& others, void* cdata,
                  fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    for (std::size_t i = 0; i < others.size() && registry_.size() > 0; ++i) {
      const Segment segment = readOther(call, others[i], i);
      if (collideOne(segment, others[i], cdata, callback) == Visit::kStop) return;
    }
  }

  void distanceAll(const char* call, const std::vector<Object*>& others, void* cdata,
                   fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    NearestCall nearest(*this, cdata, callback);
    for (std::size_t i = 0; i < others.size() && registry_.size() > 0; ++i) {
      const Segment segment = readOther(call, others[i], i);
      if (distanceOne(segment, others[i], nearest) == Visit::kStop) return;
    }
  }

  void collide(const char* call, const Impl& other, void* cdata,
               fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call), other_scope(other, call);
    const auto report = [&](SegmentId a, SegmentId b) {
      if (!isPairWith(other, a, b)) return Visit::kContinue;
      return callback(objectOf(a), other.objectOf(b), cdata) ? Visit::kStop : Visit::kContinue;
    };
    visitBetween(
        other,
        [&] {
          std::vector<Segment> read;
          const bool needs = options_.report == Report::kCapsules && !other.scene_.keepsSegments();
          if (needs) read = other.allSegments();
          PairsTo sink(report);
          return scene_.findPairs(other.scene_,
                                  needs ? read.data() : other.scene_.segments().data(), sink);
        },
        [&](const Segment& segment, double error, SegmentId b, Among among) {
          return findOne(
              segment, error, tree::kNoGroup, [&](SegmentId a) { return report(a, b); }, among);
        });
  }

  void distance(const char* call, const Impl& other, void* cdata,
                fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call), other_scope(other, call);
    const FrameChange to_this(other.scene_.frame(), scene_.frame());
    NearestCall nearest(*this, cdata, callback);
    const auto report = [&](SegmentId a, SegmentId b, double& limit) {
      return isPairWith(other, a, b) ? nearest.call(objectOf(a), other.objectOf(b), limit)
                                     : Visit::kContinue;
    };
    visitBetween(
        other,
        [&] {
          NearestTo visitor([&](SegmentId a, SegmentId b, double& limit) {
            if (options_.report == Report::kCapsules) {
              const Segment q = to_this(other.segmentOf(b));
              if (!mayBeNearer(a, q, to_this.error(q), limit)) return Visit::kContinue;
            }
            return report(a, b, limit);
          });
          return scene_.findNearest(other.scene_, nearest.limit(), visitor);
        },
        [&](const Segment& segment, double error, SegmentId b, Among among) {
          return findNearestOne(
              segment, error, tree::kNoGroup, nearest,
              [&](SegmentId a, double& limit) { return report(a, b, limit); }, among);
        });
  }

  bool movedSinceUpdate() const {
    const std::lock_guard<std::mutex> lock(build_mutex_);
    if (state_ == State::kRefused) return true;
    if (!hasTree() || state_ == State::kCloned) return false;  // the next query reads all
    return forEachId([&](SegmentId id) {
             Segment now;
             const auto late = findLate(id);
             const bool is_late = late != late_.end();
             if (is_late && static_cast<std::size_t>(late - late_.begin()) >= late_read_) {
               return Visit::kContinue;  // the next query reads it
             }
             const bool is_read = broadphase::readSegment(*objectOf(id), scene_.frame(),
                                                          options_.bounds, now) == nullptr;
             const bool stays =
                 is_read && (is_late ? now == late->segment : scene_.isFitted(id, now));
             return stays ? Visit::kContinue : Visit::kStop;
           }) == Visit::kStop;
  }

  double marginOf(const char* call, const Object* object) const {
    if (object == nullptr) refuse(call, "the object is null; pass an object");
    if (options_.bounds != Bounds::kShapesAndMargins) return 0;
    const auto name = [] { return std::string("the object passed"); };
    const Segment shape = read(call, object, Frame{}, Bounds::kShapes, name);
    const Segment counted = read(call, object, Frame{}, options_.bounds, name);
    if (shape.isBox() || !counted.isBox()) return counted.radius - shape.radius;
    const double r = shape.radius;
    const auto beyond = [r](const geometry::Vec3d& p, const geometry::Vec3d& q) {
      return std::max({p.x - q.x, p.y - q.y, p.z - q.z}) - r;
    };
    return std::max(
        {0.0, beyond(min(shape.a, shape.b), counted.a), beyond(counted.b, max(shape.a, shape.b))});
  }

  std::size_t memoryUsage() const {
    const std::lock_guard<std::mutex> lock(build_mutex_);  // a first query may be building
    return sizeof(*this) + registry_.memoryUsage() + scene_.memoryUsage() +
           late_.capacity() * sizeof(Late);
  }

  SegmentId managedId(const char* call, const Object* object, const std::string& name) const {
    if (object == nullptr) refuse(call, name + " is null; pass a registered object");
    const SegmentId id = registry_.find(object);
    if (id == Registry::kNotFound) {
      refuse(call, name + " is not registered; register it first");
    }
    return id;
  }

 private:
  enum class State {
    kStale,    ///< objects were registered or unregistered; the next query reads all and builds
    kLate,     ///< few objects were registered; the next query reads those
    kCloned,   ///< the tree fits another manager's objects; the next query reads all and fits it
    kReady,    ///< the scene may be queried
    kRefused,  ///< the last update failed; the scene is neither old nor new
  };

  /// An object outside the tree.
  struct Late {
    SegmentId id;
    Segment segment;
  };

  /// Holds the scene ready and fixed while a query runs.
  class QueryScope {
   public:
    QueryScope(const Impl& impl, const char* call) : impl_(impl) {
      ++impl_.running_queries_;
      try {
        impl_.makeReady(call);
      } catch (...) {
        --impl_.running_queries_;
        throw;
      }
    }
    ~QueryScope() { --impl_.running_queries_; }
    QueryScope(const QueryScope&) = delete;
    QueryScope& operator=(const QueryScope&) = delete;

   private:
    const Impl& impl_;
  };

  void refuseDuringQuery(const char* call) const {
    if (running_queries_ != 0) {
      refuse(call, "a query is running; collect what is to be changed and change it afterwards");
    }
  }

  /// Several queries may be the first; one of them builds.
  void makeReady(const char* call) const {
    if (state_.load(std::memory_order_acquire) == State::kReady) return;
    const std::lock_guard<std::mutex> lock(build_mutex_);
    if (state_ == State::kReady) return;
    if (state_ == State::kRefused) {
      refuse(call, "the last update failed; mend the object it named and call update()");
    }
    catchUp(call);
  }

  bool hasTree() const {
    return state_ == State::kReady || state_ == State::kLate || state_ == State::kCloned;
  }
  void markStale() {
    if (hasTree()) state_ = State::kStale;
  }

  /// Objects stay outside the tree if they are few: a tree for them costs more than the tests that
  /// it would save.
  std::size_t mostLate(std::size_t more) const {
    constexpr std::size_t kFew = 16;
    const std::size_t size = registry_.size() + more;
    return std::min(size / 8, kFew + size / 256);
  }
  /// The objects just registered.
  void addLate(std::size_t count) {
    const auto end = static_cast<SegmentId>(registry_.objects().size());
    for (SegmentId id = end - static_cast<SegmentId>(count); id < end; ++id) {
      late_.push_back({id, Segment()});
    }
    if (state_ == State::kReady) state_ = State::kLate;
  }

  /// Reads what has to be read before a query.
  void catchUp(const char* call) const {
    if (state_ == State::kLate) return readLate(call);
    if (state_ != State::kCloned) return readAndBuild(call);
    state_ = State::kStale;  // should an object be refused on the way
    readAndFit(call);
  }

  void readAndFit(const char* call) const {
    late_read_ = 0;
    if (!scene_.update(newFrame(), in_scene_, reader(call))) return readAndBuild(call);
    readLate(call);
  }

  /// Those that have not been read yet.
  void readLate(const char* call) const {
    for (; late_read_ < late_.size(); ++late_read_) {
      Late& late = late_[late_read_];
      const Object& object = *objectOf(late.id);
      if (broadphase::readSegment(object, scene_.frame(), options_.bounds, late.segment) ==
          nullptr) {
        continue;
      }
      // It may be the frame that does not hold it; else building names it.
      if (state_ == State::kLate) state_ = State::kStale;
      return readAndBuild(call);
    }
    state_.store(State::kReady, std::memory_order_release);
  }

  void readAndBuild(const char* call) const {
    scene_.build(
        newFrame(), registry_.objects().size(),
        [this](auto&& admit) { return registry_.fibers(admit); }, reader(call));
    in_scene_ = registry_.objects().size();
    late_.clear();
    late_read_ = 0;
    gone_ = 0;
    state_.store(State::kReady, std::memory_order_release);
  }

  template <class Name>
  static Segment read(const char* call, const Object* object, const Frame& frame, Bounds bounds,
                      Name&& name) {
    Segment segment;
    if (const char* problem = broadphase::readSegment(*object, frame, bounds, segment)) {
      refuse(call, name() + ": " + problem);
    }
    return segment;
  }

  /// In the frame of the world, of those that are to be managed.
  Segment readNew(const char* call, const std::vector<Object*>& objects, std::size_t i) const {
    if (objects[i] == nullptr) refuse(call, nameOf(i) + " is null; pass objects only");
    return read(call, objects[i], Frame{}, options_.bounds, [i] { return nameOf(i); });
  }

  Segment readQueryObject(const char* call, const Object* object) const {
    return read(call, object, scene_.frame(), options_.bounds,
                [] { return std::string("the object passed"); });
  }

  Segment readOther(const char* call, const Object* object, std::size_t index) const {
    const auto name = [index] { return nameOf(index) + " of the other manager"; };
    if (object == nullptr) refuse(call, name() + " is null; mend that manager");
    return read(call, object, scene_.frame(), options_.bounds, name);
  }

  Frame newFrame() const { return broadphase::sceneFrame(registry_.objects(), options_.bounds); }

  /// Objects are large and lie anywhere.
  static constexpr std::size_t kPrefetchAhead = 8;
  FCL_FIBERS_ALWAYS_INLINE static void prefetchLines(const void* object, std::size_t count) {
    if (object == nullptr) return;
    const auto* lines = static_cast<const char*>(object);
    for (std::size_t line = 0; line < count; ++line) __builtin_prefetch(lines + 64 * line);
  }
  FCL_FIBERS_ALWAYS_INLINE static void prefetchObject(const std::vector<Object*>& objects,
                                                      std::size_t id) {
    if (id + kPrefetchAhead >= objects.size()) return;
    prefetchLines(objects[id + kPrefetchAhead], 4);
    // The object itself has arrived by now, and knows where its geometry is.
    if (objects[id] != nullptr) prefetchLines(ObjectMembers::shape(*objects[id]), 2);
  }

  /// Reads objects into the scene.
  auto reader(const char* call) const {
    return [this, call](SegmentId id, Segment& segment) {
      prefetchObject(registry_.objects(), static_cast<std::size_t>(id) + kPrefetchAhead);
      const Object* object = objectOf(id);
      if (object == nullptr) return false;
      if (const char* problem =
              broadphase::readSegment(*object, scene_.frame(), options_.bounds, segment)) {
        const auto& objects = registry_.objects();
        const auto before = std::count(objects.begin(), objects.begin() + id, nullptr);
        refuse(call, nameOf(static_cast<std::size_t>(id - before)) +
                         " in order of registration: " + problem);
      }
      return true;
    };
  }

  static bool isCapsule(const Object& object) {
    return ObjectMembers::shape(object)->getNodeType() == fcl::GEOM_CAPSULE;
  }

  /// Whether the two share an end, up to rounding: 4 ulp of the largest coordinate.
  static bool shareEnd(const Segment& p, const Segment& q) {
    const double largest = std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)});
    const double tolerance = 4 * double{std::numeric_limits<S>::epsilon()} * largest;
    for (const auto& end : {p.a, p.b}) {
      if (maxNorm(end - q.a) <= tolerance || maxNorm(end - q.b) <= tolerance) return true;
    }
    return false;
  }

  template <class Callback>
  static void requireCallback(const char* call, Callback callback) {
    if (callback == nullptr) refuse(call, "the callback is null; pass a function");
  }

  Object* objectOf(SegmentId id) const { return registry_.objects()[static_cast<std::size_t>(id)]; }
  /// As the scene has it; where it keeps none, as the object is now.
  Segment segmentOf(SegmentId id) const {
    if (isLate(id)) return findLate(id)->segment;
    if (scene_.keepsSegments()) return scene_.segment(id);
    Segment segment;
    reader("collide")(id, segment);
    return segment;
  }
  std::vector<Segment> allSegments() const {
    std::vector<Segment> segments(registry_.objects().size());
    forEachId([&](SegmentId id) {
      segments[static_cast<std::size_t>(id)] = segmentOf(id);
      return Visit::kContinue;
    });
    return segments;
  }

  bool areNeighbors(SegmentId a, SegmentId b) const {
    return neighbors_.ignoresAny() && registry_.areNeighbors(a, b, neighbors_);
  }

  // --- Distances ---

  /// Hands pairs to a distance callback and keeps the least distance that it has seen.
  class NearestCall {
   public:
    NearestCall(const Impl& impl, void* cdata, fcl::DistanceCallBack<S> callback)
        : scale_(impl.scene_.frame().scale), cdata_(cdata), callback_(callback) {}

    /// In the frame of the scene.
    double limit() const { return static_cast<double>(least_) * scale_; }

    Visit call(Object* first, Object* second, double& limit) {
      const bool stop = callback_(first, second, cdata_, least_);
      limit = this->limit();
      return stop ? Visit::kStop : Visit::kContinue;
    }

   private:
    double scale_;
    void* cdata_;
    fcl::DistanceCallBack<S> callback_;
    S least_ = std::numeric_limits<S>::max();
  };

  /// Whether what is at least this far may be nearer than the limit. A frame in which the limit is
  /// infinite, as it is between scenes of very different size, may not hold the distance either.
  static bool mayBeNearer(double lower_bound, double limit) {
    return lower_bound < limit || limit == std::numeric_limits<double>::infinity();
  }

  /// Whether a pair is worth a call of the distance callback, as far as the capsules say.
  /// @pre the scene keeps segments
  bool mayBeNearer(SegmentId a, const Segment& q, double q_error, double limit) const {
    if (limit == std::numeric_limits<double>::infinity()) return true;
    const Segment& p = scene_.segment(a);
    return touch(p, q, limit, endPointError(p) + q_error);
  }

  // --- Objects outside the tree: unbounded ones, and those registered since it was built ---

  enum class Among { kAll, kOutside };

  bool isUnbounded(SegmentId id) const {
    const auto& unbounded = scene_.unbounded();
    return std::binary_search(unbounded.begin(), unbounded.end(), id);
  }
  bool isLate(SegmentId id) const { return static_cast<std::size_t>(id) >= in_scene_; }
  auto findLate(SegmentId id) const {
    const auto late =
        std::lower_bound(late_.begin(), late_.end(), id,
                         [](const Late& object, SegmentId other) { return object.id < other; });
    return late != late_.end() && late->id == id ? late : late_.end();
  }
  bool isOutside(SegmentId id) const { return isLate(id) || isUnbounded(id); }
  bool hasOutside() const { return !late_.empty() || !scene_.unbounded().empty(); }

  /// Unregistered since the tree was built, which still has it.
  bool isGone(SegmentId id) const { return objectOf(id) == nullptr; }

  /// Whether a pair that was found from `outside` is to be reported there: of two outside objects,
  /// it is the later one's. The tree leaves out groups by itself.
  bool isPairOf(SegmentId id, SegmentId outside) const {
    return id != outside && !(id > outside && isOutside(id)) &&
           !registry_.areOfOneGroup(id, outside);
  }
  bool isPairWith(const Impl& other, SegmentId a, SegmentId b) const {
    const Object* partner = other.objectOf(b);
    if (isGone(a) || other.isGone(b) || objectOf(a) == partner) return false;
    // It may be managed here as well, as a neighbour or in the same group; looked up only if that
    // matters.
    const bool matters = neighbors_.ignoresAny() || registry_.hasGroups();
    return !matters || !isLeftOut(a, registry_.find(partner));
  }

  template <class F>
  Visit forEachOutside(F&& visit) const {
    for (const SegmentId id : scene_.unbounded()) {
      if (visit(id) == Visit::kStop) return Visit::kStop;
    }
    for (const Late& late : late_) {
      if (visit(late.id) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

  /// Every pair of managed objects of which one at least is outside the tree.
  template <class F>
  Visit findOutside(F&& report) const {
    return forEachOutside([&](SegmentId b) {
      const Segment segment = segmentOf(b);
      return findOne(segment, endPointError(segment), registry_.groupOf(b),
                     [&](SegmentId a) { return isPairOf(a, b) ? report(a, b) : Visit::kContinue; });
    });
  }

  /// Every managed object that is to be tested against this one apart from the tree: visit(id).
  template <class F>
  Visit forEachOutside(const Segment& segment, Among among, F&& visit) const {
    return isBounded(segment) || among == Among::kOutside ? forEachOutside(visit)
                                                          : forEachId(visit);
  }

  /// As the scene would have it, were both in its tree.
  bool meets(const Segment& p, const Segment& q, double q_error) const {
    const bool reports_capsules = options_.report == Report::kCapsules;
    const double margin = scene_.margin();
    if (p.isBox() || q.isBox() || (!reports_capsules && !is_wrapped_)) {
      const bool bounded = isBounded(p) && isBounded(q);
      return boxesTouch(p, q, bounded ? margin + q_error : margin);
    }
    const double error = endPointError(p) + q_error;
    if (reports_capsules) return touch(p, q, margin, error);
    const auto ball = [](const Segment& segment) {
      const geometry::Ball around = geometry::Ball::around(segment, 0);
      return Segment{around.center, around.center, around.radius};
    };
    return touch(ball(p), ball(q), margin, error);
  }

  // --- One segment against the scene, in the scene's frame ---

  // The tree's segments of the group are passed over; those outside the tree are not.

  /// Every managed object that meets the segment, as the options have it: on_hit(id).
  template <class F>
  Visit findOne(const Segment& segment, double error, tree::Group group, F&& on_hit,
                Among among = Among::kAll) const {
    if (isBounded(segment) && among == Among::kAll) {
      PairsTo sink([&](SegmentId a, SegmentId) { return on_hit(a); });
      if (scene_.findPairs(segment, error, group, sink) == Visit::kStop) return Visit::kStop;
    }
    return forEachOutside(segment, among, [&](SegmentId a) {
      return meets(segmentOf(a), segment, error) ? on_hit(a) : Visit::kContinue;
    });
  }

  /// Every managed object that may be nearer than the nearest so far: on_near(id, limit).
  template <class F>
  Visit findNearestOne(const Segment& segment, double error, tree::Group group,
                       const NearestCall& nearest, F&& on_near, Among among = Among::kAll) const {
    if (isBounded(segment) && among == Among::kAll) {
      NearestTo visitor([&](SegmentId a, SegmentId, double& limit) {
        const bool prune =
            options_.report == Report::kCapsules && !mayBeNearer(a, segment, error, limit);
        return prune ? Visit::kContinue : on_near(a, limit);
      });
      if (scene_.findNearest(segment, error, group, nearest.limit(), visitor) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    double limit = nearest.limit();
    return forEachOutside(segment, among, [&](SegmentId a) {
      return mayBeNearer(boxDistanceLowerBound(segmentOf(a), segment), limit) ? on_near(a, limit)
                                                                              : Visit::kContinue;
    });
  }

  Visit collideOne(const Segment& segment, Object* object, void* cdata,
                   fcl::CollisionCallBack<S> callback) const {
    const SegmentId self = registry_.find(object);
    return findOne(segment, endPointError(segment), groupOf(self), [&](SegmentId a) {
      if (isLeftOut(a, self)) return Visit::kContinue;
      return callback(objectOf(a), object, cdata) ? Visit::kStop : Visit::kContinue;
    });
  }

  Visit distanceOne(const Segment& segment, Object* object, NearestCall& nearest) const {
    const SegmentId self = registry_.find(object);
    return findNearestOne(
        segment, endPointError(segment), groupOf(self), nearest, [&](SegmentId a, double& limit) {
          return isLeftOut(a, self) ? Visit::kContinue : nearest.call(objectOf(a), object, limit);
        });
  }

  tree::Group groupOf(SegmentId self) const {
    return self == Registry::kNotFound ? tree::kNoGroup : registry_.groupOf(self);
  }
  bool isLeftOut(SegmentId a, SegmentId self) const {
    return isGone(a) || (self != Registry::kNotFound &&
                         (a == self || areNeighbors(a, self) || registry_.areOfOneGroup(a, self)));
  }

  /// Every pair with an object of another fiber manager: by tree(), where both have trees of one
  /// kind, and by one(segment, error, id, among) for what the trees do not hold, the segment in
  /// this scene's frame.
  template <class TreePairs, class OnePairs>
  Visit visitBetween(const Impl& other, TreePairs&& tree, OnePairs&& one) const {
    const FrameChange to_this(other.scene_.frame(), scene_.frame());
    const auto meet = [&](SegmentId b, Among among) {
      const Segment segment = to_this(other.segmentOf(b));
      return one(segment, to_this.error(segment), b, among);
    };
    const bool matches = scene_.matches(other.scene_);
    if (matches && tree() == Visit::kStop) return Visit::kStop;
    if (matches && !hasOutside() && !other.hasOutside()) return Visit::kContinue;
    return other.forEachId([&](SegmentId b) {
      return meet(b, matches && !other.isOutside(b) ? Among::kOutside : Among::kAll);
    });
  }

  template <class F>
  Visit forEachId(F&& visit) const {
    for (std::size_t id = 0; id < registry_.objects().size(); ++id) {
      if (registry_.objects()[id] != nullptr && visit(static_cast<SegmentId>(id)) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  const FiberManagerOptions options_;
  const bool is_wrapped_;
  const tree::NeighborRule neighbors_;
  Registry registry_;
  std::optional<Segment> last_registered_;  ///< a capsule that the next one may continue

  mutable std::vector<Late> late_;     ///< registered since the tree was built; ids ascend
  mutable std::size_t late_read_ = 0;  ///< the first of these have been read
  mutable std::size_t gone_ = 0;       ///< number of those unregistered since then
  mutable std::size_t in_scene_ = 0;   ///< ids that the scene knows

  // The first query after registering builds the scene, on whichever thread it runs.
  mutable Scene scene_;
  mutable std::mutex build_mutex_;
  mutable std::atomic<State> state_{State::kStale};
  mutable std::atomic<int> running_queries_{0};
};

template <typename S>
FiberCollisionManager<S>::FiberCollisionManager(Hierarchy hierarchy,
                                                const FiberManagerOptions& options)
    : hierarchy_(hierarchy), options_(Impl::checked(options)) {
  impl();
}

template <typename S>
FiberCollisionManager<S>::FiberCollisionManager(const FiberCollisionManager& original,
                                                const std::vector<Object*>& objects)
    : hierarchy_(original.hierarchy_),
      options_(original.options_),
      impl_(std::make_unique<Impl>("clone", hierarchy_, options_, original.impl(), objects)) {
  // Of one that was moved from there is nothing to copy.
  if (original.impl_ == nullptr) impl_ = nullptr;
}

// FCL's base class has nothing that ours use.
template <typename S>
FiberCollisionManager<S>::FiberCollisionManager(FiberCollisionManager&& other) noexcept
    : hierarchy_(other.hierarchy_), options_(other.options_), impl_(std::move(other.impl_)) {}

template <typename S>
FiberCollisionManager<S>& FiberCollisionManager<S>::operator=(
    FiberCollisionManager&& other) noexcept {
  hierarchy_ = other.hierarchy_;
  options_ = other.options_;
  impl_ = std::move(other.impl_);
  return *this;
}

template <typename S>
typename FiberCollisionManager<S>::Impl& FiberCollisionManager<S>::impl() {
  if (impl_ == nullptr) impl_ = std::make_unique<Impl>(hierarchy_, options_);
  return *impl_;
}

template <typename S>
const typename FiberCollisionManager<S>::Impl& FiberCollisionManager<S>::impl() const {
  // Of one that was moved from several threads may ask, so that it is not made here.
  static const Impl empty(Hierarchy::kLayeredBoxes, {});
  return impl_ == nullptr ? empty : *impl_;
}

template <typename S>
FiberCollisionManager<S>::~FiberCollisionManager() = default;

template <typename S>
void FiberCollisionManager<S>::registerFiber(const std::vector<Object*>& fiber, FiberEnds ends,
                                             FiberGroup group) {
  impl().add("registerFiber", fiber,
             ends == FiberEnds::kClosed ? Impl::Fibers::kClosed : Impl::Fibers::kOpen,
             group.number);
}

template <typename S>
void FiberCollisionManager<S>::registerObjects(const std::vector<Object*>& objects) {
  impl().add("registerObjects", objects, Impl::Fibers::kGuessed);
}

template <typename S>
void FiberCollisionManager<S>::registerObject(Object* object) {
  impl().add("registerObject", {object}, Impl::Fibers::kGuessed);
}

template <typename S>
void FiberCollisionManager<S>::unregisterObject(Object* object) {
  impl().remove("unregisterObject", object);
}

template <typename S>
void FiberCollisionManager<S>::setup() {
  impl().setup("setup");
}

template <typename S>
void FiberCollisionManager<S>::update() {
  impl().update("update");
}

template <typename S>
void FiberCollisionManager<S>::update(Object* object) {
  impl().update("update", {object});
}

template <typename S>
void FiberCollisionManager<S>::update(const std::vector<Object*>& objects) {
  impl().update("update", objects);
}

template <typename S>
void FiberCollisionManager<S>::clear() {
  impl().clear("clear");
}

template <typename S>
void FiberCollisionManager<S>::getObjects(std::vector<Object*>& objects) const {
  objects.clear();
  objects.reserve(size());
  for (Object* object : impl().registry().objects()) {
    if (object != nullptr) objects.push_back(object);
  }
}

template <typename S>
void FiberCollisionManager<S>::collide(Object* object, void* cdata,
                                       fcl::CollisionCallBack<S> callback) const {
  impl().collide("collide", object, cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::collide(void* cdata, fcl::CollisionCallBack<S> callback) const {
  impl().collide("collide", cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::collide(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                                       fcl::CollisionCallBack<S> callback) const {
  if (other == nullptr) refuse("collide", "the manager is null; pass a manager");
  if (other == this) return collide(cdata, callback);
  if (const auto* fibers = dynamic_cast<const FiberCollisionManager*>(other)) {
    return impl().collide("collide", fibers->impl(), cdata, callback);
  }
  std::vector<Object*> objects;
  other->getObjects(objects);
  impl().collideAll("collide", objects, cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::distance(Object* object, void* cdata,
                                        fcl::DistanceCallBack<S> callback) const {
  impl().distance("distance", object, cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::distance(void* cdata, fcl::DistanceCallBack<S> callback) const {
  impl().distance("distance", cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::distance(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                                        fcl::DistanceCallBack<S> callback) const {
  if (other == nullptr) refuse("distance", "the manager is null; pass a manager");
  if (other == this) return distance(cdata, callback);
  if (const auto* fibers = dynamic_cast<const FiberCollisionManager*>(other)) {
    return impl().distance("distance", fibers->impl(), cdata, callback);
  }
  std::vector<Object*> objects;
  other->getObjects(objects);
  impl().distanceAll("distance", objects, cdata, callback);
}

template <typename S>
bool FiberCollisionManager<S>::empty() const {
  return size() == 0;
}

template <typename S>
std::size_t FiberCollisionManager<S>::size() const {
  return impl().registry().size();
}

template <typename S>
const FiberManagerOptions& FiberCollisionManager<S>::options() const {
  return options_;
}

template <typename S>
bool FiberCollisionManager<S>::isRegistered(const Object* object) const {
  return object != nullptr && impl().registry().find(object) != Impl::Registry::kNotFound;
}

template <typename S>
FiberSegment FiberCollisionManager<S>::fiberSegment(const Object* object) const {
  return impl().registry().fiberSegment(
      impl().managedId("fiberSegment", object, "the object passed"));
}

template <typename S>
bool FiberCollisionManager<S>::movedSinceUpdate() const {
  return impl().movedSinceUpdate();
}

template <typename S>
double FiberCollisionManager<S>::margin(const Object* object) const {
  return impl().marginOf("margin", object);
}

template <typename S>
std::size_t FiberCollisionManager<S>::memoryUsage() const {
  return impl().memoryUsage();
}

template <typename S>
LayeredAABBTreeCollisionManager<S>::LayeredAABBTreeCollisionManager(
    const FiberManagerOptions& options)
    : FiberCollisionManager<S>(FiberCollisionManager<S>::Hierarchy::kLayeredBoxes, options) {}

template <typename S>
LayeredAABBTreeCollisionManager<S>::LayeredAABBTreeCollisionManager(
    const LayeredAABBTreeCollisionManager& original, const std::vector<Object*>& objects)
    : FiberCollisionManager<S>(original, objects) {}

template <typename S>
std::unique_ptr<LayeredAABBTreeCollisionManager<S>> LayeredAABBTreeCollisionManager<S>::clone(
    const std::vector<Object*>& objects) const {
  return std::unique_ptr<LayeredAABBTreeCollisionManager>(
      new LayeredAABBTreeCollisionManager(*this, objects));
}

template <typename S>
WrappedSphereTreeCollisionManager<S>::WrappedSphereTreeCollisionManager(
    const FiberManagerOptions& options)
    : FiberCollisionManager<S>(FiberCollisionManager<S>::Hierarchy::kWrappedSpheres, options) {}

template <typename S>
WrappedSphereTreeCollisionManager<S>::WrappedSphereTreeCollisionManager(
    const WrappedSphereTreeCollisionManager& original, const std::vector<Object*>& objects)
    : FiberCollisionManager<S>(original, objects) {}

template <typename S>
std::unique_ptr<WrappedSphereTreeCollisionManager<S>> WrappedSphereTreeCollisionManager<S>::clone(
    const std::vector<Object*>& objects) const {
  return std::unique_ptr<WrappedSphereTreeCollisionManager>(
      new WrappedSphereTreeCollisionManager(*this, objects));
}

template class FiberCollisionManager<float>;
template class FiberCollisionManager<double>;
template class LayeredAABBTreeCollisionManager<float>;
template class LayeredAABBTreeCollisionManager<double>;
template class WrappedSphereTreeCollisionManager<float>;
template class WrappedSphereTreeCollisionManager<double>;

}  // namespace fcl_fibers
