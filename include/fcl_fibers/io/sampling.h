// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/io/export.h>

namespace fcl_fibers::io {

/// @file
/// How many segments a smooth curve needs. Lengths are in any one unit, curvatures in its inverse.
///
/// A point of the curve is no further from the chord of its segment than the chord error e. So the
/// distance of two curves and that of their polylines differ by at most 2 e. Contacts that are
/// missed are no deeper than 2 e. With a margin of 2 e no contact is missed, and any other pair
/// that is reported is nearer than 4 e.

/// Bounds the distance between a part of a curve and its chord, the sagitta: curvature length^2 /
/// 8, the error of linear interpolation by arc length (de Boor, A Practical Guide to Splines, 1978,
/// chapter III), or length / 2 if that is less.
/// @param curvature  the largest curvature of the part
/// @param length     its length along the curve
/// Throws std::invalid_argument if one of them is negative, NaN or infinite.
FCL_FIBERS_IO_EXPORT double chordError(double curvature, double length);

/// The least number of segments, all of one length along the curve, whose chord error is at most
/// `tolerance`.
/// @param curvature  the largest curvature of the curve
/// @param length     its whole length
/// @param tolerance  the chord error that is allowed
/// Throws std::invalid_argument as chordError() does, if the tolerance is not above 0, or if the
/// curve would take more than 2^27 segments.
FCL_FIBERS_IO_EXPORT int segmentsForChordError(double curvature, double length, double tolerance);

/// The largest curvature of a scene's fibers: that of the circle through three consecutive points
/// (Menger). Points that coincide are skipped. It is 0 if all fibers are straight. Sample the
/// curves finely first, but without noise, which counts as curvature. Throws std::invalid_argument
/// if point_begin is not as FiberPolylines requires, or if a coordinate is NaN or infinite.
FCL_FIBERS_IO_EXPORT double largestCurvature(const FiberPolylines& scene);

}  // namespace fcl_fibers::io
