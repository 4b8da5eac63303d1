// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

namespace fcl_fibers::python {

/// Adds the class Tree.
void addTree(pybind11::module_& module);

}  // namespace fcl_fibers::python
