// SPDX-License-Identifier: BSD-3-Clause
#include "measures.h"

namespace fcl_fibers::benchmarks {

const Measures& measures() {
  static const Measures all = {
      {"arrays", measureArrays},
      {"cables", measureCables},
      {"card", measureCard},
      {"chain", measureChain},
      {"clients", measureClients},
      {"costs", measureCosts},
      {"dials", measureDials},
      {"frames", measureFrames},
      {"growth", measureGrowth},
      {"motion", measureMotion},
      {"motion-dials", measureMotionDials},
      {"narrow", measureNarrow},
      {"obstacles", measureObstacles},
      {"pictures", measurePictures},
      {"queries", measureQueries},
      {"radii", measureRadii},
      {"replay", measureReplay},
      {"rods", measureRods},
      {"sampling", measureSampling},
      {"shapes", measureShapes},
      {"volumes", measureVolumes},
      {"volume-tests", measureVolumeTests},
  };
  return all;
}

}  // namespace fcl_fibers::benchmarks
