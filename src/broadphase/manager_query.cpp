// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/manager_query.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>

#include "broadphase/pair_rules.h"
#include "broadphase/scene.h"
#include "geometry/impact.h"
#include "geometry/touch.h"
#include "index/pair_query.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Segment;
using tree::Visit;

/// One query of one manager. Each search of an index fills in what its pairs are, and this decides
/// which of them the callback gets.
template <typename S>
class Search final : index::PairSink, index::NearestSink {
 public:
  using State = ManagerState<S>;
  using Object = fcl::CollisionObject<S>;
  using Registry = ObjectRegistry<S>;
  using Sink = Generations::Sink;

  Search(const State& state, const ManagerQuery<S>& query)
      : query_(checked(query)),
        state_(state),
        moves_(!query.is_for_distances && state.options().motion),
        scope_(state, query.name()),
        own_(query.name(), state, state, moves_),
        sink_(query.is_for_distances ? Sink(static_cast<index::NearestSink&>(*this))
                                     : Sink(static_cast<index::PairSink&>(*this))) {}

  void self();
  void with(const State& other);
  void with(Object* object);
  void with(const std::vector<Object*>& others);

 private:
  /// Where one of a pair is found: in the tree of a scene by its id, beside the tree by its place,
  /// or it is the one object that is asked about.
  struct Side {
    const Scene<S>* scene;
    const Partner<S>* one = nullptr;
    bool is_beside = false;

    SegmentId id(SegmentId found) const {
      if (one != nullptr) return one->id;
      return is_beside ? scene->state().obstacles().beside().ids()[static_cast<std::size_t>(found)]
                       : found;
    }
    bool isTree() const { return one == nullptr && !is_beside; }
    /// @pre it is not in the tree
    Segment box(SegmentId found) const {
      return one != nullptr ? one->segment.end : entry(found).end.box;
    }
    /// Whether it is a mesh, and not in the tree.
    bool isMesh(SegmentId found) const {
      return one != nullptr ? one->mesh != nullptr : is_beside && entry(found).is_mesh;
    }
    const typename Obstacles<S>::BesideEntry& entry(SegmentId found) const {
      return scene->state().obstacles().beside()[static_cast<std::size_t>(found)];
    }
    /// Returns null if it cannot be read.
    const Partner<S>* find(SegmentId found, Partner<S>& place) const {
      if (one != nullptr) return one;
      return scene->find(id(found), place) ? &place : nullptr;
    }
  };
  /// What a search leaves to be tested.
  enum class Test { kNothing, kShapes, kSegmentsAndShapes };

  static const ManagerQuery<S>& checked(const ManagerQuery<S>& query) {
    if (query.collision == nullptr && query.distance == nullptr) {
      fibers::throwInvalidArgument(query.name(), "the callback is null; pass a function");
    }
    return query;
  }

  /// @param others  the registry of the partners, or null if object_ is the only one
  void setOthers(const Registry* others, SegmentId young_begin = Registry::kNotFound) {
    others_ = others;
    rules_.emplace(state_.registry(), others, young_begin);
  }
  /// @param own    of the manager that is asked
  /// @param other  of the same manager or of another one, or one object
  void begin(const Side& own, const Side& other, Test test) {
    first_ = own;
    second_ = other;
    test_ = own_.countsShapes() || test != Test::kShapes ? test : Test::kNothing;
    is_plain_ = test_ == Test::kNothing && first_.isTree() && second_.isTree();
    sifts_ = true;
    searched_ = &own_;
    seen_.reset();
  }

  /// Throws RefusedObject if the object cannot be read.
  Visit searchAll(Object& object) {
    const Partner<S> one = own_.ofProgram(object);
    object_ = &object;
    setOthers(one.id != Registry::kNotFound ? &state_.registry() : nullptr);
    return searchAll(one, own_);
  }
  /// @param scene  of the object if it has one
  Visit searchAll(const Partner<S>& one, const Scene<S>& scene) {
    return searchTree(own_, one, scene) == Visit::kStop ? Visit::kStop : searchBeside(one, scene);
  }
  Visit searchTree(const Scene<S>& in, const Partner<S>& one, const Scene<S>& scene);
  Visit searchBeside(const Partner<S>& one, const Scene<S>& scene);
  Visit searchTreeBesideOwn(const Scene<S>& theirs);
  Visit searchTreeWithBeside(const Scene<S>& theirs);
  /// Whether the pairs of a segment and a mesh are those of the mesh's box, each of which is asked
  /// about then. A search of few segments ends before one for each mesh has begun, and what is no
  /// capsule counts by its box anyway.
  bool asksEach() const {
    constexpr std::size_t kFew = 64;
    const Generations& segments = state_.generations();
    return !moves_ && !query_.is_for_distances &&
           (segments.size() <= kFew || !own_.hasCapsulesInTree());
  }

  /// An object that is found, or the one that is asked about.
  Object* partner(SegmentId b) const { return others_ != nullptr ? (*others_)[b] : object_; }
  /// Whether the rules report a pair.
  /// @tparam kIsPlain  see is_plain_
  template <bool kIsPlain>
  bool isReported(SegmentId found, SegmentId second) const;
  /// Whether the callback ends the query.
  /// @pre isReported()
  template <bool kIsPlain>
  bool handOn(SegmentId found, SegmentId second);
  bool pair(SegmentId found, SegmentId second) {
    if (seen_ && !seen_->insert(found).second) return false;
    return isReported<false>(found, second) && handOn<false>(found, second);
  }
  bool mayTouch(SegmentId found, SegmentId second) const;

  // The rules come first: they are quick, and leave out the many neighbours. All threads ask them.
  std::size_t sift(tree::Pair* pairs, geometry::Impact* impacts, std::size_t count) const override {
    return !sifts_     ? count
           : is_plain_ ? sift<true>(pairs, impacts, count)
                       : sift<false>(pairs, impacts, count);
  }
  template <bool kIsPlain>
  std::size_t sift(tree::Pair* pairs, geometry::Impact* impacts, std::size_t count) const {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!isReported<kIsPlain>(pairs[i].a, pairs[i].b)) continue;
      if (impacts != nullptr) impacts[kept] = impacts[i];
      pairs[kept++] = pairs[i];
    }
    return kept;
  }
  Visit take(const index::PairRun& run) override {
    // Most scenes have only capsules, and pay for no more than the rules.
    const bool is_plain = is_plain_, sifts = sifts_;
    for (const tree::Pair* found = run.pairs; found != run.pairs + run.count; ++found) {
      const SegmentId a = found->a, b = found->b;
      if (is_plain ? handOn<true>(a, b) : sifts ? handOn<false>(a, b) : pair(a, b)) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }
  /// How far apart a pair may be, in the frame of a manager. Margins and steps have no effect on
  /// distances.
  double reachIn(const State& state) const {
    return query_.is_for_distances ? static_cast<double>(least_) * state.frame().scale
                                   : state.generations().margin();
  }
  double limit() const override { return reachIn(searched_->state()); }
  const index::SegmentSource* source() const override { return &searched_->source(); }
  Visit visit(SegmentId a, SegmentId b, double& nearer_than) override {
    const bool stop = pair(a, b);
    nearer_than = limit();
    return stop ? Visit::kStop : Visit::kContinue;
  }

  const ManagerQuery<S> query_;
  const State& state_;
  const bool moves_;
  const typename State::QueryScope scope_;
  const Scene<S> own_;
  const Sink sink_;
  S least_ = std::numeric_limits<S>::max();  ///< distance so far
  std::optional<PairRules<S>> rules_;
  const Registry* others_ = nullptr;
  Object* object_ = nullptr;
  bool is_self_ = false;

  // Of the present search.
  Side first_{}, second_{};
  Test test_ = Test::kNothing;
  const Scene<S>* searched_ = nullptr;
  bool is_plain_ = false;  ///< whether its pairs have ids, about which the rules alone decide
  bool sifts_ = true;  ///< whether sift() asks the rules; otherwise one pair of a segment is enough
  std::optional<std::unordered_set<SegmentId>> seen_;  ///< if it hands on some several times
};

template <typename S>
template <bool kIsPlain>
FCL_FIBERS_ALWAYS_INLINE bool Search<S>::isReported(SegmentId found, SegmentId second) const {
  if (!kIsPlain && first_.one != nullptr) std::swap(found, second);
  const SegmentId b = kIsPlain ? second : second_.id(second);
  return rules_->report(kIsPlain ? found : first_.id(found), b, partner(b));
}

template <typename S>
template <bool kIsPlain>
FCL_FIBERS_ALWAYS_INLINE bool Search<S>::handOn(SegmentId found, SegmentId second) {
  if (!kIsPlain && first_.one != nullptr) std::swap(found, second);
  if (!kIsPlain && test_ != Test::kNothing && !mayTouch(found, second)) return false;
  const SegmentId a = kIsPlain ? found : first_.id(found),
                  b = kIsPlain ? second : second_.id(second);
  Object *one = state_.registry()[a], *other = partner(b);
  if (is_self_ && a > b) std::swap(one, other);
  return query_.is_for_distances ? query_.distance(one, other, query_.cdata, least_)
                                 : query_.collision(one, other, query_.cdata);
}

template <typename S>
bool Search<S>::mayTouch(SegmentId found, SegmentId second) const {
  const Scene<S>& scene = *second_.scene;
  if (test_ == Test::kShapes && first_.isTree() && (&scene == &own_ || !second_.isTree())) {
    const Generations& segments = state_.generations();
    const Segment p = segments.segment(found);
    const Segment q = second_.isTree() ? segments.segment(second) : second_.box(second);
    // Capsules were tested as such, and two other boxes are all that is known.
    if (p.isBox() ? p.isOtherBox() && q.isOtherBox() : !q.isBox()) return true;
  }
  if (first_.isMesh(found) && second_.isMesh(second)) return true;
  // It is asked about as a mesh.
  if (second_.isTree() && scene.isMeshInTree(*scene.state().registry()[second])) return false;
  Partner<S> p_place, q_place;
  const Partner<S>* p = first_.find(found, p_place);
  const Partner<S>* q = second_.find(second, q_place);
  if (p == nullptr || q == nullptr) return true;
  const double reach = reachIn(state_), error = p->error + q->error;
  geometry::Impact impact;
  if (test_ == Test::kSegmentsAndShapes &&
      !(moves_ ? findImpact(p->segment, q->segment, reach, error, /*from=*/0, impact)
               : touch(p->segment.end, q->segment.end, reach, error))) {
    return false;
  }
  return own_.mayTouch(*p, *q, scene, reach);
}

/// Finds the partners of one object in the tree of a scene, where its id and that of a segment are
/// the first and second number of a pair.
template <typename S>
Visit Search<S>::searchTree(const Scene<S>& in, const Partner<S>& one, const Scene<S>& scene) {
  const bool is_own = &in == &own_;
  const Side tree{&in}, single{&scene, &one};
  is_own ? begin(tree, single, Test::kNothing) : begin(single, tree, Test::kNothing);
  searched_ = &in;
  const Generations& segments = in.state().generations();
  const bool is_mesh = one.mesh != nullptr && !(is_own && asksEach());
  if (!is_mesh && is_own && isBounded(one.segment.start) && isBounded(one.segment.end)) {
    const Segment& end = one.segment.end;
    if ((own_.hasShapesInTree() || end.isBox()) &&
        (own_.hasCapsulesInTree() || !end.isOtherBox())) {
      begin(tree, single, Test::kShapes);
    }
    const bool is_managed = &scene == &own_ && one.id != Registry::kNotFound;
    const tree::Group group =
        is_managed ? state_.registry().fibers().groupOf(one.id) : tree::kNoGroup;
    is_plain_ = test_ == Test::kNothing;
    return segments.search(one.segment, one.error, group, std::max(one.id, 0), sink_);
  }
  const geometry::FrameChange change(in.state().frame(), state_.frame());
  const Segment around = aroundStep(one.segment);
  // Volumes without segments have half of the margin already.
  const bool has_padding = !segments.keepsSegments() && !query_.is_for_distances;
  const double padding = has_padding ? segments.margin() / 2 * change.scale() : 0;
  // An object that counts by its box meets the boxes of others.
  const MovingShape& shape = scene.shapeOf(one);
  const bool has_plane = own_.countsShapes() && shape.is_moved_only && !segments.hasBoxes();
  const auto isNear = [&](const geometry::Box& box) {
    const geometry::Box its = change.isIdentity() ? box : change(box);
    const double reach = reachIn(state_);
    // At distance 0 a query for distances has its answer.
    return (reach > 0 || !query_.is_for_distances) &&
           geometry::isNear(its, around, reach - padding) &&
           !(has_plane && !mayReach(its, shape.end, shape.way, reach, shape.way_error));
  };
  if (is_mesh) {
    const double margin = state_.options().margin;
    const auto search = [&](const index::PosedMesh& mesh) {
      sifts_ = false;
      if (moves_ || query_.is_for_distances) seen_.emplace();
      return segments.searchMesh(mesh, margin, sink_);
    };
    if (moves_) return search(*in.state().movingMesh(*one.mesh));
    // No triangles are read for a mesh that is far from all segments.
    const auto stop = [](SegmentId) { return Visit::kStop; };
    if (!query_.is_for_distances && segments.visitNear(false, isNear, stop) == Visit::kContinue) {
      return Visit::kContinue;
    }
    const auto& mesh = scene.withTriangles(*one.mesh);
    if (mesh.end.hasTriangles()) return search({mesh.placed(), in.state().frame()});
  }
  if (segments.keepsSegments()) test_ = Test::kSegmentsAndShapes;
  return segments.visitNear(moves_, isNear, [&](SegmentId found) {
    return pair(found, 0) ? Visit::kStop : Visit::kContinue;
  });
}

/// Finds the partners of one object beside the tree.
template <typename S>
Visit Search<S>::searchBeside(const Partner<S>& one, const Scene<S>& scene) {
  const Obstacles<S>& obstacles = state_.obstacles();
  if (obstacles.beside().size() == 0) return Visit::kContinue;
  begin({&own_, nullptr, /*is_beside=*/true}, {&scene, &one}, Test::kShapes);
  return obstacles.boxes().search(one.segment, one.error, tree::kNoGroup, 0, sink_);
}

template <typename S>
void Search<S>::self() {
  const Generations& segments = state_.generations();
  const Obstacles<S>& obstacles = state_.obstacles();
  is_self_ = true;
  setOthers(&state_.registry(), segments.youngBegin());
  begin({&own_}, {&own_},
        own_.hasShapesInTree() && own_.hasCapsulesInTree() ? Test::kShapes : Test::kNothing);
  if (segments.search(sink_) == Visit::kStop) return;
  if (obstacles.beside().size() == 0) return;
  setOthers(&state_.registry());
  if (searchTreeWithBeside(own_) == Visit::kStop) return;
  const Side beside{&own_, nullptr, /*is_beside=*/true};
  begin(beside, beside, Test::kShapes);
  obstacles.boxes().search(sink_);
}

template <typename S>
void Search<S>::with(const State& other) {
  const typename State::QueryScope other_scope(other, query_.name());
  const Scene<S> theirs(query_.name(), other, state_, moves_);
  setOthers(&other.registry());
  const bool has_shapes = own_.hasShapesInTree() || theirs.hasShapesInTree();
  const bool has_capsules = own_.hasCapsulesInTree() || theirs.hasCapsulesInTree();
  begin({&own_}, {&theirs}, has_shapes && has_capsules ? Test::kShapes : Test::kNothing);
  const Visit visit = state_.generations().search(other.generations(), theirs.source(), sink_);
  if (visit == Visit::kStop || searchTreeBesideOwn(theirs) == Visit::kStop) return;
  if (searchTreeWithBeside(theirs) == Visit::kStop) return;
  for (const auto& entry : other.obstacles().beside()) {
    if (entry.object == nullptr || state_.obstacles().beside().size() == 0) continue;
    if (searchBeside(theirs.partnerOf(entry), theirs) == Visit::kStop) return;
  }
  for (SegmentId b = 0; theirs.hasMeshesInTree() && b < other.registry().idCount(); ++b) {
    const Object* object = other.registry()[b];
    if (object == nullptr || !theirs.isMeshInTree(*object)) continue;
    Partner<S> mesh;
    named(
        query_.name(), [&](SegmentId) { return theirs.source().nameOf(b); },
        [&] { theirs.find(b, mesh); });
    if (searchAll(mesh, theirs) == Visit::kStop) return;
  }
}

template <typename S>
void Search<S>::with(Object* object) {
  if (object == nullptr) {
    fibers::throwInvalidArgument(query_.name(), "the object is null; pass an object");
  }
  named(query_.name(), "the given object", [&] { searchAll(*object); });
}

template <typename S>
void Search<S>::with(const std::vector<Object*>& others) {
  std::size_t i = 0;
  const auto name = [&](SegmentId) { return nameOf(i) + " of the other manager"; };
  named(query_.name(), name, [&] {
    for (; i < others.size() && state_.registry().size() > 0; ++i) {
      if (others[i] == nullptr) {
        fibers::throwInvalidArgument(query_.name(),
                                     name(0) + " is null; remove it from that manager");
      }
      if (searchAll(*others[i]) == Visit::kStop) return;
    }
  });
}

/// Finds what is in this manager's tree and touches what the other one, or the same one, has beside
/// its tree.
template <typename S>
Visit Search<S>::searchTreeWithBeside(const Scene<S>& theirs) {
  const Generations& segments = state_.generations();
  const Obstacles<S>& obstacles = theirs.state().obstacles();
  if (obstacles.beside().size() == 0 || segments.size() == 0) return Visit::kContinue;
  if (asksEach() && segments.keepsSegments()) {
    begin({&own_}, {&theirs, nullptr, /*is_beside=*/true}, Test::kShapes);
    return segments.search(obstacles.boxes(), theirs.source(), sink_);
  }
  for (const auto& entry : obstacles.beside()) {
    if (entry.object == nullptr) continue;
    if (searchTree(own_, theirs.partnerOf(entry), theirs) == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

/// Finds what is in the other manager's tree and touches what this manager has beside its own.
template <typename S>
Visit Search<S>::searchTreeBesideOwn(const Scene<S>& theirs) {
  const State& other = theirs.state();
  const Generations& segments = other.generations();
  const auto& beside = state_.obstacles().beside();
  // What counts by its volume there counts by its shape here, and wrapped spheres have no steps.
  const bool is_read_again = (moves_ && segments.options().wrapped_spheres) ||
                             (!segments.keepsSegments() &&
                              (own_.countsShapes() || state_.generations().isSwampedBy(segments)));
  if (!is_read_again) {
    for (const auto& entry : beside) {
      if (entry.object == nullptr) continue;
      if (searchTree(theirs, own_.partnerOf(entry), own_) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  for (SegmentId b = 0; beside.size() > 0 && b < other.registry().idCount(); ++b) {
    const Object* object = other.registry()[b];
    if (object == nullptr || theirs.isMeshInTree(*object) || other.obstacles().isBeside(b))
      continue;
    Partner<S> one;
    if (!theirs.find(b, one)) continue;
    if (searchBeside(one, theirs) == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

}  // namespace

template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query) {
  Search<S>(state, query).self();
}

template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query, const ManagerState<S>& other) {
  if (&state == &other) return ask(state, query);
  Search<S>(state, query).with(other);
}

template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query,
         fcl::CollisionObject<S>* object) {
  Search<S>(state, query).with(object);
}

template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query,
         const std::vector<fcl::CollisionObject<S>*>& others) {
  Search<S>(state, query).with(others);
}

#define FCL_FIBERS_INSTANTIATE(S)                                                              \
  template void ask(const ManagerState<S>&, const ManagerQuery<S>&);                           \
  template void ask(const ManagerState<S>&, const ManagerQuery<S>&, const ManagerState<S>&);   \
  template void ask(const ManagerState<S>&, const ManagerQuery<S>&, fcl::CollisionObject<S>*); \
  template void ask(const ManagerState<S>&, const ManagerQuery<S>&,                            \
                    const std::vector<fcl::CollisionObject<S>*>&);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
