// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/io/export.h>

namespace fcl_fibers::io {

/// @file
/// How many segments a smooth curve needs. Lengths are in any one unit, curvatures in its inverse.
///
///     const double curvature = largestCurvature(finely_sampled_fibers);
///     const int segments = segmentsForChordError(curvature, length, radius / 10);
///
/// The chord error e is the largest distance between a point of the curve and the chord of its
/// segment. The distance of two polylines differs from that of their curves by at most 2 e. So no
/// missed contact is deeper than 2 e. A margin of 2 e misses no contact, and every pair that it
/// adds is nearer than 4 e.

/// Bounds the distance between a part of a curve and its chord: curvature * length^2 / 8, or half
/// the length if that is less. The first bound is the sagitta, the error of linear interpolation by
/// arc length: de Boor, A Practical Guide to Splines, 1978, chapter III.
/// @param curvature  the largest curvature of the part
/// @param length     the length of the part along the curve
/// Throws std::invalid_argument if one of them is negative, NaN or infinite.
FCL_FIBERS_IO_EXPORT double chordError(double curvature, double length);

/// Returns the least number, 1 or more, of segments of equal length along the curve whose chord
/// error is at most `tolerance`.
/// @param curvature  the largest curvature of the curve
/// @param length     the length of the whole curve
/// @param tolerance  the allowed chord error, in the unit of the length
/// Throws std::invalid_argument as chordError() does, if the tolerance is not finite and above 0,
/// or if the curve would need more than 2^27 segments.
FCL_FIBERS_IO_EXPORT int segmentsForChordError(double curvature, double length, double tolerance);

/// Returns the largest curvature of the fibers, which is that of the circle through three
/// consecutive points (Menger). Points that coincide are skipped. The result is 0 if all fibers are
/// straight. Sample the curves finely first, but without noise, because noise counts as curvature.
/// Throws std::invalid_argument if point_begin is not as FiberPolylines requires, or if a
/// coordinate is NaN or infinite.
FCL_FIBERS_IO_EXPORT double largestCurvature(const FiberPolylines& scene);

}  // namespace fcl_fibers::io
