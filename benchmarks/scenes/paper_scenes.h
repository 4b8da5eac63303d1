// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include <fcl_fibers/fiber_polylines.h>

#include "scenes/load_trajectory.h"

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
  double radius = 0.0035;  ///< of a human hair, in cm
  std::uint64_t seed = 1;  ///< same seed, same scenes
};

/// The assembly of case 1, not turned, whose loads replay a trajectory of a guide filament. Any
/// number of threads may ask for scenes at once.
class PaperDynamic {
 public:
  /// Solves the guide filament in all states, each from the one before. Throws
  /// std::invalid_argument as above, or if there are no states, and std::runtime_error where
  /// solveRod finds no equilibrium.
  explicit PaperDynamic(const PaperDynamicParameters& parameters,
                        LoadTrajectory trajectory = loopTrajectory());
  ~PaperDynamic();

  /// What was moved from may be destroyed or assigned to, and nothing else.
  ///@{
  PaperDynamic(PaperDynamic&&) noexcept;
  PaperDynamic& operator=(PaperDynamic&&) noexcept;
  ///@}

  /// The number of states: 101 for 100 steps of deformation.
  int steps() const;

  /// The assembly in state `step`: the same bytes whatever was asked for before, as each fiber is
  /// solved from the guide filament's shape. Throws std::invalid_argument if step is not in
  /// [0, steps()), and std::runtime_error where solveRod finds no equilibrium.
  FiberPolylines scene(int step) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Case 3, half scalp: many fibers in layers that cross at small angles, none of them preferred.
///
/// The head is a spheroid about y of half axes 7.75, 9.5 and 7.75. Roots are uniform over the part
/// of it beside the parting (0.02 rad from the top, z, towards x) from y = -0.62 * 9.5 to 0.72
/// * 9.5, as far down as 325 / cm2 ask for; fewer than 50,000 fibers take a part of the same
/// middle. Fibers are 15 cm long and
///
///     leave the head at 0.3 rad + a deviate of 0.02 from the skin,
///     downwards, turned back by 0.25 rad + a deviate of 0.02,
///     bent towards the head by 1 / 9.5 at the parting to 1 / 20 at the lower end, times 1 + a
///     deviate of 0.02,
///     and pulled at the tip by 0.002 away from the head (along d1 of the root).
///
/// Where a point would lie in the head, the angle to the skin grows by 0.05 rad until none does. A
/// frame sways the tip load by 0.003 sin(0.05 frame) along d2. Solved at 25 segments or more.
///
/// 50,000 x 50: 551,000 touching pairs; the paper's 550,000. Throws std::invalid_argument if fibers
/// is above 50,000.
struct PaperHalfScalpParameters {
  int fibers = 50000;      ///< the paper's; at most
  int segments = 50;       ///< per fiber
  double radius = 0.0035;  ///< of a human hair, in cm
  std::uint64_t seed = 1;  ///< same seed, same scene
  int frame = 0;           ///< time step of the motion
};

/// The scene of these parameters.
FiberPolylines makePaperHalfScalp(const PaperHalfScalpParameters& parameters);

/// Case 4, strand: very many short segments, hardly longer than wide, of fibers that are almost
/// parallel.
///
/// Helices of 30 cm, 4 turns and radius 1 without load (reference curvature and torsion), which
/// hang from roots with their axis along -z, under their weight of 0.05 dyn / cm. Curvature and
/// torsion are multiplied by 1 + a deviate of 0.00024, and the root is turned about z by a deviate
/// of 0.00024 rad: a lock holds together. Roots are 0.01 or more from each other, in an ellipse of
/// 2000 / 325 cm2 for any number of fibers. A frame sways the tip by a force of 0.01 sin(0.05
/// frame) along x. Solved at 200 segments or more.
///
/// x 2,000 segments: 500 fibers 3,300, 1,000 fibers 21,600, 2,000 fibers 80,700 touching pairs; the
/// paper has 23,000 and 80,000 for the latter two. Segments are 0.015 long and 0.007 wide, so that
/// those next but one do not touch. Throws std::invalid_argument if fibers is above 6,000.
struct PaperStrandParameters {
  int fibers = 1000;       ///< the paper: 500, 1,000 and 2,000
  int segments = 2000;     ///< per fiber
  double radius = 0.0035;  ///< of a human hair, in cm
  std::uint64_t seed = 1;  ///< same seed, same scene
  int frame = 0;           ///< time step of the motion
};

/// The scene of these parameters.
FiberPolylines makePaperStrand(const PaperStrandParameters& parameters);

}  // namespace fcl_fibers::scenes
