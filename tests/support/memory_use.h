// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace fcl_fibers::test {

/// The most bytes that were allocated at a time since this was made, beyond those that were then,
/// by `new` and by pugixml. In programs that memory_use.cpp is linked to; one thread.
class PeakMemory {
 public:
  PeakMemory();
  std::size_t bytes() const;

 private:
  std::size_t before_;
};

}  // namespace fcl_fibers::test
