// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "broadphase/manager_calls.h"
#include "broadphase/manager_state.h"
#include "broadphase/pair_rules.h"
#include "broadphase/shape_reach.h"
#include "geometry/impact.h"
#include "geometry/touch.h"

namespace fcl_fibers::broadphase {

/// The queries of a manager. `Call` is CollisionCall or DistanceCall.
template <typename S, class Call>
class ManagerQueries {
 public:
  using State = ManagerState<S>;
  using Object = fcl::CollisionObject<S>;

  ManagerQueries(const State& state, Call& call)
      : state_(state),
        moves_(Call::kLooksAtSteps && state.options().motion),
        scope_(state, Call::kName),
        rules_(state.registry(), state.generations().youngBegin()),
        reach_(state, moves_),
        call_(call) {}

  /// Finds the pairs among the manager's objects.
  void self() {
    const auto report = [this](SegmentId a, SegmentId b, bool is_beside, auto&& mayTouch,
                               Call& call) {
      if (a > b) std::swap(a, b);
      return rules_.reports(a, b, is_beside) && mayTouch() &&
             call(state_.registry()[a], state_.registry()[b]);
    };
    // The rules come first: they are quick, and leave out the many neighbours.
    const auto within_tree = [&](SegmentId a, SegmentId b, Call& call) {
      const auto may_touch = [&] { return reach_.mayTouch(a, b, call.reach(state_)); };
      return report(a, b, /*is_beside=*/false, may_touch, call);
    };
    if (search(within_tree) == tree::Visit::kStop) return;
    for (const Entry& entry : state_.obstacles().beside()) {
      if (entry.object == nullptr) continue;
      const auto with_entry = [&](SegmentId a, Call& call) {
        const auto touches = [] { return true; };
        return report(a, entry.id, /*is_beside=*/true, touches, call);
      };
      if (searchTree(state_, entry, shapeOf(entry), with_entry) == tree::Visit::kStop) return;
    }
    if (state_.obstacles().beside().size() == 0) return;
    const auto beside = [&](SegmentId a, SegmentId b, Call& call) {
      const Entry &first = at(a), &second = at(b);
      if (first.object == nullptr || second.object == nullptr) return false;
      const auto may_touch = [&] { return mayTouch(first, second, shapeOf(second), call); };
      return report(first.id, second.id, /*is_beside=*/true, may_touch, call);
    };
    Sink<decltype(beside)> sink(call_, state_, beside);
    state_.obstacles().boxes().search(sink);
  }

  /// Finds the pairs with an object, managed or not.
  void with(Object* object) {
    if (object == nullptr) {
      fibers::throwInvalidArgument(Call::kName, "the object is null; pass an object");
    }
    named(Call::kName, "the given object", [&] { searchOne(object); });
  }

  /// Finds the pairs with the objects of another manager class. It reads each object only when its
  /// turn comes, which saves time if the query ends early.
  void with(const std::vector<Object*>& others) {
    std::size_t i = 0;
    const auto name = [&](SegmentId) { return nameOf(i) + " of the other manager"; };
    named(Call::kName, name, [&] {
      for (; i < others.size() && state_.registry().size() > 0; ++i) {
        if (others[i] == nullptr) {
          fibers::throwInvalidArgument(Call::kName,
                                       name(0) + " is null; remove it from that manager");
        }
        if (searchOne(others[i]) == tree::Visit::kStop) return;
      }
    });
  }

  /// Finds the pairs with the objects of another fiber manager.
  void with(const State& other) {
    const typename State::QueryScope other_scope(other, Call::kName);
    if (searchTrees(other) == tree::Visit::kStop) return;
    if (searchOwnBeside(other) == tree::Visit::kStop) return;
    const FrameOfOther change(other.generations().frame(), frame());
    const ReachOfOther<S> reach(state_, other, moves_);
    for (const Entry& entry : other.obstacles().beside()) {
      if (entry.object == nullptr) continue;
      // A contact of this pair is asked for by this manager's means.
      if (entry.mesh != nullptr && countsTriangles(state_.options())) {
        state_.obstacles().cache().keep(entry.object->collisionGeometry(), entry.mesh);
      }
      const MovingShape shape = entry.is_mesh ? MovingShape{} : reach.shape(entry.id, entry.box);
      if (searchBeside(other, inFrameOf(other, change, entry), shape) == tree::Visit::kStop) return;
    }
    if (!readsMeshesOf(other)) return;
    for (SegmentId b = 0; b < other.registry().idCount(); ++b) {
      const Object* object = other.registry()[b];
      if (object == nullptr || !isMesh(*object)) continue;
      const fibers::FiberTable& table = other.registry().fibers();
      const bool is_solid = table.isSolid(b);
      const auto name = [&](SegmentId) { return other.source("").nameOf(b); };
      const BesideReading mesh = named(Call::kName, name, [&] {
        return readMesh(*object, is_solid, frame(), other.options().bounds,
                        state_.obstacles().cache());
      });
      const Entry entry =
          Entry::resting(mesh, other.registry()[b], b, is_solid, table.partyOf(b).categories);
      if (searchBeside(other, entry, {}) == tree::Visit::kStop) return;
    }
  }

 private:
  using Entry = typename Obstacles<S>::BesideEntry;
  using MovingSegment = geometry::MovingSegment;
  template <class Pairs>
  using Sink = typename Call::template Sink<Pairs>;

  const geometry::Frame& frame() const { return state_.generations().frame(); }
  const Entry& at(SegmentId place) const {
    return state_.obstacles().beside()[static_cast<std::size_t>(place)];
  }
  MovingShape shapeOf(const Entry& entry) const {
    return entry.is_mesh ? MovingShape{} : reach_.shape(entry.id, entry.box);
  }

  /// Whether meshes are in the other manager's tree but count by their triangles here.
  bool readsMeshesOf(const State& other) const {
    return countsTriangles(state_.options()) && other.options().report == Report::kVolumes &&
           other.options().bounds != Bounds::kObjects;
  }

  /// An entry of another manager.
  Entry inFrameOf(const State& other, const FrameOfOther& change, const Entry& entry) const {
    Entry moved = entry;
    moved.box = change(entry.box);
    if (other.options().motion) {
      moved.start.box = change(entry.start.box);
    } else {
      moved.start = moved;
    }
    return moved;
  }

  /// @param pairs  pairs(a, b, call) calls the callback if the rules report the pair, and returns
  ///               whether that ends the query
  template <class Pairs, class... Where>
  tree::Visit search(Pairs pairs, const Where&... where) {
    Sink<Pairs> sink(call_, state_, std::move(pairs));
    return state_.generations().search(where..., sink);
  }

  /// Calls visit(sink) with a sink that gets each segment once.
  template <class Pairs, class Visit>
  tree::Visit eachOnce(const State& state, Pairs& pairs, Visit&& visit) {
    std::unordered_set<SegmentId> seen;
    const auto once = [&](SegmentId a, SegmentId b, Call& call) {
      return (!(Call::kRepeats || moves_) || seen.insert(a).second) && pairs(a, b, call);
    };
    Sink<decltype(once)> sink(call_, state, once);
    return visit(sink);
  }

  /// Finds the segments in a manager's tree that touch an object beside a tree, which is given in
  /// the frame of this manager. pairs(b, call) is called once for each.
  template <class Pairs>
  tree::Visit searchTree(const State& in, const Entry& entry, const MovingShape& shape,
                         const Pairs& pairs) {
    if (countsByTriangles(entry)) {
      const auto with_triangle = [&](SegmentId b, SegmentId /*triangle*/, Call& call) {
        return pairs(b, call);
      };
      return eachOnce(in, with_triangle,
                      [&](auto& sink) { return searchTriangles(in, entry, sink); });
    }
    if (&in == &state_ && isBounded(entry.box) && isBounded(entry.start.box)) {
      const MovingSegment box = boxOf(entry);
      const double error = endPointError(box);
      const auto with_box = [&](SegmentId b, SegmentId /*second*/, Call& call) {
        return reach_.mayTouch(b, box, error, shape, call.reach(state_)) && pairs(b, call);
      };
      return search(with_box, box, error, tree::kNoGroup, SegmentId{0});
    }
    const FrameOfOther change(in.generations().frame(), frame());
    const geometry::FrameChange box_change(in.generations().frame(), frame());
    const ReachOfOther<S> reach_of(state_, in, moves_);
    const bool keeps_segments = in.generations().keepsSegments();
    const MovingSegment own = boxOf(entry);
    const double own_error = endPointError(own);
    const geometry::Segment around = aroundStep(own);
    // The volumes have half of the margin already.
    const double padding =
        Call::kUsesMargin && !keeps_segments ? in.generations().margin() / 2 * change.scale() : 0;
    // An object that counts by its box meets the boxes of others.
    const bool has_plane =
        countsTriangles(state_.options()) && shape.is_moved_only && !in.generations().hasBoxes();
    const auto isNear = [&](const geometry::Box& box) {
      const geometry::Box its = box_change.isIdentity() ? box : box_change(box);
      const double reach = call_.reach(state_);
      return isAsked(reach) && geometry::isNear(its, around, reach - padding) &&
             !(has_plane && !mayReach(its, shape.end, shape.way, reach, shape.way_error));
    };
    const auto visit = [&](SegmentId b) {
      if (keeps_segments) {
        MovingSegment segment;
        double error = 0;
        reach_of.find(b, segment, error);
        const double reach = call_.reach(state_);
        geometry::Impact impact;
        if (!(moves_ ? findImpact(segment, own, reach, error + own_error, 0, impact)
                     : touch(segment.end, own.end, reach, error + own_error))) {
          return tree::Visit::kContinue;
        }
        const auto its_shape = [&] { return reach_of.shape(b); };
        if (countsTriangles(state_.options()) &&
            !ShapeReach<S>::mayTouch(
                own, own_error, [&] { return shape; }, segment, error, its_shape, reach)) {
          return tree::Visit::kContinue;
        }
      }
      return pairs(b, call_) ? tree::Visit::kStop : tree::Visit::kContinue;
    };
    return in.generations().visitNear(moves_, isNear, visit);
  }

  /// Whether any pair is this near. At distance 0 a query for distances has its answer.
  static bool isAsked(double reach) { return !Call::kRepeats || reach > 0; }

  bool countsByTriangles(const Entry& entry) const {
    if (!countsTriangles(state_.options())) return false;
    return moves_ ? entry.countsMovingTriangles() : entry.counts_triangles;
  }
  MovingSegment boxOf(const Entry& entry) const {
    return moves_ ? entry.movingBox() : MovingSegment{entry.box, entry.box};
  }
  /// @pre countsByTriangles(mesh)
  template <class SinkOfSegments>
  tree::Visit searchTriangles(const State& in, const Entry& mesh, SinkOfSegments& sink) const {
    const double margin = state_.options().margin;
    if constexpr (Call::kLooksAtSteps) {
      if (moves_) return in.generations().searchMesh(*in.movingMesh(mesh), margin, sink);
    }
    return in.generations().searchMesh(mesh.posed(), margin, sink);
  }

  /// Finds the objects beside the tree whose boxes may touch a segment.
  template <class Pairs>
  tree::Visit searchBoxes(const MovingSegment& segment, double error, const Pairs& pairs) {
    if (state_.obstacles().beside().size() == 0) return tree::Visit::kContinue;
    const auto with_box = [&](SegmentId place, SegmentId /*second*/, Call& call) {
      const Entry& entry = at(place);
      return entry.object != nullptr && pairs(entry, call);
    };
    Sink<decltype(with_box)> sink(call_, state_, with_box);
    return state_.obstacles().boxes().search(segment, error, sink);
  }

  /// An object beside the tree and another one beside a tree, whose boxes overlap. Two meshes count
  /// by their boxes.
  bool mayTouch(const Entry& own, const Entry& other, const MovingShape& shape, Call& call) const {
    if (countsByTriangles(own) && countsByTriangles(other)) return true;
    const bool is_exchanged = countsByTriangles(other);
    const MovingSegment box = boxOf(is_exchanged ? own : other);
    return reach_.mayTouch(is_exchanged ? other : own, is_exchanged ? shape : shapeOf(own), box,
                           endPointError(box), is_exchanged ? shapeOf(own) : shape,
                           call.reach(state_));
  }

  /// @param own  what the manager has of the object, or null
  Entry readNow(const Object& object, const Entry* own) {
    const bool is_solid = own != nullptr && own->is_solid;
    const tree::Categories categories = own != nullptr ? own->categories : tree::kAllCategories;
    const BesideReading mesh =
        readMesh(object, is_solid, frame(), state_.options().bounds, state_.obstacles().cache());
    return Entry::resting(mesh, nullptr, SegmentId{0}, is_solid, categories);
  }

  /// Throws RefusedObject if the object cannot be read.
  tree::Visit searchOne(Object* object) {
    const SegmentId own_id = state_.registry().find(object);
    const bool is_managed = own_id != State::Registry::kNotFound;
    const Entry* own = is_managed ? state_.obstacles().beside(own_id) : nullptr;
    const auto with_entry = [&](const Entry& entry, Call& call) {
      return rules_.reportsWith(entry.id, own_id) && call(entry.object, object);
    };
    const auto with_segment = [&](SegmentId a, Call& call) {
      return rules_.reportsWith(a, own_id) && call(state_.registry()[a], object);
    };
    if (countsTriangles(state_.options()) && isMesh(*object)) {
      // In a step a managed object is where it was read.
      const Entry mesh = own != nullptr && moves_ ? *own : readNow(*object, own);
      if (searchTree(state_, mesh, {}, with_segment) == tree::Visit::kStop) {
        return tree::Visit::kStop;
      }
      const MovingSegment box = boxOf(mesh);
      return searchBoxes(box, endPointError(box), [&](const Entry& entry, Call& call) {
        return mayTouch(entry, mesh, {}, call) && with_entry(entry, call);
      });
    }
    const bool has_step = is_managed && moves_ && (own == nullptr || !own->is_mesh);
    MovingSegment segment;
    if (has_step) {
      segment = own != nullptr ? own->movingBox() : reach_.segment(own_id);
    } else {
      segment.end = requireSegment(*object, frame(), state_.options().bounds);
      segment.start = segment.end;
    }
    const double error = endPointError(segment);
    const MovingShape shape =
        has_step ? reach_.shape(own_id, segment.end) : reach_.read(*object, segment.end);
    tree::Visit visit;
    if (!isBounded(segment.end)) {
      BesideReading reading;
      reading.box = segment.end;
      Entry entry = Entry::resting(reading, object, own_id, /*is_solid=*/false);
      entry.start.box = segment.start;
      visit = searchTree(state_, entry, shape, with_segment);
    } else {
      const auto in_tree = [&](SegmentId a, SegmentId /*second*/, Call& call) {
        return rules_.reportsWith(a, own_id) &&
               reach_.mayTouch(a, segment, error, shape, call.reach(state_)) &&
               call(state_.registry()[a], object);
      };
      const tree::Group group =
          is_managed ? state_.registry().fibers().groupOf(own_id) : tree::kNoGroup;
      visit = search(in_tree, segment, error, group, SegmentId{0});
    }
    if (visit == tree::Visit::kStop) return visit;
    return searchBoxes(segment, error, [&](const Entry& entry, Call& call) {
      return reach_.mayTouch(entry, shapeOf(entry), segment, error, shape, call.reach(state_)) &&
             with_entry(entry, call);
    });
  }

  tree::Visit searchTrees(const State& other) {
    const ObjectSource<S> source = other.source(Call::kName);
    const ReachOfOther<S> reach(state_, other, moves_);
    const bool leaves_out_meshes = readsMeshesOf(other);
    return search(
        [&](SegmentId a, SegmentId b, Call& call) {
          if (!rules_.reportsWith(a, other.registry(), b)) return false;
          Object* partner = other.registry()[b];
          return !(leaves_out_meshes && isMesh(*partner)) &&
                 reach.mayTouch(a, b, call.reach(state_)) && call(state_.registry()[a], partner);
        },
        other.generations(), source);
  }

  /// Finds the pairs of what this manager has beside its tree with what is in the other manager's
  /// tree.
  tree::Visit searchOwnBeside(const State& other) {
    const bool keeps_segments = other.generations().keepsSegments();
    // What counts by its volume there counts by its shape here.
    const bool counts_shapes = countsTriangles(state_.options()) && !keeps_segments;
    const bool is_coarse = !keeps_segments && state_.generations().isSwampedBy(other.generations());
    const bool has_no_steps = moves_ && other.generations().options().wrapped_spheres;
    const bool is_read_again = counts_shapes || is_coarse || has_no_steps;
    for (const Entry& entry : state_.obstacles().beside()) {
      if (is_read_again) break;
      if (entry.object == nullptr) continue;
      const auto pairs = [&](SegmentId b, Call& call) {
        return rules_.reportsWith(entry.id, other.registry(), b) &&
               call(entry.object, other.registry()[b]);
      };
      if (searchTree(other, entry, shapeOf(entry), pairs) == tree::Visit::kStop) {
        return tree::Visit::kStop;
      }
    }
    if (!is_read_again || state_.obstacles().beside().size() == 0) return tree::Visit::kContinue;
    const ReachOfOther<S> reach(state_, other, moves_);
    for (SegmentId b = 0; b < other.registry().idCount(); ++b) {
      Object* partner = other.registry()[b];
      if (partner == nullptr || (readsMeshesOf(other) && isMesh(*partner)) ||
          other.obstacles().isBeside(b)) {
        continue;
      }
      MovingSegment segment;
      double error = 0;
      if (!reach.find(b, segment, error)) continue;
      const auto pairs = [&](const Entry& entry, Call& call) {
        return rules_.reportsWith(entry.id, other.registry(), b) &&
               reach_.mayTouch(entry, shapeOf(entry), segment, error, reach.shape(b),
                               call.reach(state_)) &&
               call(entry.object, partner);
      };
      if (searchBoxes(segment, error, pairs) == tree::Visit::kStop) return tree::Visit::kStop;
    }
    return tree::Visit::kContinue;
  }

  /// Finds the pairs of this manager's objects with one that is beside the other manager's tree.
  tree::Visit searchBeside(const State& other, const Entry& theirs, const MovingShape& shape) {
    const SegmentId b = theirs.id;
    Object* partner = other.registry()[b];
    const auto with_segment = [&](SegmentId a, Call& call) {
      return rules_.reportsWith(a, other.registry(), b) && call(state_.registry()[a], partner);
    };
    if (searchTree(state_, theirs, shape, with_segment) == tree::Visit::kStop) {
      return tree::Visit::kStop;
    }
    const MovingSegment box = boxOf(theirs);
    return searchBoxes(box, endPointError(box), [&](const Entry& own, Call& call) {
      return rules_.reportsWith(own.id, other.registry(), b) &&
             mayTouch(own, theirs, shape, call) && call(own.object, partner);
    });
  }

  const State& state_;
  const bool moves_;  ///< whether the query looks at a step
  const typename State::QueryScope scope_;
  const PairRules<typename State::Registry> rules_;
  const ShapeReach<S> reach_;
  Call& call_;
};

}  // namespace fcl_fibers::broadphase
