// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "scenes/cosserat_rod.h"

namespace fcl_fibers::scenes {

/// @file
/// The test cases of Sobottka, Varnik and Weber, Collision Detection in Densely Packed Fiber
/// Assemblies with Application to Hair Modeling, section 4, as far as its text tells: fibers are
/// Cosserat rods in equilibrium (cosserat_rod.h). Lengths are in cm, forces in dyn.
///
/// A rod is a human hair: radius 0.0035, bending stiffness 4.7 dyn cm2, twisting stiffness 3.5 dyn
/// cm2, without stretch and shear. Where not said otherwise, roots are uniform over an ellipse in
/// the plane z = 0 with the density of a human scalp, 325 / cm2, its axes in ratio 1.5 : 1, the
/// longer along x. "Deviates" are normal, of the standard deviation given, another one each time.
///
/// Random numbers depend on seed and fiber alone. Points of equal arc length; where a rod is solved
/// at fewer points than it has, those in between are interpolated (refinedPoints), where at more,
/// the others are left out. Platforms differ by the rounding of their sin, cos and log.
///
/// All throw std::invalid_argument if fibers or segments is below 1, or radius not finite or
/// negative. "Touching pairs" are pairs of capsules, adjacent ones of a fiber left out; no other
/// segments of a fiber touch. The paper gives their numbers for cases 3 and 4, but neither root
/// areas nor how much fibers vary: those of makePaperHalfScalp() and makePaperStrand() were chosen
/// so that the numbers come out within 15 %.

/// The guide filament of the assemblies, without load: a hair of 15 cm along z from the origin.
CosseratRod guideFilament();

/// The tip loads of the guide filament of the dynamic assembly, in the frame of the rod's base,
/// from straight to a loop in 100 steps: 101 states. They are made, not recorded: with a = i / 100
/// and the smooth step b = a^2 (3 - 2 a), for a rod along z of 15 cm and bending stiffness 4.7 dyn
/// cm2,
///
///     force  = 0.05 (b, -sin(pi a), sin(2 pi a)) dyn
///     torque = 4.7 (2 pi / 15) (b, 0.1 sin(pi a), 0.2 sin(2 pi a)) dyn cm,
///
/// rounded to 1e-6: the torque about x ends at that of a full circle in the plane of y and z; the
/// rest sways the filament on its way and, at the end, keeps the loop from closing.
std::vector<RodLoad> loopTrajectory();

/// Case 1, static assembly: the order of magnitude that fibers grow to with a common bend.
///
/// Straight fibers of 15 cm along z, bent by the load of one state of loopTrajectory(): force and
/// torque times 1 + a deviate of 0.02 each, and both turned about z by a deviate of 0.02 rad. The
/// whole is turned by pi/4 about y, then by pi/4 about x. A frame swings the load: it is multiplied
/// by 1 + 0.05 sin(0.1 frame).
///
/// 1,000 x 100: 14,800 touching pairs. Not turned, in state 1, fibers bend by less than 0.1 rad:
/// all but parallel to z, the best case of boxes.
struct PaperStaticParameters {
  int fibers = 1000;       ///< the paper: 50 to 1,000
  int segments = 100;      ///< per fiber
  int state = 40;          ///< of the trajectory: 0 straight, 100 a loop
  bool turned = true;      ///< about two axes
  double radius = 0.0035;  ///< of a human hair, in cm
  std::uint64_t seed = 1;  ///< same seed, same scene
  int frame = 0;           ///< time step of the motion
};

/// The scene of these parameters.
FiberPolylines makePaperStatic(const PaperStaticParameters& parameters);

/// Case 2, dynamic assembly: from parallel fibers, where boxes are thin, to a loop, where parts
/// meet that are far from each other along the fibers.
struct PaperDynamicParameters {
  int fibers = 150;        ///< the paper's
  int segments = 100;      ///< per fiber
  bool turned = false;     ///< about two axes, as case 1
  double radius = 0.0035;  ///< of a human hair, in cm
  std::uint64_t seed = 1;  ///< same seed, same scenes

  /// The loads of the guide filament's tip, one for each state, in the frame of its base, as
  /// readLoads() reads them; those of loopTrajectory() if there are none.
  std::vector<RodLoad> loads = {};
};

/// The assembly of case 1 under the loads of a guide filament. Any number of threads may ask for
/// scenes at once.
class PaperDynamic {
 public:
  /// Solves the guide filament in all states, each from the one before. Throws
  /// std::invalid_argument as above, and std::runtime_error where solveRod finds no equilibrium,
  /// with the state.
  explicit PaperDynamic(const PaperDynamicParameters& parameters);

  /// The number of states: 101 for the 100 steps of loopTrajectory().
  int steps() const { return static_cast<int>(guides_.size()); }

  /// The assembly in state `step`: the same bytes whatever was asked for before, as each fiber is
  /// solved from the guide filament's shape. Throws std::invalid_argument if step is not in
  /// [0, steps()), and std::runtime_error where solveRod finds no equilibrium.
  FiberPolylines scene(int step) const;

 private:
  PaperDynamicParameters parameters_;
  std::vector<RodShape> guides_;  ///< by state
};

/// Case 3, half scalp: many fibers in layers that cross at small angles, none of them preferred.
///
/// The head is a spheroid about y of half axes 7.75, 9.5 and 7.75. Roots are uniform over the part
/// of it beside the parting (0.02 rad from the top, z, towards x) from y = -0.62 * 9.5 to 0.72
/// * 9.5, as far down as 325 / cm2 ask for; fewer than 50,000 fibers take a part of the same
/// middle. Fibers
///
///     leave the head at 0.3 rad from the skin,
///     downwards, turned back by 0.25 rad, or by 0 if they hang,
///     bent towards the head by 1 / 9.5 at the parting to 1 / 20 (to 0 if they hang) at the lower
///     end,
///     and pulled at the tip by 0.002 away from the head (along d1 of the root).
///
/// To the two angles a deviate is added, and the curvature is multiplied by 1 + a deviate. Where a
/// point would lie in the head, the angle to the skin grows by 0.05 rad until none does. A frame
/// sways the tip load by 0.003 sin(0.05 frame) along d2. Solved at 25 segments or more.
///
/// The paper does not tell length, style or order. By default each fiber lies anywhere in the
/// area: the order is random, and few fibers are near the one before. In wisps, fibers follow each
/// other wisp by wisp, each wisp on a patch of its own, the patches in rows. A wisp has a guide
/// hair, whose deviates of tip_deviation / length are added to those of each of its fibers.
///
/// Rods that are straight without load, as the paper's, are bent by a torque at the tip, which has
/// the deviates of the curvature. In frame 0 they are the same fibers, to rounding.
///
/// Touching pairs of 50,000 x 50; the paper has 550,000:
///
///     15 cm, no wisps                                  551,000
///     7 cm, wisps of 300                               545,000
///     5 cm, wisps of 300                               597,000
///     15 cm, wisps of 300, tip_deviation 0.2           588,000
///     15, 7 and 5 cm, wisps of 300, hanging            583,000, 488,000 and 547,000
///
/// Throws std::invalid_argument if fibers is above 50,000, wisp_fibers below 0, length not in
/// (0, 30], deviation not in [0, 1], or tip_deviation not in [0, length].
struct PaperHalfScalpParameters {
  int fibers = 50000;          ///< the paper's; at most
  int segments = 50;           ///< per fiber
  double length = 15;          ///< cm
  bool hanging = false;        ///< else combed back
  bool straight = false;       ///< whether hairs are straight without load; else curved
  int wisp_fibers = 0;         ///< 0: no wisps, each fiber lies by itself
  double deviation = 0.02;     ///< of the fibers' deviates
  double tip_deviation = 0.5;  ///< cm by which the tips of guide hairs deviate, about
  double radius = 0.0035;      ///< of a human hair, in cm
  std::uint64_t seed = 1;      ///< same seed, same scene
  int frame = 0;               ///< time step of the motion
};

/// The scene of these parameters.
FiberPolylines makePaperHalfScalp(const PaperHalfScalpParameters& parameters);

/// Case 4, strand: very many short segments, hardly longer than wide, of fibers that are almost
/// parallel.
///
/// Helices of 30 cm without load (reference curvature and torsion), which hang from roots with
/// their axis along -z, under their weight of 0.05 dyn / cm. Curvature and torsion are multiplied
/// by 1 + a deviate, and the root is turned about z by a deviate: a lock holds together. Roots are
/// 0.01 or more from each other, in an ellipse of the same area for any number of fibers: where
/// the paper's fibers are twice as many, its touching pairs are 3.5 times as many, which fits one
/// area (4 times) better than one density (2 times). A frame sways the tip by a force of 0.01
/// sin(0.05 frame) along x. Solved at 200 segments or more.
///
/// Rods that are straight without load, as the paper's, have no weight and are helices under a
/// torque along the axis at their tip. The first deviate is that of its size, the second tilts it.
///
/// Touching pairs of 500, 1,000 and 2,000 x 2,000; the paper has 23,000
/// and 80,000 for 1,000 and 2,000:
///
///     4 turns, radius 1, deviation 0.00024       3,300,  21,600,  80,700
///     2 turns, radius 0.5, deviation 0.0034      5,400,  21,700,  86,600
///
/// At one density, 325 / cm2, straight rods of 2 turns and radius 0.5 touch in 25,000 pairs if they
/// are 1,000, of deviation 0.3, and in 81,000 if they are 2,000, of deviation 0.2.
///
/// Segments are 0.015 long and 0.007 wide, so that those next but one do not touch. Throws
/// std::invalid_argument if area is not in (0, 1e6), fibers above 975 * area, turns or helix_radius
/// not above 0, 2 pi turns helix_radius not below 30, or deviation not in [0, 1].
struct PaperStrandParameters {
  int fibers = 1000;           ///< the paper: 500, 1,000 and 2,000
  int segments = 2000;         ///< per fiber
  double area = 2000 / 325.0;  ///< of the roots, cm2
  double turns = 4;            ///< of the helix
  double helix_radius = 1;     ///< cm
  bool turned = false;         ///< in the end, by pi/4 about y, then by pi/4 about x
  bool straight = false;       ///< whether rods are straight without load; else helices
  double deviation = 0.00024;  ///< of the deviates
  double radius = 0.0035;      ///< of a human hair, in cm
  std::uint64_t seed = 1;      ///< same seed, same scene
  int frame = 0;               ///< time step of the motion
};

/// The scene of these parameters.
FiberPolylines makePaperStrand(const PaperStrandParameters& parameters);

}  // namespace fcl_fibers::scenes
