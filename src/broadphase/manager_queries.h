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
    const auto report = [this](SegmentId a, SegmentId b, Call& call) {
      if (a > b) std::swap(a, b);
      return rules_.reports(a, b) && call(state_.registry()[a], state_.registry()[b]);
    };
    const auto within_tree = [&](SegmentId a, SegmentId b, Call& call) {
      return reach_.mayTouch(a, b, call.reach(state_)) && report(a, b, call);
    };
    if (search(within_tree) == tree::Visit::kStop) return;
    for (const Entry& mesh : state_.obstacles().meshes()) {
      const auto with_mesh = [&](SegmentId a, SegmentId /*triangle*/, Call& call) {
        return report(a, mesh.id, call);
      };
      if (searchMesh(mesh, with_mesh) == tree::Visit::kStop) return;
    }
    if (state_.obstacles().meshes().empty()) return;
    const auto among_meshes = [&](SegmentId a, SegmentId b, Call& call) {
      const Entry *first = state_.obstacles().ofBox(a), *second = state_.obstacles().ofBox(b);
      return first != nullptr && second != nullptr && report(first->id, second->id, call);
    };
    Sink<decltype(among_meshes)> sink(call_, state_, among_meshes);
    state_.obstacles().searchBoxes(sink);
  }

  /// Finds the pairs with an object, managed or not.
  void with(Object* object) {
    if (object == nullptr) {
      fibers::throwInvalidArgument(Call::kName, "the object is null; pass an object");
    }
    searchOne(object, [] { return std::string("the given object"); });
  }

  /// Finds the pairs with the objects of another manager class. It reads each object only when its
  /// turn comes, which saves time if the query ends early.
  void with(const std::vector<Object*>& others) {
    for (std::size_t i = 0; i < others.size() && state_.registry().size() > 0; ++i) {
      const auto name = [i] { return nameOf(i) + " of the other manager"; };
      if (others[i] == nullptr) {
        fibers::throwInvalidArgument(Call::kName, name() + " is null; remove it from that manager");
      }
      if (searchOne(others[i], name) == tree::Visit::kStop) return;
    }
  }

  /// Finds the pairs with the objects of another fiber manager.
  void with(const State& other) {
    const typename State::QueryScope other_scope(other, Call::kName);
    if (searchTrees(other) == tree::Visit::kStop) return;
    if (searchOwnMeshes(other) == tree::Visit::kStop) return;
    if (countsTriangles(other.options())) {
      const FrameOfOther change(other.generations().frame(), frame());
      for (const Entry& mesh : other.obstacles().meshes()) {
        Entry moved = mesh;
        moved.box = change(mesh.box);
        if (other.options().motion) {
          moved.start.box = change(mesh.start.box);
        } else {
          moved.start = moved;
        }
        // A contact of this pair is asked for by this manager's means.
        const auto& model = mesh.object->collisionGeometry();
        if (mesh.mesh != nullptr) state_.obstacles().cache().keep(model, mesh.mesh);
        if (searchMeshOf(other, moved) == tree::Visit::kStop) return;
      }
    } else if (readsMeshesOf(other)) {
      for (SegmentId b = 0; b < other.registry().idCount(); ++b) {
        const Object* object = other.registry()[b];
        if (object == nullptr || !isMesh(*object)) continue;
        const MeshReading mesh =
            readMesh(Call::kName, *object, false, frame(), other.options().bounds,
                     state_.obstacles().cache(), [&] { return other.source("").nameOf(b); });
        const tree::Categories categories = other.registry().fibers().partyOf(b).categories;
        if (searchMeshOf(other, resting(mesh, b, categories, false)) == tree::Visit::kStop) return;
      }
    }
  }

 private:
  using Entry = typename Obstacles<S>::MeshEntry;
  using MovingSegment = geometry::MovingSegment;
  template <class Pairs>
  using Sink = typename Call::template Sink<Pairs>;

  const geometry::Frame& frame() const { return state_.generations().frame(); }

  /// Whether meshes are in the other manager's tree but count by their triangles here.
  bool readsMeshesOf(const State& other) const {
    return countsTriangles(state_.options()) && other.options().report == Report::kVolumes &&
           other.options().bounds != Bounds::kObjects;
  }

  /// A mesh that was just read.
  static Entry resting(const MeshReading& mesh, SegmentId id, tree::Categories categories,
                       bool is_solid) {
    return {mesh, nullptr, id, categories, is_solid, true, mesh};
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

  /// Finds the segments that touch a mesh, or its box if only that counts.
  template <class Pairs>
  tree::Visit searchMesh(const Entry& mesh, Pairs pairs) {
    if (!countsByTriangles(mesh) || !countsTriangles(state_.options())) {
      const MovingSegment box = boxOf(mesh);
      return search(pairs, box, endPointError(box), tree::kNoGroup, SegmentId{0});
    }
    return eachOnce(state_, pairs, [&](auto& sink) {
      return searchTriangles(state_, mesh, /*more_margin=*/0, sink);
    });
  }

  bool countsByTriangles(const Entry& mesh) const {
    return moves_ ? mesh.countsMovingTriangles() : mesh.counts_triangles;
  }
  MovingSegment boxOf(const Entry& mesh) const {
    return moves_ ? mesh.movingBox() : MovingSegment{mesh.box, mesh.box};
  }
  /// @pre countsByTriangles(mesh)
  template <class SinkOfSegments>
  tree::Visit searchTriangles(const State& state, const Entry& mesh, double more_margin,
                              SinkOfSegments& sink) const {
    if constexpr (Call::kLooksAtSteps) {
      if (moves_) return state.generations().searchMesh(*state.movingMesh(mesh), more_margin, sink);
    }
    index::PosedMesh posed = mesh.posed();
    posed.margin += more_margin;
    return state.generations().searchMesh(posed, sink);
  }

  /// Finds the meshes whose boxes may touch a segment. `pairs` gets a mesh.
  template <class Pairs>
  tree::Visit searchMeshes(const MovingSegment& segment, double error, const Pairs& pairs) {
    if (state_.obstacles().meshes().empty()) return tree::Visit::kContinue;
    const auto with_box = [&](SegmentId a, SegmentId /*second*/, Call& call) {
      const Entry* mesh = state_.obstacles().ofBox(a);
      return mesh != nullptr && pairs(*mesh, call);
    };
    Sink<decltype(with_box)> sink(call_, state_, with_box);
    return state_.obstacles().searchBoxes(segment, error, sink);
  }

  /// @param own  what the manager has of the object, or null
  template <class Name>
  Entry readNow(const Object& object, const Entry* own, Name&& name) {
    const bool is_solid = own != nullptr && own->is_solid;
    const tree::Categories categories = own != nullptr ? own->categories : tree::kAllCategories;
    const MeshReading mesh = readMesh(Call::kName, object, is_solid, frame(),
                                      state_.options().bounds, state_.obstacles().cache(), name);
    return resting(mesh, SegmentId{0}, categories, is_solid);
  }

  template <class Name>
  tree::Visit searchOne(Object* object, Name&& name) {
    const SegmentId own_id = state_.registry().find(object);
    const bool is_managed = own_id != State::Registry::kNotFound;
    const auto with_mesh = [&](const Entry& mesh, Call& call) {
      return rules_.reportsWith(mesh.id, own_id) && call(mesh.object, object);
    };
    if (countsTriangles(state_.options()) && isMesh(*object)) {
      const Entry* own = is_managed ? state_.obstacles().mesh(own_id) : nullptr;
      // In a step a managed object is where it was read.
      const Entry mesh = own != nullptr && moves_ ? *own : readNow(*object, own, name);
      const auto with_segment = [&](SegmentId a, SegmentId /*triangle*/, Call& call) {
        return rules_.reportsWith(a, own_id) && call(state_.registry()[a], object);
      };
      if (searchMesh(mesh, with_segment) == tree::Visit::kStop) return tree::Visit::kStop;
      const MovingSegment box = boxOf(mesh);
      return searchMeshes(box, endPointError(box), with_mesh);
    }
    const bool has_step = is_managed && moves_ && !state_.obstacles().isMesh(own_id);
    MovingSegment segment;
    if (has_step) {
      segment = reach_.segment(own_id);
    } else {
      segment.end = readObject(Call::kName, *object, frame(), state_.options().bounds, name);
      segment.start = segment.end;
    }
    const double error = endPointError(segment);
    const geometry::Obstacle own_shape = reach_.read(*object, segment.end);
    const MovingShape shape = has_step ? reach_.shape(own_id) : MovingShape::resting(&own_shape);
    const tree::Group group =
        is_managed ? state_.registry().fibers().groupOf(own_id) : tree::kNoGroup;
    const auto with_segment = [&](SegmentId a, SegmentId /*second*/, Call& call) {
      return rules_.reportsWith(a, own_id) &&
             reach_.mayTouch(a, segment, error, shape, call.reach(state_)) &&
             call(state_.registry()[a], object);
    };
    if (search(with_segment, segment, error, group, SegmentId{0}) == tree::Visit::kStop) {
      return tree::Visit::kStop;
    }
    return searchMeshes(segment, error, [&](const Entry& mesh, Call& call) {
      return reach_.mayTouch(mesh, segment, error, call.reach(state_)) && with_mesh(mesh, call);
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

  /// Finds the pairs of this manager's meshes with what is in the other manager's tree.
  tree::Visit searchOwnMeshes(const State& other) {
    // Spheres do not move.
    const bool is_kept = other.generations().keepsSegments() &&
                         !(moves_ && other.generations().options().wrapped_spheres);
    bool is_one_by_one = false;
    for (const Entry& mesh : state_.obstacles().meshes()) {
      if (!countsByTriangles(mesh) || !is_kept) {
        is_one_by_one = true;
        continue;
      }
      const auto pairs = [&](SegmentId b, SegmentId /*triangle*/, Call& call) {
        return rules_.reportsWith(mesh.id, other.registry(), b) &&
               call(mesh.object, other.registry()[b]);
      };
      double more_margin = 0;
      if (Call::kUsesMargin) {
        // The search adds the other manager's margin, but this one's counts. The sum must not be
        // rounded below that.
        const double margin = state_.options().margin, its_margin = other.options().margin;
        more_margin = margin - its_margin +
                      8 * std::numeric_limits<double>::epsilon() * (margin + its_margin);
      }
      const auto found = eachOnce(other, pairs, [&](auto& sink) {
        return searchTriangles(other, mesh, more_margin, sink);
      });
      if (found == tree::Visit::kStop) return found;
    }
    if (!is_one_by_one) return tree::Visit::kContinue;
    const ReachOfOther<S> reach(state_, other, moves_);
    for (SegmentId b = 0; b < other.registry().idCount(); ++b) {
      Object* partner = other.registry()[b];
      if (partner == nullptr || (readsMeshesOf(other) && isMesh(*partner)) ||
          other.obstacles().isMesh(b)) {
        continue;
      }
      MovingSegment segment;
      double error = 0;
      if (!reach.find(b, segment, error)) continue;
      const auto pairs = [&](const Entry& mesh, Call& call) {
        return !(countsByTriangles(mesh) && is_kept) &&
               rules_.reportsWith(mesh.id, other.registry(), b) &&
               reach_.mayTouch(mesh, segment, error, call.reach(state_)) &&
               call(mesh.object, partner);
      };
      if (searchMeshes(segment, error, pairs) == tree::Visit::kStop) return tree::Visit::kStop;
    }
    return tree::Visit::kContinue;
  }

  /// Finds the pairs of this manager's objects with a mesh of the other manager.
  tree::Visit searchMeshOf(const State& other, const Entry& mesh) {
    const SegmentId b = mesh.id;
    Object* partner = other.registry()[b];
    const auto with_segment = [&](SegmentId a, SegmentId /*triangle*/, Call& call) {
      return rules_.reportsWith(a, other.registry(), b) && call(state_.registry()[a], partner);
    };
    if (searchMesh(mesh, with_segment) == tree::Visit::kStop) return tree::Visit::kStop;
    const MovingSegment box = boxOf(mesh);
    return searchMeshes(box, endPointError(box), [&](const Entry& own, Call& call) {
      return rules_.reportsWith(own.id, other.registry(), b) && call(own.object, partner);
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
