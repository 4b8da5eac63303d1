// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/scenes/export.h>
#include <fcl_fibers/scenes/fiber_polylines.h>

namespace fcl_fibers::scenes {

/// @file
/// Into how many segments to cut a smooth curve. Lengths are in any one unit, curvatures in its
/// inverse.
///
/// A point of the curve is no further from the chord of its segment than the chord error e, so the
/// distance of two curves and that of their polylines differ by 2 e at most. Contacts that are
/// missed are no deeper than 2 e; with a margin of 2 e none is missed, and what is reported besides
/// is nearer than 4 e.

/// Bound of the distance between a curve and the chord of a piece of it, its sagitta:
/// curvature length^2 / 8, the error of linear interpolation by arc length (de Boor, A Practical
/// Guide to Splines, chapter III), or length / 2 if that is less.
/// @param curvature  the largest on the piece
/// @param length     of the piece, along the curve
/// Throws std::invalid_argument if one is negative, NaN or infinite.
FCL_FIBERS_SCENES_EXPORT double chordError(double curvature, double length);

/// The least number of segments, of one length along the curve, with a chord error of no more than
/// `tolerance`.
/// @param curvature  the largest of the curve
/// @param length     of the whole curve
/// @param tolerance  the chord error that is allowed
/// Throws std::invalid_argument as chordError, if the tolerance is not above 0, and if it takes
/// more than 2^27 segments.
FCL_FIBERS_SCENES_EXPORT int segmentsForChordError(double curvature, double length,
                                                   double tolerance);

/// The largest curvature of a scene's fibers, as their points tell: that of the circle through
/// three that follow each other (Menger). For a start sample the curves finely, as noise of the
/// points is curvature too. 0 if all are straight; points that coincide are passed over. Throws
/// std::invalid_argument if point_begin is not as FiberScene says, or a coordinate is NaN or
/// infinite.
FCL_FIBERS_SCENES_EXPORT double largestCurvature(const FiberScene& scene);

}  // namespace fcl_fibers::scenes
