// SPDX-License-Identifier: BSD-3-Clause
#include "support/allocation_faults.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> live{0}, live_bytes{0}, peak{0};
std::atomic<bool> armed{false}, has_struck{false}, forever{false};
std::atomic<std::size_t> next_number{0}, fatal_number{0};

bool fails() {
  if (!armed) return false;
  const std::size_t number = next_number++;
  if (number != fatal_number && !(forever && number > fatal_number)) return false;
  has_struck = true;
  return true;
}

void* counted(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  ++live;
  const std::size_t size = malloc_usable_size(memory);
  peak = std::max<std::size_t>(peak, live_bytes += size);
  return memory;
}

void release(void* memory) noexcept {
  if (memory == nullptr) return;
  --live;
  live_bytes -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

// A sanitizer has forms of its own of all that is not replaced here, whose memory is not counted.
void* operator new(std::size_t size) {
  if (fails()) throw std::bad_alloc();
  return counted(std::malloc(size > 0 ? size : 1));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return operator new(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (fails()) throw std::bad_alloc();
  const auto unit = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(unit, (size / unit + 1) * unit));
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new[](std::size_t size, const std::nothrow_t& tag) noexcept {
  return operator new(size, tag);
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return operator new(size, alignment);
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

namespace fcl_fibers::test {

AllocationFault::AllocationFault(std::size_t number, Lasts lasts) {
  next_number = 0;
  fatal_number = number;
  forever = lasts == Lasts::kForever;
  has_struck = false;
  armed = true;
}
AllocationFault::~AllocationFault() { armed = false; }
bool AllocationFault::struck() const { return has_struck; }

std::size_t liveAllocations() { return live; }
std::size_t liveBytes() { return live_bytes; }

PeakMemory::PeakMemory() : before_(live_bytes) { peak = before_; }
std::size_t PeakMemory::bytes() const { return peak - before_; }

}  // namespace fcl_fibers::test
