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

/// Has the calling thread flush subnormals to zero and take them for zero, until it goes out of
/// scope; where the machine can, as x86 does.
class ScopedFlushToZero {
 public:
#if defined(__SSE2__)
  static constexpr bool kIsPossible = true;
#else
  static constexpr bool kIsPossible = false;
#endif

  explicit ScopedFlushToZero(bool on);
  ~ScopedFlushToZero();
  ScopedFlushToZero(const ScopedFlushToZero&) = delete;
  ScopedFlushToZero& operator=(const ScopedFlushToZero&) = delete;

 private:
  unsigned before_ = 0;
};

}  // namespace fcl_fibers::test
