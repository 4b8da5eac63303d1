// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::scenes {

/// The scene `neuron`, much as a pyramidal cell: lengths in micrometres.
struct NeuronParameters {
  int fibers = 6;          ///< basal dendrites that leave the soma
  int segments = 8;        ///< of a fiber between two branching points, each of 4.5
  double radius = 1;       ///< of a basal dendrite where it begins
  std::uint64_t seed = 1;  ///< same seed, same scene
  int frame = 0;           ///< time step of the motion
};

/// A neuron with its soma in the origin: fibers that start at points of others, with radii at
/// points. Fiber 0 is the soma, which is 5 radii thick. The axon, of 0.35 radii, leaves it
/// downwards in z, and the apical dendrite, of 2 radii, upwards; both are three times as long as
/// others before they branch. The basal dendrites leave it to all sides.
///
/// A fiber wanders and becomes thinner by a tenth. At its end two begin, whose radii to the power
/// of 3/2 have the sum of its own (Rall, Branching dendritic trees and motoneuron membrane
/// resistivity, 1959), and of which the thicker turns less; up to six times, and while they are
/// thicker than a twentieth of the radius. Those that do not branch become half as thick. A frame
/// turns each point about z by 1e-4 rad for each micrometre from the soma.
///
/// Platforms differ by the rounding of their sin, cos and log. Throws std::invalid_argument if
/// fibers or segments is below 1, or radius not finite or negative.
FiberPolylines makeNeuron(const NeuronParameters& parameters);

}  // namespace fcl_fibers::scenes
