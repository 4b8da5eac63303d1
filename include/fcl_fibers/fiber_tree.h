// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/fiber_questions.h>
#include <fcl_fibers/tree_export.h>

namespace fcl_fibers {

namespace arrays {
class FiberIndex;
}
template <class Partner>
class LivePairs;

/// Fibers as plain arrays, which FiberTree reads. Fiber f is the polyline through the points
/// [point_begin[f], point_begin[f + 1]), with a capsule between each two consecutive points. A
/// fiber of fewer than two points has no capsule. The arrays are borrowed for the length of a call.
/// S is float or double.
///
/// `point_end` leaves out points between fibers. The two strides tell where numbers of other
/// layouts are. So the arrays of most programs can be read in place.
///
///     const double points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};  // x, y, z of four points
///     const std::size_t point_begin[] = {0, 2, 4};                   // two fibers of two points
///     const double radius = 0.1;
///     const FiberArrays<double> fibers = {points, 4, point_begin, 2, &radius};
template <typename S>
struct FiberArrays {
  static_assert(std::is_same_v<S, float> || std::is_same_v<S, double>);

  /// How many radii there are, and for which capsules.
  enum class Radii {
    kOne,       ///< one: radii[0] for all capsules
    kPerFiber,  ///< fiber_count: radii[f] for all capsules of fiber f
    /// point_count: radii[i] for the capsule whose first point is point i. Those at the last point
    /// of a fiber and at points that `point_end` leaves out are not read.
    kPerFirstPoint,
    /// point_count: radii[i] at point i. Along a segment the radius changes linearly, so the
    /// segment is a rounded cone: the hull of the balls around its two points. Radii at points that
    /// `point_end` leaves out are not read.
    kPerPoint,
  };

  /// x, y, z of each point: 3 * point_count finite numbers. Points that `point_end` leaves out are
  /// of no fiber, and need not be finite.
  const S* points = nullptr;
  std::size_t point_count = 0;  ///< including those of no fiber; at most 2^27
  /// fiber_count + 1 numbers, which begin with 0, end with point_count and never descend.
  const std::size_t* point_begin = nullptr;
  std::size_t fiber_count = 0;    ///< including fibers without capsules; at most 2^27
  const S* radii = nullptr;       ///< in the unit of the points; finite, not negative
  Radii radii_are = Radii::kOne;  ///< what `radii` holds
  /// fiber_count numbers: 1 for a closed fiber, 0 for an open one. Null if no fiber is closed. The
  /// last point of a closed fiber repeats its first, so its last capsule is a neighbour of its
  /// first.
  const std::uint8_t* closed = nullptr;
  /// fiber_count numbers: the point of a fiber, mostly of another one, that the first point of each
  /// fiber repeats, or -1 for none. So fibers form trees, such as neurons and vessels. Null if no
  /// fiber starts at another one. Segments that meet there are adjacent, and neighbours count along
  /// the tree, in loops by the shortest way. Both points have equal coordinates.
  const std::int32_t* starts_at = nullptr;
  /// fiber_count numbers: the point of a fiber that the last point of each fiber repeats, or -1 for
  /// none. So vessels form loops. Null if no fiber ends at another one.
  const std::int32_t* ends_at = nullptr;
  /// fiber_count group numbers, 0 for a fiber without a group. Null if no fiber has one. See
  /// FiberGroup.
  const std::int32_t* groups = nullptr;
  /// fiber_count bit masks: the categories of meshes that each fiber may meet. Null for all. See
  /// TriangleMesh::setCategories() for the rule.
  const std::uint32_t* meets = nullptr;
  /// fiber_count numbers, not negative: how many segments at the start of each fiber meet no mesh,
  /// because they are in the scalp. Null if there are none. rootSegments() counts them by length.
  const std::int32_t* root_segments = nullptr;
  /// fiber_count bit masks: the categories of each fiber. Null if every fiber has all.
  const std::uint32_t* categories = nullptr;
  /// Bytes from a point to the next one: multiples of alignof(S), also negative, or 0 for
  /// 3 * sizeof(S), as packed points have. `points` is x of point 0 in any case.
  ///
  ///     fibers.point_stride = 4 * sizeof(float);  // x, y, z and a fourth number of each point
  std::ptrdiff_t point_stride = 0;
  /// Bytes from x to y and from y to z of a point, as above; 0 for sizeof(S). If it is given, so is
  /// point_stride.
  ///
  ///     fibers.point_stride = sizeof(double);  // all x, then all y, then all z
  ///     fibers.axis_stride = point_count * sizeof(double);
  std::ptrdiff_t axis_stride = 0;
  /// fiber_count numbers: fiber f has the points [point_begin[f], point_end[f]). Those up to
  /// point_begin[f + 1] are of no fiber, such as ghost nodes between rods. They are not read, but
  /// count in the numbers of points. point_begin[0] may then be more than 0. Null if each fiber
  /// ends where the next one begins.
  const std::size_t* point_end = nullptr;
};

/// Returns for each fiber how many of its first segments begin at less than `length` along the
/// fiber from its start, for FiberArrays::root_segments. Throws std::invalid_argument if an array
/// is null or does not fit the others, or if the length is negative, NaN or infinite.
template <typename S>
FCL_FIBERS_TREE_EXPORT std::vector<std::int32_t> rootSegments(const FiberArrays<S>& fibers,
                                                              double length);

/// Options of a FiberTree: those of FiberOptions, and what bounds the nodes of the tree. By default
/// a tree reports what touches, and leaves out adjacent segments.
struct FiberTreeOptions : FiberOptions {
  /// Takes all of `options`. A FiberOptions{} has the defaults of managers, not those of a tree.
  FiberTreeOptions(const FiberOptions& options = {Topology::kBundle, Report::kCapsules, 1})
      : FiberOptions(options) {}

  /// What bounds the nodes of the tree.
  enum class Volumes {
    kLayeredBoxes,    ///< as in LayeredAABBTreeCollisionManager
    kWrappedSpheres,  ///< as in WrappedSphereTreeCollisionManager
  };
  Volumes volumes = Volumes::kLayeredBoxes;  ///< boxes are faster; spheres are those of the paper
};

/// A box or a sphere that bounds a node of a FiberTree, for pictures and statistics. It contains
/// the capsules below the node, each thickened by half the margin. Coordinates are in the frame of
/// the arrays.
struct TreeVolume {
  FiberTreeOptions::Volumes kind = FiberTreeOptions::Volumes::kLayeredBoxes;  ///< box or sphere
  double center[3] = {0, 0, 0};                                               ///< x, y, z
  double half[3] = {0, 0, 0};  ///< half the edges of a box; the radius of a sphere, three times

  /// The capsules below the node, each named by the index of its first point. They are borrowed
  /// from the tree until it is built, updated or destroyed.
  const std::int32_t* segments = nullptr;
  std::size_t segment_count = 0;  ///< number of `segments`
};

/// Answers questions about fibers that a program keeps in its own arrays, such as which segments
/// touch. It has the tree of the fiber managers and reports the same pairs, but it needs no FCL
/// object for each segment. This header needs neither FCL nor Eigen.
///
///     FiberTree tree(options);
///     tree.build(fibers);
///     tree.visit(Pairs{}, [&](SegmentPair pair) { handle(capsuleContact(fibers, pair)); });
///     tree.find(TouchingSegments{}, head, segments);
///     tree.find(Pairs{}, HalfSpaceShape{{0, 0, 1}, 0}, segments);  // at or below the ground
///
/// To ask about single points, make each point a fiber of one segment whose two points are equal. A
/// tree of these fibers finds the nearest segment of each point, and all segments that hold it.
///
///     points_tree.find(Nearest{distance}, tree, pairs);
///     points_tree.find(Pairs{}, tree, pairs);
///
/// Queries are const and may run from several threads at once. While a query runs, for instance in
/// its visitor, build() and update() of each tree that it reads throw std::invalid_argument and
/// change nothing. What is moved, assigned to or destroyed meanwhile, and a mesh that changes,
/// counts for the query as it was when the query began. No query may begin during a build or an
/// update.
///
/// build() and update() refuse invalid arrays: they throw std::invalid_argument, whose text names
/// the point, fiber or radius, and leave the tree as it was. If one of them runs out of memory
/// (std::bad_alloc), queries throw std::invalid_argument until one of the two succeeds.
class FCL_FIBERS_TREE_EXPORT FiberTree {
 public:
  /// Makes an empty tree. Throws std::invalid_argument if an option is out of range.
  explicit FiberTree(const FiberTreeOptions& options = {});

  /// Takes over the fibers and options of the other tree. The other one is then empty and keeps its
  /// options.
  ///@{
  FiberTree(FiberTree&&) noexcept = default;
  FiberTree& operator=(FiberTree&&) noexcept = default;
  ///@}

  /// Replaces all fibers and builds the tree. Coordinates may be in any frame and unit.
  template <typename S>
  void build(const FiberArrays<S>& fibers);

  /// Reads the points and radii again after they have changed. Every fiber must have as many points
  /// as at the last build(). S may differ from it. Closed fibers, groups, categories and roots stay
  /// as they were at that build. Branches stay, too: `starts_at` and `ends_at` are null or as they
  /// were. The two points of each branch must have equal coordinates again.
  template <typename S>
  void update(const FiberArrays<S>& fibers);

  /// Reads the points and radii of a step: each changes linearly from `start`, at time 0, to `end`,
  /// at time 1. Impacts, MovingPairs and safeStep() ask about the step; all other questions are
  /// answered for its end. An update with one argument, or a build, ends the step. Throws
  /// std::invalid_argument as the update above does, and if the tree has wrapped spheres.
  template <typename S>
  void update(const FiberArrays<S>& start, const FiberArrays<S>& end);

  /// Calls the visitor once for everything that the question finds of the partner: this tree or
  /// another one, a mesh, a mesh that moves, or a shape. The visitor returns nothing or a bool;
  /// true ends the query. This call returns whether the visitor ended it. The order depends only on
  /// the arrays that were passed to the builds and updates, and on the poses of meshes.
  ///
  /// If the partner is a tree, Pairs, Impacts and MovingPairs are handed on while the search goes
  /// on, so the visitor can end the search early. Contacts, and Pairs in another order than kFound,
  /// are all found before the first call. visitInParallel() hands on everything as it is found.
  ///
  /// If another tree is the partner, `a` of a pair is a segment of this tree and `b` one of the
  /// other. The report and the margin of this tree count. No pair is left out as neighbours or as
  /// one group. For a question about a step, update the other tree with a step too; if it rests,
  /// pass the same arrays twice.
  ///
  /// Throws std::invalid_argument if
  /// * the other tree has different volumes or another topology, or if this tree has
  ///   Report::kCapsules and the other one does not;
  /// * the question is about a step and the last update was none, or the meshes of a MeshStep do
  ///   not fit each other;
  /// * a tree has Report::kVolumes, so that it keeps no capsules, and the question needs them: only
  ///   MovingPairs, and Pairs and Contacts of trees and shapes, are answered then, and what they
  ///   find may be apart;
  /// * a number of a shape is NaN or its magnitude exceeds 2^1000, its radius is negative, its low
  ///   exceeds its high, its normal is 0, or its matrix is no rotation;
  /// * a mesh or a shape is so far from the fibers that its coordinates overflow.
  template <class Question, class Partner, class Visitor>
  bool visit(const Question& question, const Partner& partner, Visitor&& visit) const {
    requireAnswer<Question, Partner>();
    using Found = FoundBy<Question, Partner>;
    const auto hand = [&visit](const void* found, std::size_t count, int /*worker*/) {
      for (auto one = static_cast<const Found*>(found), end = one + count; one != end; ++one) {
        if constexpr (std::is_void_v<decltype(visit(*one))>) {
          visit(*one);
        } else if (visit(*one)) {
          return true;
        }
      }
      return false;
    };
    if constexpr (std::is_constructible_v<Questions, const Question&>) {
      return ask({"visit", question, &static_cast<const Asked<Partner>&>(partner)}, std::ref(hand));
    } else {
      std::vector<Found> contacts;
      findContacts<Asked<Partner>>(question, partner, contacts);
      return hand(contacts.data(), contacts.size(), 0);
    }
  }
  /// Asks about this tree itself.
  template <class Question, class Visitor>
  bool visit(const Question& question, Visitor&& visit) const {
    return this->visit(question, *this, std::forward<Visitor>(visit));
  }

  /// Replaces the content of `found` by everything that visit() would be called with. The vector
  /// keeps its memory for the next call, and its content if the call is refused.
  ///
  /// If a radius is far too large, all segments touch, and the pairs of 10^5 would take 40 GB. So
  /// this call, visit() of Contacts or in an order, closest() and LivePairs::update() throw
  /// std::length_error once they keep more than 1 GiB and more than 256 answers for each segment,
  /// or for each of the partner's segments or triangles if these are more. Then the vector holds a
  /// part of what was found; with Contacts it holds what it held before. visit() of Pairs in the
  /// order found and visitInParallel() keep nothing.
  template <class Question, class Partner, class Found>
  void find(const Question& question, const Partner& partner, std::vector<Found>& found) const {
    requireAnswer<Question, Partner>();
    static_assert(kIsFoundBy<Found, Question, Partner>, "see found() of the question");
    if constexpr (std::is_constructible_v<Questions, const Question&>) {
      // Old elements are written over, because a vector that was cleared would zero them again.
      const auto room = [&found](std::size_t count) {
        if (count > found.size()) found.resize(count);
        return static_cast<void*>(found.data());
      };
      found.resize(
          fill({"find", question, &static_cast<const Asked<Partner>&>(partner)}, std::ref(room)));
    } else {
      findContacts<Asked<Partner>>(question, partner, found);
    }
  }
  /// Asks about this tree itself.
  template <class Question, class Found>
  void find(const Question& question, std::vector<Found>& found) const {
    find(question, *this, found);
  }

  /// Calls visit(found, worker) once for everything that the question finds of the partner, on all
  /// threads of the tree at the same time and in any order. This lets a program that adds up for
  /// itself use all cores, while visit() makes all calls on one thread. `worker` is from 0 to
  /// workerCount() - 1. No two calls at the same time have the same, so each may have sums of its
  /// own, which are added at the end:
  ///
  ///     std::vector<Sums> sums(tree.workerCount());
  ///     tree.visitInParallel(Contacts{fibers}, [&](const Contact& contact, int worker) {
  ///       sums[worker].add(contact);
  ///     });
  ///
  /// Which worker gets what differs from run to run, and so do the last digits of sums of floats.
  /// FiberTree::accumulate() adds in an order that is always the same.
  ///
  /// `visit` returns nothing or a bool. After it has returned true or has thrown, each other thread
  /// may still call it up to 63 times. Then visitInParallel() returns true, or throws one of the
  /// exceptions. `visit` may query any tree. A query that it asks on another thread than the
  /// caller's runs on that thread alone. A question's order has no effect. Throws as visit() does.
  template <class Question, class Partner, class Visitor>
  bool visitInParallel(const Question& question, const Partner& partner, Visitor&& visit) const {
    requireAnswer<Question, Partner>();
    using Found = FoundBy<Question, Partner>;
    const auto hand = [&visit](const void* found, std::size_t count, int worker) {
      for (auto one = static_cast<const Found*>(found), end = one + count; one != end; ++one) {
        if constexpr (std::is_void_v<decltype(visit(*one, worker))>) {
          visit(*one, worker);
        } else if (visit(*one, worker)) {
          return true;
        }
      }
      return false;
    };
    if constexpr (std::is_constructible_v<Questions, const Question&>) {
      return ask({"visitInParallel", question, &static_cast<const Asked<Partner>&>(partner),
                  /*on_all_threads=*/true},
                 std::ref(hand));
    } else {
      return visitContacts<Asked<Partner>>(question, partner, std::ref(hand));
    }
  }
  /// Asks about this tree itself.
  template <class Question, class Visitor>
  bool visitInParallel(const Question& question, Visitor&& visit) const {
    return visitInParallel(question, *this, std::forward<Visitor>(visit));
  }

  /// Returns one more than the largest `worker` of visitInParallel(). This is `threads` of the
  /// options, or the number of threads that oneTBB allows if that is less. By default oneTBB allows
  /// as many as there are cores.
  int workerCount() const;

  /// Returns a time of the step up to which none of the Pairs starts to touch, or 1 if none does. A
  /// pair that touches at the start counts once it comes nearer, so the result is close to 0, such
  /// as 1e-9, if one of these pairs comes nearer from the start. To leave such pairs out, take the
  /// least time above 0 of Impacts, or pass radii to update() with which nothing touches at the
  /// start. The least of the results for several partners, such as trees, meshes and shapes, is
  /// safe for all.
  ///
  /// The time is never too late, and as little too early as that of an impact. A pair that touches
  /// at the start, or misses that by less than rounding, does not stop the step until it is nearer
  /// than at the start by 2^-35 of the sizes and distance of the capsules. The last digits of the
  /// time may depend on the number of threads.
  ///
  /// A segment that is wholly inside a solid mesh at the start does not count. A segment whose axis
  /// crosses a triangle at the start cannot come nearer to this triangle. It counts for other
  /// triangles, and for this one if its radius grows or a thicker part of it comes there. An axis
  /// that is in a box, crosses a plane, or crosses the axis of a capsule cannot come nearer to it
  /// either. In a half-space it comes nearer as it sinks.
  ///
  /// A program that moves only so far meets the same pair again at once. The pairs that touch next
  /// are the impacts whose time is little more than this one. Throws as visit() of Impacts does. It
  /// has to compute a time for every pair that touches at the start. So it also throws
  /// std::length_error once it has computed the times of 2^24 pairs, if these are more than 256 for
  /// each segment or for each of the partner's.
  template <class Partner>
  double safeStep(const Partner& partner) const {
    requireAnswer<SafeStep, Partner>();
    double time = 1;
    const auto keep = [&time](const void* found, std::size_t /*count*/, int /*worker*/) {
      time = *static_cast<const double*>(found);
      return true;
    };
    ask({"safeStep", SafeStep{}, &static_cast<const Asked<Partner>&>(partner)}, std::ref(keep));
    return time;
  }
  double safeStep() const { return safeStep(*this); }  ///< for the pairs of this tree

  /// Returns the contact of the least distance between this tree and the partner: another tree, a
  /// mesh, or this tree, whose neighbours and groups are left out. If something touches, it is the
  /// deepest contact, which has the least, negative distance. The margin does not count. Of equal
  /// distances that of the least pair of names counts. If there is no pair, the distance is
  /// infinite and the segments are -1. Threads share the work where something touches. All pairs
  /// that touch are kept to find it, so it may throw std::length_error as find() does.
  ///
  ///     const Contact c = tree.closest(Contacts{fibers, &others}, other_tree);
  ///     if (c.distance < 0.1) slowDown(c.a.fiber, c.b.fiber);
  ///
  /// A segment in a solid mesh counts by its shortest way out: among its contacts that have `solid`
  /// set, the one of least depth counts. If the solid is not convex, this way need not free the
  /// segment.
  ///
  /// The distance is that of a contact. Apart from longer ways out, no other contact of the two has
  /// a smaller one, up to the error of both. Throws as find() of Contacts does, if the tree has
  /// Report::kVolumes, and if the coordinates of one tree overflow in the unit of the other.
  template <typename S, class Partner>
  FoundBy<Contacts<S>, Partner> closest(const Contacts<S>& question, const Partner& partner) const {
    requireAnswer<Nearest, Partner>();
    FoundBy<Contacts<S>, Partner> closest;
    findClosest(question, partner, closest);
    return closest;
  }
  template <typename S>
  auto closest(const Contacts<S>& question) const {  ///< for the pairs of this tree
    return closest(question, *this);
  }

  /// Writes the contacts of `count` pairs of this tree and the partner to `contacts`, in their
  /// order; the partner may be this tree. Throws as find() of Contacts does; then some of the
  /// contacts may have been written.
  template <typename S, class Partner, class Found>
  void writeContacts(const Contacts<S>& question, const Partner& partner,
                     const FoundBy<Pairs, Partner>* pairs, std::size_t count,
                     Found* contacts) const {
    writeAsked<Asked<Partner>>(question, partner, pairs, count, contacts);
  }

  /// Adds the forces at contacts onto the points that carry them, by the weights of
  /// BareContact::nodes(). A force acts on the side b of its contact, which is the mesh or the
  /// shape if there is one, and the opposite force acts on a.
  ///
  ///     std::vector<double> pushes;  // one for each contact; positive numbers push apart
  ///     std::vector<std::array<double, 3>> sums(point_count);
  ///     tree.accumulate({contacts, pushes}, sums);
  ///
  /// The first form is for contacts within this tree, and for contacts with a mesh or a shape if
  /// only the tree's points have sums. The others are for contacts with a partner whose points have
  /// sums of their own. PointSums{} in place of one of the two adds nothing there.
  ///
  /// The threads of this tree share the work. Each sum has the bits of a loop over the contacts in
  /// their order that adds onto the points in the order of BareContact::nodes().
  ///
  /// Throws std::invalid_argument, before it adds anything, if there are more or fewer forces than
  /// contacts, if a force is NaN or infinite as a number of the sums' type, if s, t or a weight is
  /// not in [0, 1], if a contact's `layout` is neither 0 nor that of this tree and the partner, if
  /// its points or triangle do not exist, or if there are not as many sums as points. If the layout
  /// is 0, it also throws if no segment starts at a contact's point. If the layout is not 0, it
  /// does not check this.
  ///
  /// A contact does not tell of which mesh it is, so pass the one that it was found with. The sums
  /// must share no memory with the contacts and the forces, which are read again while it adds.
  ///@{
  void accumulate(const ContactForces& forces, const PointSums& sums) const;
  void accumulate(const ContactForces& forces, const FiberTree& other, const PointSums& sums,
                  const PointSums& other_sums) const;
  void accumulate(const ContactForces& forces, const TriangleMesh& mesh, const PointSums& sums,
                  const PointSums& mesh_sums) const;
  ///@}

  /// Returns the number that contacts of this tree have as `layout`. It is equal for equal
  /// `point_begin` and `point_end`, and never 0 after a build.
  std::uint32_t layout() const { return layout(*this); }
  /// Returns the number that contacts with another tree have as `layout`.
  std::uint32_t layout(const FiberTree& other) const;

  /// Returns the volumes that are `depth` levels below the root, whose own depth is 0. Capsules
  /// that are less deep come as volumes of their own, so every capsule is in one of the volumes.
  /// Throws std::invalid_argument if depth is negative.
  std::vector<TreeVolume> volumes(int depth) const;

  /// Returns the fiber of the segment that starts at point `segment`, and its number along that
  /// fiber, both counted from 0. Throws std::invalid_argument if no segment starts there.
  FiberSegment fiberSegment(std::int32_t segment) const;

  /// Returns the names of all segments in ascending order, which is that along the fibers, fiber
  /// after fiber. The place of a segment there is its running number, which suits arrays with an
  /// element for each segment: segments()[n] is segment n, and std::lower_bound finds n.
  std::vector<std::int32_t> segments() const;

  std::size_t fiberCount() const;           ///< including fibers without capsules
  std::size_t segmentCount() const;         ///< number of capsules
  const FiberTreeOptions& options() const;  ///< the options given at construction

  /// Returns the bytes that the tree holds, including those that a query on several threads keeps
  /// for the next one.
  std::size_t memoryUsage() const;

 private:
  /// The question of safeStep().
  struct SafeStep {
    static double found(const FiberTree&);
    static double found(const MeshStep&);
    static double found(const Shape&);
  };
  using Questions = std::variant<Pairs, TouchingSegments, Nearest, Impacts, MovingPairs, SafeStep>;
  struct Query {
    const char* call;  ///< the function that was called
    Questions question;
    std::variant<const FiberTree*, const TriangleMesh*, const MeshStep*, const Shape*> partner;
    bool on_all_threads = false;  ///< whether all threads may call a visitor
  };
  /// A shape of any type is asked about as a Shape.
  template <class Partner>
  using Asked = std::conditional_t<std::is_convertible_v<Partner, Shape>, Shape, Partner>;
  /// Takes a run of FoundBy<the question, the partner> on a thread. True ends the query.
  using Take = std::function<bool(const void* found, std::size_t count, int worker)>;
  /// Returns where so many of them have room. What was written there before is still there.
  using Room = std::function<void*(std::size_t count)>;
  bool ask(const Query& query, const Take& take) const;
  std::size_t fill(const Query& query, const Room& room) const;  ///< returns how many were found
  template <class Partner, typename S>
  bool visitContacts(const Contacts<S>& question, const Partner& partner, const Take& take) const;
  template <class Partner, typename S, class Found>
  void findContacts(const Contacts<S>& question, const Partner& partner,
                    std::vector<Found>& contacts) const;
  template <typename S, class Partner, class Found>
  void findClosest(const Contacts<S>& question, const Partner& partner, Found& closest) const;
  template <class Partner, typename S, class Found>
  void writeAsked(const Contacts<S>& question, const Partner& partner,
                  const FoundBy<Pairs, Partner>* pairs, std::size_t count, Found* contacts) const;

  template <class Question, class Partner>
  static constexpr void requireAnswer() {
    static_assert(
        kHasAnswer<Question, Partner>,
        "This question is not asked of this partner. There are: Pairs and Contacts of a "
        "FiberTree, TriangleMesh or Shape; TouchingSegments of a TriangleMesh; Nearest and "
        "closest() of a FiberTree or TriangleMesh; Impacts and safeStep() of a FiberTree, MeshStep "
        "or Shape; MovingPairs of a FiberTree. The table in fiber_questions.h tells why.");
  }

  template <class Partner>
  friend class LivePairs;
  /// Returns the fibers and the tree, which stay until the result goes.
  FCL_FIBERS_TREE_NO_EXPORT std::shared_ptr<arrays::FiberIndex> index() const;

  class FCL_FIBERS_TREE_NO_EXPORT Impl;
  FCL_FIBERS_TREE_NO_EXPORT Impl& change(const char* call);

  FCL_FIBERS_TREE_NO_EXPORT std::shared_ptr<Impl> impl() const;

  FiberTreeOptions options_;
  std::shared_ptr<Impl> impl_;  ///< shared with the queries that run; null after a move
};

}  // namespace fcl_fibers
