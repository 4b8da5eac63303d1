// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace fcl_fibers::broadphase {

/// Throws std::runtime_error with the remedy if an object made by libfcl does not read back its
/// pose here. Then FCL's objects have another layout in this library than in libfcl, because it was
/// compiled for other instructions. The comparison in the public header does not find that, because
/// it knows only this library.
void requireLayoutOfFcl();

}  // namespace fcl_fibers::broadphase
