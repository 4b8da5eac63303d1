// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace fcl_fibers::python {

/// From now on the errors of the library reach the programs of this module in Python's words.
void translateErrors();

}  // namespace fcl_fibers::python
