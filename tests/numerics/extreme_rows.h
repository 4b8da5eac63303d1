// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "support/assembly.h"

namespace fcl_fibers::test {

/// A row of docs/numerics.md: fibers at one of the extremes.
template <typename S>
struct ExtremeRow {
  std::string name;  ///< of the test as well
  std::string what;
  Assembly<S> fibers;
  double margin = 0;
  bool flush_to_zero = false;  ///< subnormals are flushed and taken for zero while it is answered
};

/// The same rows for float and double, except for the numbers that S holds.
template <typename S>
std::vector<ExtremeRow<S>> extremeRows();

extern template std::vector<ExtremeRow<float>> extremeRows<float>();
extern template std::vector<ExtremeRow<double>> extremeRows<double>();

/// The table of docs/numerics.md.
std::string rowsTable();

}  // namespace fcl_fibers::test
