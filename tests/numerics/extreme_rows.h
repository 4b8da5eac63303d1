// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "support/assembly.h"
#include "support/float_environment.h"

namespace fcl_fibers::test {

/// A row of docs/numerics.md: fibers at one of the extremes.
template <typename S>
struct ExtremeRow {
  std::string name;  ///< of the test as well
  std::string what;
  Assembly<S> fibers;
  double margin = 0;
  FloatEnvironment environment = {};  ///< of the thread that asks, while it is answered

  /// Whether segments are rounded cones, of which FCL has no objects.
  bool isTapered() const { return fibers.radii_are == FiberArrays<S>::Radii::kPerPoint; }
};

/// The same rows for float and double, except for the numbers that S holds. They are made once.
template <typename S>
const std::vector<ExtremeRow<S>>& extremeRows();

extern template const std::vector<ExtremeRow<float>>& extremeRows<float>();
extern template const std::vector<ExtremeRow<double>>& extremeRows<double>();

/// How many of them there are as objects: the first ones, as those that taper are the last.
std::size_t rowsOfObjects();

/// docs/numerics/rows.csv, as it is now.
std::string rowsTable();

}  // namespace fcl_fibers::test
