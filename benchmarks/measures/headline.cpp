// SPDX-License-Identifier: BSD-3-Clause
#include "measures.h"

namespace fcl_fibers::benchmarks {

const Measures& measures() {
  static const Measures headline = {{"frames", measureFrames}};
  return headline;
}

}  // namespace fcl_fibers::benchmarks
