// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::scenes {

/// The scene `helix`, like a strand of hair: lengths in cm.
struct HelixParameters {
  int fibers = 1000;       ///< any number, at one density
  int segments = 100;      ///< per fiber
  double radius = 0.0035;  ///< of a human hair
  std::uint64_t seed = 1;  ///< same seed, same scene
  int frame = 0;           ///< time step of the motion
};

/// Helices of 30 cm with the density of a human scalp, 325 roots a square centimetre. With e for a
/// normal deviate scaled by 0.02, another one each time, a fiber has
///
///     turns = 4 (1 + e), helix radius R = 1 + e, phase phi = e,
///     w = 2 pi turns / 30, R reduced to 0.95 / w where R w > 0.95, c = sqrt(1 - R^2 w^2),
///
/// and its point i stands at arc length s = 30 i / segments:
///
///     root + (R (cos(w s + phi) - cos phi), R (sin(w s + phi) - sin phi), c s),
///
/// turned by pi/4 about y, then by pi/4 about x. Roots are uniform over an ellipse in the plane
/// z = 0, of fibers / 325 cm2, its axes in ratio 1.5 : 1, the longer along x. A frame adds 0.01 rad
/// to every phi and to the last turn.
///
/// Random numbers come from the seed alone, the same count for every fiber: frame and segments do
/// not change them, and more fibers leave the helices of the first ones as they are (their roots
/// spread with the ellipse). Platforms differ by the rounding of their sin, cos and log.
///
/// Throws std::invalid_argument if fibers or segments is below 1, or radius not finite or negative.
FiberPolylines makeHelix(const HelixParameters& parameters);

}  // namespace fcl_fibers::scenes
