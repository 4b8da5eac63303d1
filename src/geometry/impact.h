// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <type_traits>

#include <fcl_fibers/tree_export.h>

#include "geometry/moving_segment.h"

namespace fcl_fibers::geometry {

/// The first time in a step at which two moving capsules touch, and the arc parameters of their
/// closest points at that time.
struct Impact {
  double time;
  double s, t;
};

/// The first time at which a moving axis and the moving hull of K corners are in reach, and where
/// they are closest at that time.
template <int K>
struct Arrival {
  double time;
  double s;          ///< axis.a + s (axis.b - axis.a)
  double weight[K];  ///< of the corners; not negative, with sum 1
};
/// Of a capsule and a triangle.
using TriangleImpact = Arrival<3>;
/// Of a capsule and another hull.
template <class Hull>
using ImpactWith = std::conditional_t<std::is_same_v<Hull, Triangle>, TriangleImpact, Impact>;

/// Finds the first time at which two capsules are no further apart than the margin. It returns
/// false if they are further apart during the whole step.
///
/// With T(d) for the first time at which the distance of the axes is at most the sum of the radii,
/// the margin, `error` and d, the result lies between T(impactTolerance(p, q)) and T(0). So no
/// impact is missed, none is found too late, and one that is found too early is at most the
/// tolerance away from touching. Two capsules that touch() at the start have their impact at time
/// 0. What is not finite touches. A search of more than 4096 rounds, of a pair that almost touches
/// for long, doubles the tolerance in each that follows.
///
/// If one of the two is a box, the boxes of both count: the result is the first time at which they
/// are no further apart than margin and error on any axis. They move by linear bounds, s and t are
/// 0, and the time leans outward by rounding.
///
/// @param error  bounds the error of all four end points together, at any time
/// @param from   the capsules are known not to touch before this time
FCL_FIBERS_TREE_EXPORT bool findImpact(const MovingSegment& p, const MovingSegment& q,
                                       double margin, double error, double from, Impact& impact);
/// The same for a capsule and a triangle, through which its axis may pass, or for a box and that
/// around a triangle.
bool findImpact(const MovingSegment& p, const MovingTriangle& q, double margin, double error,
                double from, TriangleImpact& impact);

/// The arguments of findImpact().
template <class Hull>
struct ImpactQuery {
  MovingSegment p;
  Moving<Hull> q;
  double margin, error, from;
};

constexpr int kImpactsAtOnce = 8;

/// As findImpact() for up to kImpactsAtOnce pairs, most of which are decided side by side. It
/// returns a bit for each pair that has an impact. That with a triangle has 0 for t.
std::uint32_t findImpacts(const ImpactQuery<Segment>* queries, int count, Impact* impacts);
std::uint32_t findImpacts(const ImpactQuery<Triangle>* queries, int count, Impact* impacts);

/// As findImpact(), but two capsules that touch at the start have to come nearer first: the result
/// is the first time at which radii and margin exceed the distance by more than at the start, by
/// twice impactTolerance().
/// @pre they are not boxes
bool findApproach(const MovingSegment& p, const MovingSegment& q, double margin, double error,
                  double from, Impact& impact);
bool findApproach(const MovingSegment& p, const MovingTriangle& q, double margin, double error,
                  double from, TriangleImpact& impact);

/// How much too early, as a distance, findImpact() of two capsules may be: 2^-36 of the 1-norms of
/// their differences and of their radii.
double impactTolerance(const MovingSegment& p, const MovingSegment& q);
double impactTolerance(const MovingSegment& p, const MovingTriangle& q);

}  // namespace fcl_fibers::geometry
