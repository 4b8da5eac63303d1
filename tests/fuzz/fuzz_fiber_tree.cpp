// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>

#include <fcl_fibers/fiber_tree.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fcl_fibers::FiberTree tree;
  (void)data;
  (void)size;
  return 0;
}
