// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::scenes {

/// The radius of the head, in cm.
constexpr double kHeadRadius = 9;

/// The scenes `cap` and `combed`, a head of hair: lengths in cm.
struct CapParameters {
  int fibers = 50000;      ///< at most 330,809
  int segments = 50;       ///< per fiber, each of 0.3 cm
  double radius = 0.0035;  ///< of a human hair
  std::uint64_t seed = 1;  ///< same seed, same scene
  double frame = 0;        ///< time of the motion, in frames; may lie between two
};

/// Fibers on a sphere of radius 9 about the origin, roots uniform over the cap about z of fibers /
/// 325 cm2. Geometry, no mechanics. With e for a normal deviate, another one each time, the fiber
/// at a root of outward normal n takes steps of 0.3 in a direction d, at first n, that turns before
/// step i = 0, 1, ...:
///
///     pull = (0.3 n_x + 0.02 e, 0.3 n_y + 0.02 e, -1), the same for all steps
///     wave = 0.05 (sin(0.6 i + 8 n_x), cos(0.6 i + 8 n_y), 0)
///     d <- d + 0.35 * 0.3 pull + wave + 0.01 (e, e, e),
///
/// normalised; a point that would enter the sphere is put back on it. A frame adds 0.01 to pull_x;
/// fibers near the top, which stand for a while, may fall to another side then.
///
/// Random numbers depend on seed and fiber alone. 50,000 x 50: 527,000 pairs of capsules touch,
/// adjacent ones left out. Platforms differ by the rounding of their sin, cos and log.
///
/// Throws std::invalid_argument if fibers is below 1 or above 330,809 (the whole sphere), segments
/// is below 1, or radius not finite or negative.
FiberPolylines makeCap(const CapParameters& parameters);

/// The scene `combed`: hair that lies on its head over its whole length. Roots are those of
/// makeCap(), on the sphere. Fibers leave away from the z axis and follow the sphere, turned by
/// 0.05 e before each step; a frame turns their first direction by 0.01. Points other than roots
/// are at a height of radius (1 + e / 2) above the sphere, at least 0. 50,000 x 50: most segments
/// touch a sphere of triangles, and others just fail to. Throws as makeCap() does.
FiberPolylines makeCombed(const CapParameters& parameters);

}  // namespace fcl_fibers::scenes
