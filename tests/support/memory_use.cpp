// SPDX-License-Identifier: BSD-3-Clause
#include "support/memory_use.h"

#include <malloc.h>
#include <pugixml.hpp>

#include <algorithm>
#include <cstdlib>
#include <new>

namespace {

std::size_t in_use = 0;
std::size_t peak = 0;

void* allocate(std::size_t size) {
  void* const memory = std::malloc(std::max<std::size_t>(size, 1));
  in_use += malloc_usable_size(memory);
  peak = std::max(peak, in_use);
  return memory;
}

void release(void* memory) {
  in_use -= malloc_usable_size(memory);
  std::free(memory);
}

// Before main, so that pugixml frees nothing that it allocated otherwise.
const bool pugixml_is_counted = [] {
  pugi::set_memory_management_functions(&allocate, &release);
  return true;
}();

}  // namespace

void* operator new(std::size_t size) {
  void* const memory = allocate(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }

namespace fcl_fibers::test {

PeakMemory::PeakMemory() : before_(in_use) { peak = in_use; }

std::size_t PeakMemory::bytes() const { return peak - before_; }

}  // namespace fcl_fibers::test
