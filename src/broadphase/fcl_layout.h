// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace fcl_fibers::broadphase {

/// Throws std::runtime_error, which says what to do, if FCL's objects have another layout in libfcl
/// than in this library: an object made by libfcl does not read back its pose here then. That is so
/// where this library was compiled for other instructions than FCL, and the header's comparison of
/// the two, which knows only this library, finds nothing.
void requireLayoutOfFcl();

}  // namespace fcl_fibers::broadphase
