// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "numerics/extreme_rows.h"

namespace fcl_fibers::test {

/// The rows of rounded cones, in which each point has a radius.
template <typename S>
std::vector<ExtremeRow<S>> taperedRows();

extern template std::vector<ExtremeRow<float>> taperedRows<float>();
extern template std::vector<ExtremeRow<double>> taperedRows<double>();

}  // namespace fcl_fibers::test
