#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Plants known faults in the library, one by one, and shows that the tests catch each.

    tests/mutation.py [--list] [--part I/N] [-j JOBS] [NAME...]

--part plants those of part I of N, from 1/N to N/N. The faults are planted in a copy of the
sources, build/mutation/source; the tests are built there, for one instruction set. Each has to pass
without a fault first. Ends with an error if a fault survives, which means that a test is missing,
or if the text that it replaces is not there exactly once, which means that this list has to follow
the sources.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORK = ROOT / "build" / "mutation"
SOURCE = WORK / "source"
BUILD = WORK / "build"


@dataclass
class Fault:
    name: str  # what is wrong
    file: str  # below src/
    before: str
    after: str
    tests: str  # executables that are to catch it, the fastest first


WELZL = """
/// Welzl's recursion, which is right for points only.
std::optional<EnclosingSphere> welzl(const Ball* balls, int count, Basis on) {
  if (count == 0 || on.size == 4) {
    if (on.size == 0) return std::nullopt;
    const Ball* members[4];
    for (std::size_t i = 0; i < 4; ++i) members[i] = &balls[on.ball[i]];
    const auto support = supportSphere(members, on.size);
    return support ? std::optional<EnclosingSphere>({support->ball, on}) : std::nullopt;
  }
  const auto without = welzl(balls, count - 1, on);
  if (without && encloses(without->ball, balls[count - 1])) return without;
  on.ball[static_cast<std::size_t>(on.size++)] = count - 1;
  return welzl(balls, count - 1, on);
}

}  // namespace

bool SupportSphere::isLeast() const {"""

BEFORE_WELZL = "  assert(count > 0);\n"
CALL_WELZL = """\
  if (auto found = count <= 12 ? welzl(balls, count, {}) : std::nullopt) {
    const double reach = farthestFrom(found->ball.center, balls, count).reach;
    found->ball.radius = std::max(reach, found->ball.radius) * (1 + 16 * kEps);
    return *found;
  }
"""

MANAGERS = "broadphase_test stateful_test threads_test"

# fmt: off
FAULTS = [
    # --- Bounds ---
    Fault("a box is rounded to nearest", "geometry/box.h",
          "roundedDown(low.x - r)", "nearestFloat(low.x - r)", "geometry_test broadphase_test"),
    Fault("a bound is not moved outward", "geometry/rounding.h",
          "x - (std::fabs(x) * kUlp + kLeast)", "x", "geometry_test broadphase_test"),
    Fault("a sphere forgets how far its centre was rounded", "geometry/sphere.h",
          "roundedUp(ball.radius + norm(moved))", "roundedUp(ball.radius)",
          "geometry_test broadphase_test"),
    Fault("end points are taken for nearly exact", "geometry/segment.h",
          "return 8 * std::numeric_limits", "return 0.25 * std::numeric_limits", "geometry_test"),
    Fault("boxes computed together forget the rounding of end points", "geometry/box.cpp",
          "hn::Add(hn::Add(thickness, hn::Set(d, padding)), error)",
          "hn::Add(thickness, hn::Set(d, padding))", "geometry_test"),
    Fault("a box open to a side is computed like others", "geometry/box.cpp",
          "if (hn::AllFalse(d, is_far)) continue;", "continue;", "geometry_test"),
    Fault("a box forgets some children", "simd/lanes-inl.h",
          "for (int i = 1; i < kVectors; ++i) least = hn::Min(least, vector_[i]);", "",
          "geometry_test " + MANAGERS),
    Fault("a node does not fit its last child", "tree/layered_boxes.cpp",
          "lane < node.child_count; ++lane) {\n    const Link child",
          "lane + 1 < node.child_count; ++lane) {\n    const Link child", "tree_test " + MANAGERS),
    Fault("a chunk does not notice that its leaves have changed", "tree/layered_boxes.cpp",
          "changed |= replaceAll(", "replaceAll(", "tree_test"),
    Fault("nodes above chunks are not fitted", "tree/bvh.h",
          "if (changed) hierarchy_.fitNode(", "if (false) hierarchy_.fitNode(", "tree_test"),
    Fault("a sphere at the origin counts as fitted", "tree/wrapped_spheres.cpp",
          "std::numeric_limits<double>::quiet_NaN()", "0", "broadphase_test"),
    Fault("a cage is kept although a leaf has escaped", "tree/wrapped_spheres.cpp",
          "else if (child.isLeaf() || !encloses(", "else if (!child.isLeaf() && !encloses(",
          MANAGERS),
    Fault("a cage is kept although a smaller one would do", "tree/wrapped_spheres.cpp",
          "if (!support || !support->isLeast()) return false;", "if (!support) return false;",
          "tree_test broadphase_test"),
    Fault("Welzl's recursion for balls", "geometry/enclosing_sphere.cpp",
          "\n}  // namespace\n\nbool SupportSphere::isLeast() const {", WELZL, "geometry_test"),
    Fault("a basis may have negative weights", "geometry/enclosing_sphere.cpp",
          "if (support->isLeast() && reach", "if (reach", "geometry_test"),
    Fault("the box of another frame does not grow by the margin", "geometry/frame.h",
          "growth_ + 8 * kEps * std::fabs(shift[axis])", "8 * kEps * std::fabs(shift[axis])",
          MANAGERS),
    Fault("a wider box of a mesh is cut in a pose that is not turned", "broadphase/shape_box.cpp",
          "  if (is_turned && radius * radius", "  if (radius * radius", "shape_box_test"),
    Fault("boxes of another frame are taken for this one's", "tree/tree_pair.h",
          "meets == nullptr && b_to_a.isIdentity() && a_to_b.isIdentity()",
          "meets == nullptr && b_to_a.scale() == 1", MANAGERS),
    Fault("objects of one box are bundled by the sign of a difference", "tree/bundle.cpp",
          "return std::uint64_t{bits} << 31 |", "return std::uint64_t{bits} << 32 |",
          "tree_test index_test"),
    Fault("the margin of two trees counts the wrong way", "index/segment_index_search.cpp",
          "(options_.margin - other.options_.margin) / 2",
          "(other.options_.margin - options_.margin) / 2", MANAGERS),
    # --- Boxes of the program ---
    Fault("a margin in an object's box is dropped", "broadphase/object_reader.cpp",
          "if (!added.is_uneven) segment.radius += larger;", "", "swap_test"),
    Fault("a margin in a shape's box is dropped", "broadphase/program_margin.cpp",
          "is_even && high > own_rounding ? high : 0;", "0;", "swap_test"),
    Fault("a margin in a shape's ball is dropped", "broadphase/program_margin.cpp",
          "in_ball += beyond;", "{}", "swap_test"),
    Fault("a length of long ago is a margin", "broadphase/program_margin.cpp",
          "  if (is_even) {\n    for", "  if (false) {\n    for", "swap_test"),
    Fault("a margin that is not even is dropped", "broadphase/program_margin.cpp",
          "return {largest, true, marginOfEvenSize(size, forms, count)};",
          "return {marginOfEvenSize(size, forms, count), false};", "swap_test"),
    Fault("a box of long ago is trusted", "broadphase/program_margin.cpp",
          ">= -(0.6 * size.rounding + shift + tilt);", ">= -1e300;",
          "shape_box_test swap_test"),
    # --- Boxes of shapes ---
    Fault("a cone stands on its apex", "broadphase/shape_box.cpp",
          "posed = {min(apex, foot - disc), max(apex, foot + disc)};",
          "posed = {min(foot, apex - disc), max(foot, apex + disc)};", "shape_box_test"),
    Fault("squares of radii overflow", "broadphase/shape_box.cpp",
          "unit = largest > 0 ? largest : 1;", "unit = 1;", "shape_box_test"),
    Fault("a margin in the box of a shape is dropped", "broadphase/object_reader.cpp",
          "object.pose.shift, added.onAllSides(), frame", "object.pose.shift, 0, frame",
          "shape_box_test"),
    Fault("a margin around FCL's cube is not seen as one", "broadphase/program_margin.cpp",
          "forms[count++] = {", "forms[2] = {", "shape_box_test"),
    Fault("a widened box is taken for FCL's cube far out", "broadphase/program_margin.cpp",
          "std::max(own_rounding, 4 * size.rounding)", "own_rounding", "shape_box_test"),
    Fault("a widened box of a capsule is taken for FCL's cube far out",
          "broadphase/object_reader.cpp", "length > 2 * slack", "length > 0", "shape_box_test"),
    Fault("that of a capsule in a group is taken for FCL's cube far out",
          "geometry/posed_shapes.cpp", "hn::Gt(length, twice)", "hn::Gt(length, hn::Zero(d))",
          "shape_box_test"),
    Fault("a mesh is never smaller than its box", "broadphase/program_margin.cpp",
          "below + (shape.is_least ? posed.low : posed.high)", "below + posed.low",
          "shape_box_test"),
    Fault("anything may be a segment of a clone", "broadphase/manager_state.cpp",
          "if (!mayBeInFiber(kind) &&", "if (false &&", "swap_test"),
    Fault("an object that moved is taken for still", "broadphase/manager_state.cpp",
          "return !generations_.isFitted(", "return false && !generations_.isFitted(",
          "swap_test"),
    Fault("a manager that is moved forgets its options", "broadphase/fiber_collision_manager.cpp",
          "  options_ = other.options_;\n", "", "swap_test"),
    # --- Two managers side by side ---
    Fault("a shadow passes over a pair that is lost", "broadphase/shadow_objects.h",
          "const bool must = ", "const bool must = false && ", "shadow_test"),
    Fault("a shadow passes over volumes that are far apart", "broadphase/shadow_objects.h",
          "gap.volumes > reach + 0x1p-20 * extent_", "false", "shadow_test"),
    Fault("a shadow passes over a pair that is invented", "broadphase/shadow_objects.h",
          "is_exact ? gap.low > reach", "is_exact ? false", "shadow_test"),
    Fault("a shadow passes over a pair that is repeated", "broadphase/shadow_objects.h",
          "counts[side] > 0 && counts[side] <= most[side];", "counts[side] > 0;",
          "shadow_test"),
    Fault("a shadow looks at the end of a step alone", "broadphase/shadow_objects.h",
          "gapBetween(*p_start, p, *q_start, q, kIsFloat)", "gapBetween(p, q, kIsFloat)",
          "shadow_test"),
    Fault("a shadow takes what came within a step for known", "broadphase/shadow_objects.h",
          "entry->start = nullptr;", "entry->start = entry->now;", "shadow_test"),
    Fault("a step is judged at its samples alone", "broadphase/shadow_gap.h",
          "least - most / (2 * kParts) - doubt", "least - doubt", "shape_box_test"),
    Fault("a replay ends the steps that a program begins", "broadphase/shadow_record.h",
          "? fibers->beginStep() : fibers->endStep();", "? fibers->endStep() : fibers->endStep();",
          "shadow_test"),
    Fault("a shadow judges objects that have moved", "broadphase/shadow_objects.h",
          "entry.is_moved = !is_new;", "entry.is_moved = false;", "shadow_test"),
    Fault("a shadow judges neighbours that are left out", "broadphase/shadow_objects.h",
          "return a.fiber == b.fiber &&", "return false &&", "shadow_test"),
    Fault("a shadow hands a manager to one of another class", "broadphase/shadow_manager.cpp",
          "typeid(*to) == typeid(manager)) {", "true) {", "shadow_test"),
    Fault("a shadow lets a wrong distance pass", "broadphase/shadow_manager.cpp",
          "first.least.high < second.least.low &&", "false &&", "shadow_test"),
    Fault("a record loses the last bits of numbers", "broadphase/shadow_record.h",
          "std::numeric_limits<double>::max_digits10", "15", "shape_box_test"),
    Fault("a record that is cut is replayed", "broadphase/shadow_player.cpp",
          'tail == "\\nend\\n"', "true", "shadow_test"),
    Fault("a record takes any index", "broadphase/shadow_record.h",
          "return index >= 0 && index < count;", "return true;", "shape_box_test"),
    Fault("updates of some objects never bundle anew", "index/segment_index.cpp",
          "return !hasDecayed(/*loose=*/1.15);",
          "return true;", "index_test swap_test"),
    Fault("a dense query keeps its buffers", "index/pair_search.cpp",
          "std::find_if(blocks_.begin(), blocks_.end(), isBeyond)", "blocks_.end()", "index_test"),
    Fault("queries may keep four times an index", "index/segment_index.cpp",
          "blocks_->memoryUsage()) / 4);", "blocks_->memoryUsage()) * 4);", "index_test"),
    Fault("any number of pairs waits for a slow sink", "index/pair_search.cpp",
          "|| waiting_pairs_ < kMostWaiting;", "|| true;", "index_test"),
    Fault("a search that was stopped goes on", "index/pair_search.cpp",
          "  if (stopped_ != nullptr && *stopped_) return Visit::kStop;\n", "", "index_test"),
    Fault("a visitor on all threads is called after it has failed", "arrays/pair_sinks.h",
          "    if (has_ended_) return true;\n", "", "arrays_test"),
    Fault("jobs are handed on before their turn", "index/pair_search.cpp",
          "all.top().range.begin == next_;", "all.top().range.begin >= next_;", "index_test"),
    Fault("tasks that a thread leaves are lost", "index/pair_search.cpp",
          "for (Job& other : others) unclaimed_.push(std::move(other));", "", "index_test"),
    Fault("all threads are one worker", "index/pair_search.cpp",
          "search.sink_, number, &search.stopped_) {}",
          "search.sink_, 0, &search.stopped_) {}", "index_test"),
    Fault("a query within a task waits for the threads of others", "parallel/executor.cpp",
          "t_runs_task ? nullptr :", "false ? nullptr :", "parallel_test"),
    # --- Capsules ---
    Fault("lanes take a near miss for a touch", "geometry/capsule_test.cpp",
          "d.farthest <= d.reach * all(1 - 8 * kEps)",
          "d.nearest <= d.reach * all(1 + 8 * kEps)", "geometry_test"),
    Fault("lanes forget the gap of the dual bound", "geometry/capsule_test.cpp",
          "reach_up * reach_up + d.gap +", "reach_up * reach_up +",
          "geometry_test broadphase_test"),
    Fault("lanes forget that float rounds the gap", "geometry/triangle_test.cpp",
          "bounds.gap + gap_error", "bounds.gap + all(0) * gap_error", "geometry_test"),
    Fault("lanes leave out an edge of the triangle", "geometry/triangle_test.cpp",
          "tryEdge(w_, v2_, vv2,", "if (false) tryEdge(w_, v2_, vv2,", "geometry_test"),
    Fault("moving boxes overlap at different times", "geometry/volume-inl.h",
          "(waits + parts <= one)", "(waits <= one)", "geometry_test"),
    Fault("two moving boxes overlap at different times", "geometry/volume-inl.h",
          "(waits + parts <= Row::all(1))", "(waits <= Row::all(1))", "geometry_test"),
    Fault("the first common time leans inward", "geometry/volume-inl.h",
          "low) * Row::all(1 - 0x1p-21f)", "low) * Row::all(1 + 0x1p-21f)", "geometry_test"),
    Fault("a difference of 0 that rounding down makes -0 parts moving boxes",
          "geometry/volume-inl.h", "some_time = share <= Row::all(1)", "some_time = zero <= share",
          "numerics_test"),
    Fault("a solid of another size has no inside", "index/posed_mesh.cpp",
          "scale_(mesh.frame().scale)", "scale_(1)", "numerics_test"),
    Fault("boxes that overlap at the end do so before", "geometry/volume-inl.h",
          "(one <= Row::all(pack.until()))", "(zero <= Row::all(pack.until()))", "geometry_test"),
    Fault("pairs found side by side arrive too early", "geometry/impact.cpp",
          "toleranceFor(sizeOf(start, end)) / 2", "1e6 * toleranceFor(sizeOf(start, end))",
          "geometry_test"),
    Fault("a step in float forgets its rounding", "geometry/impact_pairs.cpp",
          "all(32 * kEps) *", "all(-32 * kEps) *", "geometry_test"),
    Fault("the last pair of ends is not looked at", "geometry/impact_pairs.cpp",
          "gap[3] = w + u - v;", "gap[3] = w + u;", "geometry_test"),
    Fault("a step starts where it ends", "arrays/fiber_index.cpp",
          "ArraySource<S>(*start, largest)", "ArraySource<S>(fibers, largest)", "arrays_test"),
    Fault("a mesh rests in a step", "index/posed_mesh.cpp",
          "start_(start, frame), end_", "start_(end, frame), end_", "arrays_test"),
    Fault("a mesh keeps the trees of the step before", "broadphase/obstacles.cpp",
          "  if (entry.is_mesh) entry.forgetTrees();\n",
          "  if (entry.is_mesh && entry.trees == nullptr) entry.forgetTrees();\n",
          "motion_test numerics_test"),
    Fault("a mesh keeps the trees of another frame", "broadphase/obstacles.cpp",
          "if (mesh_ == nullptr || !(mesh_->frame() == frame)) {", "if (mesh_ == nullptr) {",
          "numerics_test"),
    Fault("triangles near the end of a segment's way are not looked at", "index/posed_mesh.cpp",
          "geometry::volumeAround<Box>(segment.end, growth)",
          "geometry::volumeAround<Box>(segment.start, growth)", "motion_test numerics_test"),
    Fault("a safe step ends at any impact", "index/hull_filter.cpp",
          "store(geometry::roundedUp(get())", "store(geometry::roundedDown(0 * get())",
          "arrays_test"),
    Fault("what leaves something shortens the safe step", "index/hull_filter.cpp",
          "findApproach(p, q, margin_, error, from, impact)",
          "findImpact(p, q, margin_, error, from, impact)", "arrays_test"),
    Fault("what is inside a solid cannot leave", "index/segment_index_meshes.cpp",
          "  if (mesh.isSolid()) {\n    Question at_start;",
          "  if (false) {\n    Question at_start;", "arrays_test"),
    Fault("a tree that moves meets one that rests", "index/segment_index_search.cpp",
          "return other.movingRange();",
          "return {other.keptRange(), other.keptRange()};", "arrays_test"),
    Fault("an axis beside a triangle crosses it", "geometry/triangle_distance.cpp",
          "if (std::min({x, y, 1 - x - y}) <= kInside) return false;", "", "geometry_test"),
    Fault("a triangle's nearest edge or end is closest", "geometry/triangle_rows.cpp",
          "(is_far & (gap <= all(2) * rounding * distance))", "is_far", "geometry_test"),
    Fault("an end beside a triangle is above it", "geometry/triangle_rows.cpp",
          "choose(is_inside, r, far)", "r", "geometry_test"),
    Fault("a posed tree is that of the mesh at rest", "index/mesh_index.cpp",
          "fit(tree, posed,", "fit(tree, points_,", "arrays_test"),
    Fault("a direction that has turned is not longer", "geometry/advancement.h",
          "most * (turn / 2 +", "most * (0 * turn / 2 +", "geometry_test"),
    Fault("an impact is looked for between two of the four ends", "geometry/advancement.h",
          "firstRoot(a + u, b + u_rate, 0)", "firstRoot(a, b, 0)", "geometry_test"),
    Fault("a part of the reach that grows is forgotten", "geometry/advancement.h",
          "dot(n, rate_.w) - reach_rate_;", "dot(n, rate_.w);", "geometry_test"),
    Fault("both ends of a cone have the reach of the first", "geometry/advancement.h",
          "dot(n, pose.u) - pose.taper, u_rate", "dot(n, pose.u), u_rate", "geometry_test"),
    Fault("both ends of a cone side by side have one radius", "geometry/pair_lanes-inl.h",
          "of_u - taper_u * length", "of_u", "geometry_test"),
    Fault("the second end of a first capsule has the next radius", "geometry/pair_lanes-inl.h",
          "if (!p_may_taper) pair.taper_u", "if (false) pair.taper_u", "geometry_test"),
    Fault("the second end of a second capsule has the next radius", "geometry/pair_lanes-inl.h",
          "if (!q_may_taper) pair.taper_v", "if (false) pair.taper_v", "geometry_test"),
    Fault("lanes that touch at 0 are apart if they are cones", "geometry/capsule_test.cpp",
          "all(kMayTaper ? 8 * kEps : 1)", "all(kMayTaper ? 0 : 1)", "geometry_test"),
    Fault("what is far is taken for an impact", "geometry/advancement.h",
          "double accepted = tolerance_ / 2;", "double accepted = 4 * tolerance_;",
          "geometry_test"),
    Fault("pairs that leave each other come nearer", "geometry/advancement.h",
          "reach_ = distance - 2 * tolerance_;", "reach_ = distance;", "geometry_test"),
    Fault("a rough distance is taken for the least", "geometry/segment_distance.cpp",
          "rough.squared - rough.gap - rounding > reach_squared", "rough.squared > reach_squared",
          "geometry_test broadphase_test"),
    Fault("segments that share an end meet at another", "geometry/segment_distance.cpp",
          "if (end == q.b) return {s, 1,", "if (end == q.b) return {s, 0,", "arrays_test"),
    Fault("a tree that was moved from is not its own partner", "arrays/fiber_tree.cpp",
          "tree.impl_ == nullptr && index_", "tree.impl_ != nullptr && index_", "arrays_test"),
    Fault("the rounding of end points is forgotten", "geometry/touch.cpp",
          "(1 + 4 * kEps) + error;", "(1 + 4 * kEps) + 0 * error;",
          "geometry_test broadphase_test"),
    Fault("capsules at half the limit are passed over", "index/nearest_filter.h",
          "q.hull, limit, p.error + q.error", "q.hull, limit / 2, p.error + q.error", MANAGERS),
    Fault("the nearest children are those of the next lane", "tree/traversal-inl.h",
          "inB(child), lanes, lane * TreeB::kArity,",
          "inB(child), lanes, (lane ^ 1) * TreeB::kArity,", MANAGERS),
    Fault("a rough distance to an obstacle is taken for the least", "geometry/obstacle.cpp",
          "if (squared - gap - rounding > limit)", "if (squared - rounding > limit)",
          "geometry_test"),
    Fault("the way to a triangle is corrected by more than rounding", "geometry/triangle_rows.cpp",
          "const auto is_rounding = dot(correction_, correction_) <= rounding * rounding;",
          "const auto is_rounding = zero <= rounding;", "geometry_test"),
    Fault("the way to a triangle is not corrected", "geometry/triangle_rows.cpp",
          "const auto is_rounding = dot(correction_, correction_) <= rounding * rounding;",
          "const auto is_rounding = rounding < zero;", "geometry_test"),
    Fault("the way to a near triangle has no more digits", "geometry/triangle_rows.cpp",
          "const auto is_far = all(kNear / (4 * kEps)) * rounding < distance;",
          "const auto is_far = all(0 * kNear) <= distance;", "geometry_test"),
    Fault("a polytope is apart if one of its corners is", "geometry/polytope_distance.cpp",
          "const T beyond = least_along_ - slack;", "const T beyond = squared_ - slack;",
          "geometry_test"),
    Fault("the last vertices of a polytope are not looked at", "geometry/polytope_vertices.cpp",
          "(blocks_.data(), blocks_.size(), direction,",
          "(blocks_.data(), (blocks_.size() + 1) / 2, direction,", "geometry_test"),
    Fault("a polytope that is deformed keeps its vertices", "broadphase/object_reader.cpp",
          "known != nullptr && known->isCopyOf(object.vertices)", "known != nullptr",
          "meshes_test"),
    Fault("a contact with a box has no more digits than double", "geometry/obstacle.cpp",
          "if (distance <= 0.5 * kEps * size ||", "if (true ||", "geometry_test"),
    Fault("a search for a least vector ends at the first bound", "geometry/obstacle.cpp",
          "gap_ > gain && descend(); ++step", "gap_ > gain && descend() && step > 9; ++step",
          "geometry_test"),
    Fault("an axis leaves a box across faces alone", "geometry/obstacle_contact.cpp",
          "{0, 1}, {0, 3}, {1, 3}, {2, 3}}", "{0, 1}}", "geometry_test"),
    Fault("a capsule leaves a box by half its axis", "geometry/obstacle_contact.cpp",
          "0.5 * std::fabs(dot(n, along[3]))", "0", "geometry_test"),
    Fault("a plane is left to one side always", "geometry/obstacle_contact.cpp",
          "at_a + at_b < 0", "false", "geometry_test"),
    Fault("a cone leaves a box across faces alone", "geometry/obstacle_contact.cpp",
          "if (maxNorm(across) > 0) considerLeaning(", "if (false) considerLeaning(",
          "geometry_test"),
    Fault("a cone that leaves a box reaches as far as a capsule", "geometry/obstacle_contact.cpp",
          "cone.radiusAtA() - dot(outward, a)", "cone.radius - dot(outward, a)", "geometry_test"),
    Fault("a cone beside a shape is nearest at its ends", "geometry/cone_distance.cpp",
          "for (int round = 0; round < kMostRounds;", "for (int round = 0; round < 2;",
          "geometry_test"),
    Fault("the thin end of a cone lies on the ground like the thick one", "geometry/obstacle.cpp",
          "at_b + less_b) > most", "at_b) > most", "geometry_test"),
    Fault("a cone is nearest on the wrong side of where it was tried",
          "geometry/cone_distance.cpp", "const int side = line.slope > 0 ? 1 : 0;",
          "const int side = line.slope > 0 ? 0 : 1;", "geometry_test"),
    Fault("lines below the distances of cones pass for lines above", "geometry/cone_distance.cpp",
          "lines[0].gapAt(crossing), lines[1].gapAt(crossing));", "lines[0].gap, lines[1].gap);",
          "geometry_test"),
    Fault("a cone in motion has the radius of its first end", "geometry/obstacle_impact.cpp",
          "{p.start.radiusAtB(), p.end.radiusAtB()}", "{p.start.radiusAtA(), p.end.radiusAtA()}",
          "arrays_test"),
    Fault("a contact of a box and a capsule is that of a capsule and a box",
          "broadphase/contacts_of_objects.cpp", "if (swaps) broadphase::swapShapes(contact);", "",
          "contacts_test"),
    Fault("a half-space that a program has widened counts as one", "broadphase/shape_box.cpp",
          "if (bounds == Bounds::kShapesAndMargins && !hasStockBoxes(object, shape)) return;",
          "", "shape_box_test"),
    Fault("capsules beside each other are apart along their midpoints",
          "geometry/segment_distance.cpp", "std::fabs(dot(q.b - q.a, twice))",
          "0 * std::fabs(dot(q.b - q.a, twice))", MANAGERS),
    Fault("capsules read together take a widened box for FCL's", "geometry/posed_shapes.cpp",
          "found.are_usual, addNothing(", "hn::Not(found.are_usual), addNothing(", MANAGERS),
    Fault("poses of objects read together are not checked", "geometry/posed_shapes.cpp",
          "hn::And(found.are_usual, lanes.areRotations(rotation_tolerance))", "found.are_usual",
          "broadphase_test"),
    Fault("a turned capsule read in a group is straight", "geometry/posed_shapes.cpp",
          "const Vectors axis = column(2);", "const Vectors axis = column(0);", MANAGERS),
    Fault("boxes read together take a widened box for FCL's", "geometry/posed_shapes.cpp",
          "hn::Or(is_local, hn::And(is_turned, ", "hn::Or(is_local, hn::And(is_bounded, ",
          "shape_box_test"),
    Fault("a side of a box in a group is not checked", "geometry/posed_shapes.cpp",
          "hn::And(isSize(size_.x), hn::And(isSize(size_.y), ",
          "hn::And(isSize(size_.x), hn::And(isSize(size_.x), ", "shape_box_test"),
    Fault("a box in a group has no room for rounding", "geometry/posed_shapes.cpp",
          "(posed + Vectors{outward, outward, outward})", "posed", "shape_box_test"),
    # --- Search ---
    Fault("siblings are skipped in recursion", "tree/traversal-inl.h",
          "simd::firstLanes(count) & ~simd::firstLanes(lane + 1)",
          "simd::firstLanes(count) & ~simd::firstLanes(lane + 2)", MANAGERS),
    Fault("siblings are skipped in batches", "tree/wide_overlaps-inl.h",
          "~simd::firstLanes(lane + 1)", "~simd::firstLanes(lane + 2)", MANAGERS),
    Fault("pairs are dropped where there is no room", "tree/wide_overlaps-inl.h",
          "    const Slots last = waiting_[--count_];\n",
          "    const Slots last = waiting_[--count_];\n"
          "    if (!link(a_, last.a).isLeaf()) return Visit::kContinue;\n",
          "tree_test broadphase_test"),
    Fault("groups are forgotten where there is no room", "tree/pairing-inl.h",
          "any_(by_slot != nullptr)", "any_(false)", "tree_test"),
    Fault("a pair as near as the nearest is visited", "tree/nearest-inl.h",
          "if (!(places.all[i].distance() * unit < limit_) && std::isfinite(limit_)) break;", "",
          MANAGERS),
    Fault("gaps between boxes are measured on two axes", "geometry/volume-inl.h",
          "lengthLowerBound(gap(0), gap(1), gap(2))", "lengthLowerBound(gap(0), gap(1), gap(1))",
          MANAGERS),
    Fault("distances of another frame are not scaled", "tree/nearest-inl.h",
          "roundedUp(limit / unit_of_b_)", "roundedUp(limit)", MANAGERS),
    Fault("a node is of its first child's group", "tree/topology_builder.h",
          "return is_common ? *begin : kNoGroup;", "return *begin;", "arrays_test tree_test"),
    # --- Motion of a manager's objects ---
    Fault("a step never begins", "broadphase/manager_state.cpp",
          "begins ? generations_.beginStep() : generations_", "generations_", "motion_test"),
    Fault("obstacles do not begin a step", "broadphase/manager_state.cpp",
          "  obstacles_.setStep(begins);\n", "", "motion_test meshes_test"),
    Fault("a step never ends", "broadphase/manager_state.cpp",
          "begins ? generations_.beginStep() : generations_.endStep()",
          "if (begins) generations_.beginStep()", "motion_test"),
    Fault("a step begins with what has not been read", "broadphase/manager_state.cpp",
          "  if (begins) setup(call);\n", "", "motion_test"),
    Fault("a step begins with each refit", "index/segment_index_steps.cpp",
          "  if (step_ == Step::kBegins) {\n    if (start_ == nullptr) {\n      start_ = std::make",
          "  {\n    if (start_ == nullptr) {\n      start_ = std::make", "motion_test"),
    Fault("the start keeps its old ids", "broadphase/manager_state.cpp",
          "return registry_.find(before[static_cast<std::size_t>(old)]);",
          "static_cast<void>(before);\n        return old;", "motion_test"),
    Fault("the start stays in its old frame", "index/segment_index_steps.cpp",
          "if (has_tree && change.isIdentity()) return;", "if (has_tree) return;", "motion_test"),
    Fault("a build forgets where a step began", "index/segment_index_steps.cpp",
          "if (id >= begin && id < end) {", "if (false) {", "motion_test"),
    Fault("a young index moves objects that it no longer has", "index/segment_index_steps.cpp",
          "    moved_.clear();\n    moved_all_ = false;\n", "    moved_all_ = false;\n",
          "motion_test"),
    Fault("the main index forgets where young objects started", "index/segment_index_steps.cpp",
          "if (its.begin() < its.end()) {", "if (false) {", "motion_test"),
    Fault("a clone moves from the original's poses", "index/segment_index.cpp",
          "  endStep();\n  now_ = other.fitted();", "  step_ = other.step_;\n  if (other.start_) "
          "start_ = std::make_unique<End>(*other.start_);\n  now_ = other.fitted();",
          "motion_test"),
    Fault("a shape is at its end during the whole step", "broadphase/scene.cpp",
          "seen.start.a = seen.start.a + shape.way;", "", "meshes_test"),
    Fault("a mesh of a manager starts where it ends", "broadphase/obstacles.h",
          "trees->get(start.placed(categories, is_solid),", "trees->get(placed(),",
          "motion_test numerics_test"),
    Fault("a segment comes once for each triangle in its way", "broadphase/manager_query.cpp",
          "if (moves_ || query_.is_for_distances) seen", "if (query_.is_for_distances) seen",
          "motion_test numerics_test"),
    Fault("a mesh that moves is looked for in a tree of spheres", "broadphase/manager_query.cpp",
          "(moves_ && segments.options().wrapped_spheres) ||", "", "motion_test"),
    Fault("a capsule meets shapes at the end of its way only", "geometry/obstacle.cpp",
          "  if (rests(capsule)) return touch(capsule.end", "  return touch(capsule.end",
          "meshes_test"),
    Fault("one end of an axis meets no plane", "geometry/obstacle_impact.cpp",
          "const double from = side * gap[end][0] - reach[end][0]",
          "const double from = side * gap[0][0] - reach[end][0]", "arrays_test"),
    Fault("what sinks into a half-space comes no nearer", "geometry/obstacle_impact.cpp",
          "if (is_plane && std::min(side * gap[0][0], side * gap[1][0]) < 0)",
          "if (std::min(side * gap[0][0], side * gap[1][0]) < 0)",
          "arrays_test"),
    Fault("a turned box stays at the origin", "arrays/shapes.cpp",
          "const Vec3d shift = map.shift - frame.origin;",
          "const Vec3d shift = -1.0 * frame.origin;", "arrays_test"),
    Fault("an impact forgets the margin", "broadphase/contacts_of_objects.cpp",
          "const double margin = state.generations().margin();", "const double margin = 0;",
          "motion_test"),
    # --- Meshes ---
    Fault("a mesh is also in the tree", "broadphase/manager_state.cpp",
          "return next == end || *next != id;", "return true;", "meshes_test"),
    Fault("points that have moved are not read", "broadphase/mesh_cache.cpp",
          "if (isSame(*slot.mesh, triangles)) return", "if (true) return", "meshes_test"),
    Fault("a rigid mesh is that of the model before", "broadphase/mesh_cache.cpp",
          "isOf(slot.model, model) && slot.points", "slot.points", "meshes_test"),
    Fault("a mesh that was compared once is never compared again", "broadphase/mesh_cache.cpp",
          "slot.second.is_compared = false;", "(void)slot;", "meshes_test"),
    Fault("a clone changes the mesh that it shares", "broadphase/mesh_cache.cpp",
          "} else if (slot.mesh.use_count() > 1) {", "} else if (false) {", "meshes_test"),
    Fault("the margin of a mesh is lost", "broadphase/obstacles.h",
          "is_solid, object.added.margin};", "is_solid, 0};", "meshes_test"),
    Fault("another manager's margin counts", "broadphase/manager_query.cpp",
          "margin = state_.options().margin;", "margin = in.state().options().margin;",
          "meshes_test"),
    Fault("the sum of two margins is rounded", "broadphase/manager_query.cpp",
          "margin = state_.options().margin;", "margin = in.state().options().margin - "
          "(in.state().options().margin - state_.options().margin);", "meshes_test numerics_test"),
    Fault("what is inside a solid is within another margin", "index/segment_index_meshes.cpp",
          "searchAt(start(), mesh.start(), both_margins, at_start, inside);",
          "searchAt(start(), mesh.start(), options_.margin, at_start, inside);",
          "motion_test numerics_test"),
    Fault("a mesh of another manager has no inside", "broadphase/scene.cpp",
          "is_solid = state_.registry().fibers().isSolid(id);", "is_solid = is_own_ && "
          "state_.registry().fibers().isSolid(id);", "meshes_test numerics_test"),
    Fault("a mesh that no fiber meets is nowhere", "broadphase/obstacles.h",
          "meets_some ? categories : tree::kAllCategories;", "categories;", "meshes_test"),
    Fault("a mesh is known by its address alone", "broadphase/mesh_cache.cpp",
          "return isOf(found->second.model, model) ? found", "return true ? found",
          "meshes_test"),
    Fault("the margin of a mesh is lost to distance", "index/nearest_filter.h",
          "mayBeNearer(a, b, limit + margin_)", "mayBeNearer(a, b, limit)", "meshes_test"),
    Fault("what is inside a solid is far away", "index/segment_index_meshes.cpp",
          "return limit > 0 ? sink.visit", "return limit > 1e300 ? sink.visit", "meshes_test"),
    Fault("the root of a fiber meets obstacles", "fibers/fiber_table.h",
          "id - begin_[fiber] < rule.roots ? tree::kNoCategories : rule.categories",
          "rule.categories",
          "meshes_test"),
    Fault("a mesh counts where it has gone since the update", "broadphase/obstacles.cpp",
          "if (now.problem == nullptr && now.pose == own.end.object.pose)",
          "if (now.problem == nullptr)", "meshes_test"),
    Fault("an update leaves the triangles to no query", "broadphase/obstacles.cpp",
          "entry.awaits_triangles = is_known && !entry.is_rigid;",
          "entry.awaits_triangles = false;", "meshes_test"),
    Fault("an update looks at no point of a mesh", "broadphase/mesh_cache.cpp",
          "are_same &= toVec3d", "are_same |= toVec3d", "meshes_test"),
    Fault("a shape counts where it has gone since the update", "broadphase/scene.cpp",
          "ObjectKind::kUnbounded &&\n                     now == "
          "state_.generations().segment(partner.id)", "ObjectKind::kUnbounded",
          "broadphase_test meshes_test"),
    Fault("a shape is not read again", "broadphase/obstacles.cpp",
          "if (shapes_[place].object != nullptr) read", "if (!shapes_[place].is_read) read",
          "meshes_test"),
    Fault("a triangle has two edges", "geometry/squared_triangle_distance.h",
          "consider(onEdge(none, v2_,", "if (v2_.x > T(1e300)) consider(onEdge(none, v2_,",
          "arrays_test geometry_test"),
    Fault("the box of a turned segment has no thickness", "geometry/posed_change.h",
          "across_[axis] * r;", "0 * across_[axis] * r;", "arrays_test"),
    Fault("what double cannot part is apart", "geometry/triangle_distance.cpp",
          "rough.gap - rounding > reach_squared", "rough.gap > reach_squared", "geometry_test"),
    Fault("products that cancel are taken for exact", "geometry/posed_change.h",
          "growth_ + error_ * reach;", "growth_;", "geometry_test"),
    Fault("columns of any size are multiplied", "geometry/affine_map.h",
          "std::min(-exponent, 1000)", "0", "arrays_test"),
    Fault("at distance 0 nothing is near", "index/segment_index_meshes.cpp",
          "const double limit = (s.thickness() + most) *",
          "const double limit = most == 0 ? 0 : (s.thickness() + most) *", "arrays_test"),
    Fault("the last segments that a shape touches are lost", "index/segment_index_search.cpp",
          "Visit::kStop : shared.share();", "Visit::kStop : Visit::kContinue;", "arrays_test"),
    Fault("a segment comes with each of its triangles", "index/segment_index_meshes.cpp",
          "if (marks_.add(found.pairs[i].a)) run[", "marks_.add(found.pairs[i].a); run[",
          "arrays_test"),
    Fault("what touches a solid is inside as well", "index/segment_index_meshes.cpp",
          "for (std::size_t i = 0; i < kept && !once_; ++i) marks_.add(pairs[i].a);", "",
          "arrays_test"),
    Fault("a ray upward also crosses triangles below", "index/posed_mesh.cpp",
          " && isAbove(id, sides[0])", "", "arrays_test"),
    Fault("fibers of other categories meet a mesh", "tree/pairing-inl.h",
          "meets = by_slot_[Arity * a_node + lane].meet(categories_);", "meets = true;",
          "arrays_test"),
    Fault("what a block has no room for is lost", "index/pair_search.cpp",
          "        taken += count;\n", "        taken = run.count;\n", "index_test"),
    # --- Topology ---
    Fault("halves of strands are lost", "tree/bundle.cpp",
          "if (middle < s.end) halves", "if (middle + 1 < s.end) halves", MANAGERS),
    Fault("a bundle never decays", "index/segment_index.cpp",
          "kLoose = 1.5", "kLoose = 1e9", "arrays_test index_test"),
    # --- Who is registered ---
    Fault("an arc includes the segment it leads to", "fibers/neighbor_rule.h",
          "arc_end[last - 1] - arc_end[first]", "arc_end[last] - arc_end[first]",
          "arrays_test tree_test"),
    Fault("the last ignored neighbours are reported", "fibers/neighbor_rule.h",
          "if (last - first <= rule.reach)", "if (last - first < rule.reach)", MANAGERS),
    Fault("neighbours around a closed fiber are reported", "fibers/neighbor_rule.h",
          "fiber.closed && around <= rule.reach", "fiber.closed && around < rule.reach",
          MANAGERS),
    Fault("an object of a refused call stays managed", "broadphase/object_registry.h",
          "if (count == added.size()) return std::nullopt;\n  takeBack();",
          "if (count == added.size()) return std::nullopt;",
          "registry_test broadphase_test"),
    Fault("objects registered after the first lookup are not found", "broadphase/object_registry.h",
          "if (isIndexed()) index_.insertFrom(first);", "", "registry_test"),
    Fault("windows in which nothing is left stay in the set", "broadphase/address_set.h",
          "left += window.begun != 0 ? 1 : 0;", "left += 1;", "registry_test"),
    Fault("a forgotten object blocks the way of others", "broadphase/object_registry.h",
          "while (slots_[slot] != kNotFound && at(slots_[slot]) != pointer) slot = next(slot);",
          "while (slots_[slot] != kNotFound && at(slots_[slot]) != nullptr &&\n"
          "           at(slots_[slot]) != pointer) slot = next(slot);", "registry_test"),
    Fault("a reflection is taken for a rotation", "geometry/affine_map.h",
          "return wrong == 0 && dot(cross(x, y), z) > 0;", "return wrong == 0;", "broadphase_test"),
    Fault("oblique axes are taken for a rotation's", "geometry/affine_map.h",
          "(off(dot(x, y), 0) | ", "(0 | ", "broadphase_test"),
    Fault("capsules read together are judged mildly", "broadphase/object_reader.h",
          "kRotationTolerance / 2.05", "kRotationTolerance * 5", "shape_box_test"),
    Fault("a thin shape that sticks out of FCL's cube is elsewhere",
          "broadphase/program_margin.cpp", "is_turned && shape.is_least && is_known", "false",
          "shape_box_test"),
    # --- The manager ---
    Fault("an object may be unregistered within a query", "broadphase/manager_state.cpp",
          "  refuseDuringQuery(call);\n"
          "  const SegmentId id = managedId(call, object, \"object\");",
          "  const SegmentId id = managedId(call, object, \"object\");", MANAGERS),
    Fault("an unregistered object is still a partner", "broadphase/pair_rules.h",
          "if (own == nullptr || partner == nullptr || own == partner) return false;",
          "if (own == partner) return false;", MANAGERS),
    Fault("an object meets itself", "broadphase/pair_rules.h",
          "own == partner) return false;",
          "(own == partner && others_ != registry_)) return false;", MANAGERS),
    Fault("an object of both managers meets itself", "broadphase/pair_rules.h",
          "own == partner) return false;",
          "(own == partner && others_ == registry_)) return false;", MANAGERS),
    Fault("neighbours come back through another manager", "broadphase/pair_rules.h",
          "(has_own_rules_ && (id = registry_->find(partner)) != Registry::kNotFound)", "false",
          MANAGERS),
    Fault("a tree that ran out of memory is searched", "arrays/fiber_index.cpp",
          "  beginChange();\n  if (table", "  if (table", "faults_test"),
    Fault("a failed partial update is forgotten", "broadphase/manager_state.cpp",
          "  state_ = State::kFailed;\n  std::vector<SegmentId> in_tree",
          "  std::vector<SegmentId> in_tree", "broadphase_test faults_test"),
    Fault("a query that could not be made ready goes on for ever", "broadphase/manager_state.h",
          "        --state_.running_queries_;\n        throw;", "        throw;",
          "broadphase_test faults_test"),
    Fault("the later object comes first", "broadphase/manager_query.cpp",
          "  if (is_self_ && a > b) std::swap(one, other);\n", "", MANAGERS),
    # --- The list of a manager ---
    Fault("a list outlives an update of one object", "broadphase/generations.h",
          "      if (part == &main_) live_ = nullptr;\n", "", "live_managers_test"),
    Fault("a list outlives an update of many", "broadphase/generations.h",
          "    live_ = nullptr;\n    const bool is_good", "    const bool is_good",
          "live_managers_test"),
    Fault("a list outlives a build", "broadphase/generations.h",
          "    live_ = nullptr;\n    keepStarts();", "    keepStarts();", "live_managers_test"),
    Fault("an update of many tells of pairs", "broadphase/manager_state.cpp",
          "are_many) return readAll(call, hasTree());", "are_many) return update(call);",
          "live_managers_test"),
    Fault("young objects have no pairs that live", "broadphase/manager_state.cpp",
          "registry_.idCount() == generations_.youngBegin()", "true", "live_managers_test"),
    Fault("a pair outlives its object", "broadphase/manager_state.cpp",
          "removed_ + removed_young_ == 0", "true", "live_managers_test"),
    Fault("a slot is that of another pair after new ids", "broadphase/manager_state.cpp",
          "if (id != Registry::kNotFound) id = newId(id);", "", "live_managers_test"),
    Fault("neighbours live", "broadphase/manager_state.cpp",
          "if (rules_.report(a, b, state_.registry_[b])) pairs", "pairs", "live_managers_test"),
    Fault("an update without memory has told of pairs", "broadphase/manager_state.cpp",
          "  if (!live_) return;\n  state_ = State::kFailed;\n", "  if (!live_) return;\n",
          "faults_test"),
    # --- Young objects ---
    Fault("a mesh that goes has all read again", "broadphase/manager_state.cpp",
          "} else if (was_in_tree) {", "} else {", MANAGERS),
    Fault("the first that comes back moves all", "broadphase/obstacles.h",
          "size() + more + more / 8", "size() + more", "registry_test"),
    Fault("two young objects meet twice", "broadphase/manager_state.cpp",
          "segmentsFrom(begin)", "segmentsFrom(0)", MANAGERS),
    Fault("young objects do not meet the others", "broadphase/generations.h",
          "return ask(main_, sink, young_, kKept) == tree::Visit::kStop ? tree::Visit::kStop\n",
          "return false ? tree::Visit::kStop\n", MANAGERS),
    Fault("young objects do not meet each other", "broadphase/generations.h",
          ": ask(young_, sink);", ": tree::Visit::kContinue;", MANAGERS),
    Fault("a query with others passes over young objects", "broadphase/generations.h",
          "return hasYoung() ? visit(young_) : tree::Visit::kContinue;",
          "return tree::Visit::kContinue;", MANAGERS),
    Fault("young objects are visited after a contact", "index/segment_index_search.cpp",
          "return visitNearest(pairOf(tree, other_tree, other, /*beyond=*/0), sink.limit(),",
          "return visitNearest(pairOf(tree, other_tree, other, /*beyond=*/0), 1e300,", MANAGERS),
    Fault("a young object meets others of its group", "broadphase/pair_rules.h",
          "&& (a < young_begin_) == (b < young_begin_);", ";", MANAGERS),
    Fault("the young index does not grow", "broadphase/manager_state.cpp",
          "registry_.idCount() > generations_.end();",
          "generations_.end() == generations_.youngBegin();", MANAGERS),
    Fault("objects that came with an update are read by the query", "broadphase/manager_state.cpp",
          "state == State::kRead\n                      ?", "false\n                      ?",
          "broadphase_test"),
    Fault("only a block of those that came is read", "broadphase/manager_state.cpp",
          "std::iota(ids, ids + kBlock, first)", "std::iota(ids, ids + kBlock, begin)",
          "broadphase_test"),
    Fault("an object removed while it is young is reported", "broadphase/pair_rules.h",
          "partner == nullptr || own == partner", "(partner == nullptr && b < young_begin_) || "
          "own == partner", MANAGERS),
    Fault("young objects stay where they were", "broadphase/generations.h",
          "return is_good && (!hasYoung() || young_.tryRefit(source, frame()));",
          "return is_good;", MANAGERS),
    Fault("young objects that are named stay where they were", "broadphase/generations.h",
          "if (part_ids.empty()) continue;",
          "if (part_ids.empty() || part == &young_) continue;", MANAGERS),
    Fault("an eighth is a seventh", "broadphase/manager_state.cpp",
          "std::min(registry_.size(), in_main) / 8)", "std::min(registry_.size(), in_main) / 7)",
          "broadphase_test"),
    Fault("an update of some objects takes triangles of others", "broadphase/obstacles.cpp",
          "if (!all || other.end.model != model.get()", "if (other.end.model != model.get()",
          "meshes_test"),
    Fault("a young object that the frame does not hold is lost", "index/segment_index.cpp",
          "if (!is_read || !fits) return false;", "if (!fits) return false;", MANAGERS),
    Fault("a young object out of float's range stays there", "index/segment_index.cpp",
          "if (!is_read || !fits) return false;", "if (!is_read) return false;",
          "broadphase_test"),
    Fault("a fiber that is continued is in both indexes", "fibers/fiber_table.h",
          "id = std::max(begin_[f], first); id", "id = begin_[f]; id", MANAGERS),
    Fault("a young index that ran out of memory is searched", "broadphase/generations.h",
          "    forgetYoung();\n    //", "    end_ = end;\n    //", "faults_test"),
    # --- Bounds open to a side ---
    Fault("the rounding of a box open to a side is infinite", "geometry/segment.h",
          "return endPointError(is_open ? largestFinite(segment) : largest);",
          "return endPointError(largest);", "geometry_test broadphase_test"),
    Fault("the ball around a box open to a side has an end", "geometry/sphere.h",
          "if (segment.isBox() && !isBounded(segment)) return unbounded();", "",
          "geometry_test broadphase_test"),
    Fault("looseness counts what is unbounded", "tree/volumes.h",
          "      if (!std::isfinite(size)) continue;\n", "", "index_test swap_test"),
    # --- An index ---
    Fault("an index finds its segments from id 0 on", "index/kept_segments.cpp",
          "(ends_.data(), stride(), begin_)", "(ends_.data(), stride(), 0)",
          "index_test " + MANAGERS),
    Fault("an index reads its segments from id 0 on", "index/segment_index.cpp",
          "const auto first = begin_ + static_cast<SegmentId>(from);",
          "const auto first = static_cast<SegmentId>(from);", "index_test " + MANAGERS),
    Fault("the last end of a fiber is not kept", "index/kept_segments.h",
          "if (share_ends_ && has(i + 1)) return;", "if (share_ends_) return;",
          "arrays_test"),
    Fault("a box is kept as a capsule", "geometry/capsule_test.h",
          "s.isBox() ? std::numeric_limits<double>::quiet_NaN() : s.radius", "s.radius",
          "geometry_test"),
    Fault("the error of end points is the first's alone", "index/hull_filter.cpp",
          "both.error = p_error + errorOf(*hulls.to_first, both.q);", "both.error = p_error;",
          "index_test"),
    Fault("errors are those of the middle of the scene", "tree/extent.h",
          "return maxNorm(centerOfVolume(volume)) + double{volume.size()};",
          "return maxNorm(centerOfVolume(volume));", "index_test"),
    Fault("all pairs of a block get the answers of the first", "geometry/pair_lanes-inl.h",
          "std::uint64_t{lanes.apart.mask()} << i", "std::uint64_t{lanes.apart.mask()}",
          "geometry_test"),
    Fault("ids next to each other are neighbours in any two fibers", "fibers/fiber_table.h",
          "table.rule_.reach <= table.ids_behind_ &&", "", "registry_test " + MANAGERS),
    Fault("what was read in order is not fitted above its chunks", "index/segment_index.cpp",
          "        tree.fitAboveChunks(executor_.get());\n", "", "index_test"),
    Fault("a frame is kept although the segments have left it", "index/segment_index.cpp",
          "if (frame_lasts_ || staysWithin(in_new_frame_, now, 16)) return", "return",
          "index_test"),
    Fault("a frame is chosen in which coordinates overflow", "index/segment_source.cpp",
          "while (!source.staysFiniteIn(frame) &&", "while (false &&", "arrays_test"),
    Fault("a box that is unbounded has a middle", "tree/topology.cpp",
          "std::isfinite(sum[i]) ?", "true ?", "tree_test"),
    Fault("of unreadable segments any is named", "index/segment_source.cpp",
          "  std::sort(ids.begin(), ids.end());\n", "", "index_test"),
    Fault("the last segment of another kind of index is forgotten",
          "index/segment_index_search.cpp",
          "  for (const SegmentId b : other.leaves()) {\n",
          "  for (const SegmentId b : other.leaves()) {\n"
          "    if (b == other.leaves().back()) break;\n", MANAGERS),
    Fault("segments of another kind of index stay in their frame",
          "index/segment_index_search.cpp",
          "    segment = {to_this.around(segment.start, FrameChange::Grows::kNothing),\n"
          "               to_this.around(segment.end, FrameChange::Grows::kNothing)};\n", "",
          MANAGERS),
    Fault("a search for the nearest passes on capsules that are farther",
          "index/nearest_filter.h",
          "if (tests_all_) return true;", "if (tests_all_) return false;", "index_test"),
    Fault("a search for the nearest keeps its first limit", "broadphase/manager_query.cpp",
          "    nearer_than = limit();\n", "", MANAGERS),
    # --- Fibers ---
    Fault("a fiber that stays gets a dropped one's number", "fibers/fiber_table.h",
          "    numbers_[kept] = numbers_[f];\n", "", "registry_test " + MANAGERS),
    Fault("a new fiber gets its position as number", "fibers/fiber_table.h",
          "!= begin_.size()) numbers_.push_back(next_number_);",
          "!= begin_.size()) numbers_.push_back(static_cast<std::uint32_t>(begin_.size() - 1));",
          "registry_test " + MANAGERS),
    Fault("numbers start anew once all fibers are dropped", "fibers/fiber_table.h",
          "if (!numbers_.empty() || next_number_ + 1 != begin_.size()) numbers_.push",
          "if (!numbers_.empty()) numbers_.push", "registry_test " + MANAGERS),
    Fault("the first group is that of the first fiber", "fibers/fiber_table.h",
          "    groups_.resize(begin_.size(), kNoGroup);\n", "", "registry_test " + MANAGERS),
    Fault("a fiber that moves up gets a dropped one's group", "fibers/fiber_table.h",
          "if (!groups_.empty()) groups_[kept] = groups_[f];", "", "registry_test " + MANAGERS),
    Fault("a fiber that moves up is closed as a dropped one was", "fibers/fiber_table.h",
          "if (!flags_.empty()) flags_[kept] = flags_[f];", "", "registry_test " + MANAGERS),
    Fault("a fiber that moves up is as long as a dropped one was", "fibers/fiber_table.h",
          "      if (!arc_end_.empty()) {\n", "      if (false) {\n",
          "registry_test " + MANAGERS),
    Fault("an arc starts in the fiber before", "fibers/fiber_table.h",
          "is_first = begin_.back() == end_;", "is_first = end_ == 0;",
          "registry_test arrays_test"),
    Fault("ids behind a fiber are segments", "fibers/fiber_table.h",
          "return idsEnd(fiber) - ids_behind_;", "return idsEnd(fiber);", "arrays_test"),
    Fault("a fiber is cut where another thread goes on", "broadphase/new_objects.cpp",
          "capsule = capsuleAt(begin - 1);", "{}", "threads_test"),
    Fault("ends that are near each other are shared", "broadphase/new_objects.cpp",
          "= 4 * double{", "= 8 * double{", "broadphase_test"),
    Fault("a force pushes both sides one way", "arrays/accumulate.cpp",
          "k < 2 ? -nodes.weights[k] : nodes.weights[k]", "nodes.weights[k]", "arrays_test"),
    Fault("contacts of other fibers get forces", "arrays/accumulate.cpp",
          "(found.layout != layout_ && found.layout != 0) || !exists(found)", "!exists(found)",
          "arrays_test"),
    Fault("a range of points has the first of the next one", "arrays/accumulate.cpp",
          "point >= begin && point < end", "point >= begin && point <= end", "arrays_test"),
    Fault("keys lose their highest digit", "arrays/pair_order.cpp",
          "shift < bits; shift += digit", "shift + digit < bits; shift += digit", "arrays_test"),
    Fault("of strided points, only the last axis may not be NaN", "arrays/coordinates.h",
          "k < 3 && std::isfinite(most)", "k < 3", "arrays_test"),
    Fault("the longest way out of a solid is the depth", "arrays/fiber_tree.cpp",
          "if (p.solid != q.solid) return p.solid;", "if (p.solid && q.solid) return false;",
          "arrays_test"),
    Fault("a path through joints is as long as its last edge", "fibers/joint_graph.cpp",
          "reached.emplace(distance + edge.distance, edge.node)",
          "reached.emplace(edge.distance, edge.node)", "tree_test"),
    Fault("joints are hubs of none but the next ones", "fibers/joint_graph.cpp",
          "    if (edges[hub].empty()) break;", "    if (edges[hub].size() < 3) break;",
          "tree_test"),
    Fault("a fiber without objects leads on", "fibers/fiber_table.cpp",
          "    if (!std::all_of(fibers, fibers + 2, isLeft)) continue;\n", "", "tree_test"),
    Fault("no path leads around a closed fiber", "fibers/fiber_table.cpp",
          "if (!has_closed_ || (flags_[f] & kIsClosed) == 0) continue;", "continue;", "tree_test"),
    Fault("points come apart at the start of a step", "arrays/fiber_index.cpp",
          "    checkStillJoined(kStart, *start, joints_, executor);\n", "", "arrays_test"),
    Fault("a gap is part of the fiber before", "fibers/fiber_table.h",
          "- (gaps_.empty() ? 0 : gaps_[fiber]);", ";", "arrays_test"),
    Fault("arcs of what follows a gap are shifted", "fibers/fiber_table.h",
          "arc_end_.resize(static_cast<std::size_t>(end_), 0);", ";", "arrays_test"),
    # --- Arrays ---
    Fault("a capsule ends at the packed next point", "arrays/array_source.cpp",
          "first[k * axis + point]", "first[k * axis + 3]", "arrays_test"),
    Fault("a point's coordinates are next to each other", "arrays/coordinates.h",
          "static_cast<double>(p[axis]),", "static_cast<double>(p[1]),", "arrays_test"),
    Fault("segments are in the order of the tree", "arrays/fiber_index.cpp",
          "ids = table_.segments(index_.executor()).ids;", "ids = index_.leaves();", "arrays_test"),
    Fault("points of no fiber are checked", "arrays/array_source.cpp",
          "if (fibers.point_end == nullptr) return largest", "return largest", "arrays_test"),
    Fault("layouts with other gaps are one", "arrays/fiber_index.cpp",
          "if (table.hasGaps()) layout =", "if (false) layout =", "arrays_test"),
    Fault("another number of points is taken beside a gap", "arrays/fiber_index.cpp",
          "static_cast<std::size_t>(table_.idsEnd(f)) == pointEnd(fibers, f));", "true);",
          "arrays_test"),
    Fault("the last pairs behind the neighbour filter are lost", "arrays/pair_sinks.h",
          "for (std::size_t i = 0; i < run.count; i += most) {",
          "for (std::size_t i = 0; i + most <= run.count; i += most) {",
          "arrays_test"),
    Fault("trees of two kinds are searched together", "arrays/fiber_tree.cpp",
          "if (!index_->matches(*other)) {", "if (false) {", "arrays_test"),
    Fault("a partner without capsules is asked for them", "arrays/fiber_tree.cpp",
          "other.problem(index_->keepsSegments(), kNeedsStep<Question>)",
          "other.problem(false, kNeedsStep<Question>)", "arrays_test"),
    Fault("contacts of two trees take the fibers of one", "arrays/fiber_tree.cpp",
          "return {question.fibers, *question.others, layout};",
          "return {question.fibers, question.fibers, layout};",
          "arrays_test"),
    Fault("which of several is nearest depends on the tree", "arrays/nearest.cpp",
          "nearest = std::min(nearest, pair.a);", "nearest = pair.a;", "arrays_test"),
    Fault("what rounding leaves open is passed over", "arrays/nearest.cpp",
          "if (apart.distance - apart.error <= most_) {",
          "if (apart.distance + apart.error < most_) {", "arrays_test"),
    Fault("the nearest segment is the segment itself", "arrays/nearest.cpp",
          "if (is_own && (its == id || !counts(pair))) return kNoPair;",
          "if (is_own && !counts(pair)) return kNoPair;", "arrays_test"),
    Fault("the margin makes the least distance of a mesh less", "arrays/fiber_tree.cpp",
          "return index_->search(mesh, /*margin=*/0, sink);",
          "return index_->search(mesh, index_->options().margin, sink);", "arrays_test"),
    Fault("neighbours across fibers are ignored", "fibers/fiber_table.cpp",
          "if (last >= fiberEnd(fiber) || (flags", "if ((flags", "arrays_test registry_test"),
    Fault("neighbours are reported", "arrays/pair_sinks.h",
          "return !are_neighbors_(pair.a, pair.b);", "return true;", "arrays_test"),
    Fault("a fiber has the radius of the one before", "arrays/array_source.cpp",
          "if (index(i) < begin || index(i) >= end) {", "if (index(i) >= end) {", "arrays_test"),
    Fault("a point that is not finite is passed over", "arrays/array_source.cpp",
          "if (!std::isfinite(coordinate)) {", "if (false) {", "arrays_test"),
    Fault("what is not a number is less than a number before", "arrays/array_source.cpp",
          "return p >= q || std::isnan(p) ? p : q;", "return p >= q ? p : q;", "arrays_test"),
    Fault("the radius at the end of a fiber counts", "arrays/array_source.cpp",
          "if (!are_cones && last == pointEnd(fibers, f) && last > 0) --last;", "", "arrays_test"),
    Fault("threads put strands into each other's places", "tree/bundle.cpp",
          "behind_.data() + half + from - firsts[range];", "behind_.data() + half + from;",
          "tree_test"),
    Fault("a sample that misses the median is trusted", "tree/bundle.cpp",
          "const std::int32_t left = rank - below;", "const std::int32_t left = rank - below + 1;",
          "tree_test"),
    Fault("threads list segments from the wrong fiber on", "fibers/fiber_table.cpp",
          "begin_[f] + static_cast<SegmentId>(i) - fibers.begin[f];",
          "begin_[f];", "registry_test arrays_test"),
    Fault("a thread forgets which ids are segments", "index/kept_segments.cpp",
          "if (at / kBits != word) write();", "", "arrays_test"),
    Fault("only the mesh has a category that the other one meets", "tree/topology.h",
          "return (own & other.met) != 0 && ", "return ", "tree_test arrays_test"),
    Fault("a step with a mesh forgets categories", "index/segment_index_meshes.cpp",
          "reach.growth + mesh.error(), mesh.categories());",
          "reach.growth + mesh.error(), tree::kAllCategories);", "arrays_test"),
    Fault("the nearest triangles forget categories", "index/segment_index_meshes.cpp",
          "forMeetingLeaves(tree, mesh.categories(),",
          "forMeetingLeaves(tree, tree::kAllCategories,", "arrays_test"),
    Fault("copies of a mesh move with it", "arrays/triangle_mesh.cpp",
          "if (impl.use_count() > 1) {", "if (false) {", "arrays_test"),
    Fault("the depth in a solid is that of one end", "fibers/mesh_contacts.cpp",
          "dot(outward, triangle.a - capsule.b) + more_b});", "0.0});", "arrays_test"),
    Fault("the depth of a cone in a solid is that of its axis", "fibers/mesh_contacts.cpp",
          "dot(outward, triangle.a - capsule.b) + more_b});",
          "dot(outward, triangle.a - capsule.b)});", "arrays_test"),
    Fault("the rounding of the distance of cones is forgotten", "geometry/cone_distance.cpp",
          "std::fabs(margin)) + 8 * kEps * pair.size;",
          "std::fabs(margin)) - 8 * kEps * pair.size;", "geometry_test"),
    Fault("the nearest ball of a cone is beyond the foot of the thin side",
          "geometry/cone_distance.cpp", "clampedToUnit(foot + s.taper",
          "clampedToUnit(foot - s.taper", "geometry_test"),
    Fault("lanes take the larger radius of a cone for all of it", "geometry/triangle_test.cpp",
          "least_reach = max(min(radius, radius + bounds.taper) + margin, all(0));",
          "least_reach = reach;", "geometry_test"),
    Fault("the axis of a cone crosses only where its nearest ball is",
          "geometry/triangle_contact.cpp",
          "if (maxNorm(of_axis.apart) <= rounding) {", "if (false) {", "geometry_test"),
    Fault("the triangle nearest to a cone is that nearest to its axis", "index/posed_mesh.cpp",
          "safeNorm(closest.apart) + thinner;", "safeNorm(closest.apart) + 0 * thinner;",
          "arrays_test"),
    # --- Files ---
    Fault("a neuron's fiber runs through branching points", "io/swc.cpp",
          "while (!node->isEnd());", "while (!node->isRoot());", "io_test"),
    Fault("a line without points shifts what belongs to lines", "io/vtp.cpp",
          "while (ends[line] < read) ++line;", "if (ends[line] < read) ++line;", "io_test"),
    Fault("a voxel's corner passes for its centre", "io/trk.cpp",
          "voxel_size[from[k]] - 0.5;", "voxel_size[from[k]];", "io_test"),
    Fault("exchanged axes are reversed by one another", "io/trk.cpp",
          "header.sign[k] = points[k] ==", "header.sign[other] = points[k] ==", "io_test"),
    Fault("a sheared matrix is taken as it is", "io/trk.cpp",
          "= (m[i][k] + c[i][k] / det) / 2;", "= m[i][k] + 0 * c[i][k];", "io_test"),
    Fault("rounding decides on which side of an edge a corner is", "io/orientation.cpp",
          "  return areaSign({a, b, c});",
          "  return signOf(left - right);", "io_test"),
    Fault("a product that overflows decides", "io/orientation.cpp",
          "if (std::fabs(left - right) > rounding)", "if (!(std::fabs(left - right) <= rounding))",
          "io_test"),
    Fault("a face covers what it surrounds twice", "io/polygon.cpp",
          "return !overlap();", "return true;", "io_test"),
    Fault("what a file has rounded crosses itself", "io/polygon.cpp",
          "if (takeOffEars(0) || takeOffEars(rounded_)) return triangles_;",
          "if (takeOffEars(0)) return triangles_;", "io_test"),
    Fault("a balanced bow tie is taken for twisted", "io/polygon.cpp",
          "std::max({norm(normal), norm(cross(b, c)), norm(cross(c, a))});", "norm(normal) * 1e-9;",
          "io_test"),
    Fault("an ear lies between the ways to and fro", "io/polygon.cpp",
          "return edges_.count({to.place, from.place}) > 0;",
          "return edges_.count({to.place, from.place}) > 9;", "io_test"),
    Fault("the corner of a hole blocks no ear", "io/polygon.cpp",
          "enters(place, corners_[blocker.next].place, triangle, tolerance_)) {", "false) {",
          "io_test"),
    Fault("a name that ends with a backslash swallows the next line", "io/obj.cpp",
          "    read(file, takeWord(file));\n",
          "    read(file, takeWord(file));\n    while (!takeWord(file).empty()) continue;\n",
          "io_test"),
    Fault("live pairs: the growth of radii is left out", "live/node_pack.cpp",
          "(squareRoot(approach) + growth) * outward", "squareRoot(approach) * outward",
          "arrays_test"),
    Fault("live pairs: the second end of a cone grows unseen", "live/displacements.cpp",
          "const double last = all.may_taper ? second[3] : first[3];",
          "const double last = first[3];", "arrays_test"),
    Fault("live pairs: the last end of a block's cones grows unseen", "live/displacements.cpp",
          "result.growth = all.may_taper ?", "result.growth = false ?", "arrays_test"),
    Fault("live pairs: a cone is listed as a capsule", "live/anchors.cpp",
          "now.segments->mayTaper() ? b[3] : a[3]", "a[3]", "arrays_test"),
    Fault("live pairs: anchors of capsules serve for cones", "arrays/live_pairs.cpp",
          " && may_taper == other.may_taper", "", "arrays_test"),
    Fault("live pairs: one side of a displacement counts", "live/node_pack.cpp",
          "Eight::load(second.moved.high(axis)) - Eight::all(first.moved.low(axis)[row])",
          "Eight::all(first.moved.high(axis)[row]) - Eight::load(second.moved.low(axis))",
          "arrays_test"),
    Fault("live pairs: the gap of anchors counts twice", "live/node_pack.cpp",
          "reach * reach < gap", "reach * reach < gap + gap + gap + gap", "arrays_test"),
    Fault("live pairs: nodes of a pack have each other's pairs", "live/coverage.cpp",
          "is_one ? LaneMask{1} << row : 1;", "is_one ? LaneMask{2} << row : 1;", "arrays_test"),
    Fault("live pairs: the list covers twice its skin", "live/live_list.cpp",
          "covered_ = listed_ - mostApproach(sidesOf(pairing));",
          "covered_ = 2 * listed_;", "arrays_test"),
    Fault("live pairs: what is neither covered nor listed is left out", "live/live_list.cpp",
          "missing.push_back(*pair);", "(void)pair;", "arrays_test"),
    Fault("live pairs: a pair that was listed is listed twice", "live/live_list.cpp",
          "if (!are_listed[i]) pairs[kept++]", "pairs[kept++]", "arrays_test"),
    Fault("live pairs: a segment passes through a surface unseen", "live/live_list.cpp",
          "if (!pairing.isSolid()) missing.resize(", "missing.resize(", "arrays_test"),
    Fault("live pairs: a segment is inside although it touches", "live/inside.cpp",
          "near.has(id) || !deep_.has(id)", "!deep_.has(id)", "arrays_test"),
    Fault("live pairs: a list serves whose anchors are rounded by more than its skin",
          "live/live_list.cpp", "if (!(covered_ > 0)) return false;", "", "arrays_test"),
    Fault("live pairs: an update that is refused counts", "arrays/fiber_index.cpp",
          "  double largest = checkArrays(start",
          "  update_number_ = newNumber();\n  double largest = checkArrays(start", "arrays_test"),
    Fault("live pairs: a build that fails after it has changed the names ends no pair",
          "arrays/fiber_index.cpp",
          "    build_number_ = update_number_;\n  }\n"
          "  index_.build(source, frame, 0, table_.idCount(), runs);\n",
          "  }\n  index_.build(source, frame, 0, table_.idCount(), runs);\n"
          "  if (table != &table_) build_number_ = update_number_;\n", "faults_test"),
    Fault("live pairs: slots are free at once", "live/live_list.cpp",
          "for (const Entry& entry : ended_) free_.push_back(entry.slot);",
          "for (const Entry& entry : gone) free_.push_back(entry.slot);", "arrays_test"),
    Fault("live pairs: a build ends no pair", "live/live_list.cpp",
          "if (last == Last::kOtherNames) {", "if (false) {", "arrays_test"),
    Fault("live pairs: a query after an update finds the old volumes", "arrays/fiber_index.cpp",
          "if (index_.reread(source)) {", "if (index_.reread(source), index_.fitBeyond(0), true) {",
          "arrays_test"),
    Fault("live pairs: safe distances pass the gap", "live/live_list.cpp",
          "const double share = (is_mesh ? 1 : 0.5) * kInward;",
          "const double share = (is_mesh ? 1 : 0.55) * kInward;", "arrays_test"),
    Fault("live pairs: safe distances pass the gap to a mesh", "arrays/live_pairs.cpp",
          "gaps[i] = leastDistance(p, mesh_.end()[pairs[i].b]) - p.radius",
          "gaps[i] = 1.02 * leastDistance(p, mesh_.end()[pairs[i].b]) - p.radius", "arrays_test"),
    Fault("lanes tell gaps without errors", "geometry/capsule_test.cpp",
          "* all(1 - 8 * kEps) - reachUp(d);", "* all(1 - 8 * kEps) - d.reach;", "geometry_test"),
    Fault("live pairs: safe distances forget what has come near", "live/live_list.cpp",
          "uncovered.push_back(*pair);", "(void)pair;", "arrays_test"),
    Fault("live pairs: what is inside a solid may go anywhere", "live/live_list.cpp",
          "  for (const Entry& entry : inside_) lower(0, entry.pair.a, 0);\n", "", "arrays_test"),
    Fault("the distance of a triangle is that of points found", "geometry/triangle_distance.cpp",
          "if (slack <= 0x1p-26 * rough.squared) return rootOf(rough.squared - slack);",
          "if (slack <= 0x1p-26 * rough.squared) return rootOf(rough.squared);", "geometry_test"),
    Fault("live pairs: safe distances forget what is not listed", "live/live_list.cpp",
          "    setAll(side, wanted);\n", "", "arrays_test"),
]
# fmt: on


def fail(message):
    sys.exit(f"mutation.py: {message}")


def copy_sources():
    """Only what has changed is written, so that little is built anew."""
    files = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split("\n")
    wanted = {f for f in files if f and (ROOT / f).is_file()}
    for name in wanted:
        target = SOURCE / name
        content = (ROOT / name).read_bytes()
        if not target.exists() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            shutil.copymode(ROOT / name, target)
    if SOURCE.exists():
        for path in SOURCE.rglob("*"):
            if path.is_file() and str(path.relative_to(SOURCE)) not in wanted:
                path.unlink()


def configure():
    command = [
        "cmake",
        "-S",
        str(SOURCE),
        "-B",
        str(BUILD),
        "-G",
        "Ninja",
        "-DCMAKE_BUILD_TYPE=None",
        "-DCMAKE_CXX_FLAGS=-O1 -DHWY_COMPILE_ONLY_EMU128 -DFCL_FIBERS_ALWAYS_INLINE=inline",
        "-DFCL_FIBERS_BUILD_TESTS=ON",
        "-DFCL_FIBERS_BUILD_BENCHMARKS=OFF",
        "-DFCL_FIBERS_BUILD_TOOLS=OFF",
    ]
    if shutil.which("ccache"):
        command.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def build(test, jobs):
    done = subprocess.run(
        ["cmake", "--build", str(BUILD), "-j", str(jobs), "--target", test],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        fail(f"this does not compile:\n{done.stdout[-4000:]}{done.stderr[-2000:]}")


def failure(test):
    """The first test that fails, or None."""
    environment = dict(os.environ, GTEST_FAIL_FAST="1", GTEST_BRIEF="1")
    try:
        done = subprocess.run(
            [str(BUILD / "tests" / test)],
            env=environment,
            timeout=900,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        return f"{test} does not end"
    if done.returncode == 0:
        return None
    failed = [
        line.split("]")[1].split(",")[0].split("(")[0].strip()
        for line in done.stdout.splitlines()
        if "[  FAILED  ]" in line
    ]
    return f"{test}: {failed[0]}" if failed else f"{test} ends with {done.returncode}"


def planted(fault, sound):
    text = sound.replace(fault.before, fault.after)
    if fault.after == WELZL:
        if text.count(BEFORE_WELZL) != 1:
            fail("enclosingSphere() does not begin as expected")
        text = text.replace(BEFORE_WELZL, BEFORE_WELZL + CALL_WELZL)
    return text


def part(text):
    number, count = map(int, text.split("/"))
    if not 1 <= number <= count:
        raise ValueError(text)
    return number, count


def part_of_faults(number, count):
    """Those that the same executables catch are neighbours, as building these takes longest."""
    faults = sorted(FAULTS, key=lambda fault: fault.tests)
    return faults[(number - 1) * len(faults) // count : number * len(faults) // count]


def check_texts():
    for fault in FAULTS:
        count = (ROOT / "src" / fault.file).read_text().count(fault.before)
        if count != 1:
            fail(
                f"“{fault.name}”: the text to replace is {count} times in src/{fault.file}; "
                "it has to be there once"
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--list", action="store_true", help="name the faults, plant none")
    parser.add_argument("--part", type=part, metavar="I/N", help="plant those of part I of N")
    parser.add_argument("-j", "--jobs", type=int, default=os.cpu_count())
    parser.add_argument("names", nargs="*", help="parts of names of faults; all if none is given")
    arguments = parser.parse_args()

    faults = part_of_faults(*arguments.part) if arguments.part else FAULTS
    chosen = [
        f for f in faults if not arguments.names or any(name in f.name for name in arguments.names)
    ]
    if not chosen:
        fail("no fault has such a name; --list shows all")
    check_texts()
    if arguments.list:
        print("\n".join(fault.name for fault in chosen))
        return

    copy_sources()
    configure()
    passing = set()

    def pass_without_fault(test):
        if test in passing:
            return
        build(test, arguments.jobs)
        if (failed := failure(test)) is not None:
            fail(f"{failed} fails without a fault")
        passing.add(test)

    survivors = []
    for fault in chosen:
        start = time.monotonic()
        path = SOURCE / "src" / fault.file
        sound = path.read_text()
        caught = None
        for test in fault.tests.split():
            pass_without_fault(test)
            try:
                path.write_text(planted(fault, sound))
                build(test, arguments.jobs)
                caught = failure(test)
            finally:
                path.write_text(sound)
            if caught is not None:
                break
        print(
            f"{'caught  ' if caught else 'SURVIVES'} {fault.name}: {caught or 'no test fails'}"
            f" ({time.monotonic() - start:.0f} s)",
            flush=True,
        )
        if caught is None:
            survivors.append(fault.name)
    print(f"{len(chosen) - len(survivors)} of {len(chosen)} faults are caught")
    if survivors:
        fail("tests are missing that catch: " + "; ".join(survivors))


if __name__ == "__main__":
    main()
