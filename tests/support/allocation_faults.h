// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <new>
#include <string>

#include <gtest/gtest.h>

namespace fcl_fibers::test {

/// Memory that runs out. Linked into a program, this takes the place of `operator new` in it and in
/// the libraries that it loads.
///
/// While an object of this class lives, the allocation of this number fails, counted from 0 from
/// its construction on, over all threads; all later ones as well if it is to last.
class AllocationFault {
 public:
  enum class Lasts { kOnce, kForever };

  AllocationFault(std::size_t number, Lasts lasts);
  ~AllocationFault();
  AllocationFault(const AllocationFault&) = delete;
  AllocationFault& operator=(const AllocationFault&) = delete;

  /// Whether an allocation has failed.
  bool struck() const;
};

/// Allocations by `operator new` that have not been freed.
std::size_t liveAllocations();
/// The bytes of them, as malloc rounds them.
std::size_t liveBytes();

/// The most bytes that were allocated at a time since this was made, beyond those that were then;
/// of one thread.
class PeakMemory {
 public:
  PeakMemory();
  std::size_t bytes() const;

 private:
  std::size_t before_;
};

/// Whether act() allocates. It has to do without, as no allocation succeeds.
template <class Act>
bool allocates(Act&& act) {
  const AllocationFault fault(0, AllocationFault::Lasts::kForever);
  EXPECT_NO_THROW(act());
  return fault.struck();
}

/// Lets every allocation of act(subject) fail, one after the other, and with all that follow; then
/// there is memory again.
/// @param make   what to act upon
/// @param check  check(subject, failed), after act() and after doing again what failed
template <class Make, class Act, class Check>
void strikeEverywhere(const std::string& name, Make&& make, Act&& act, Check&& check) {
  using Lasts = AllocationFault::Lasts;
  for (const Lasts lasts : {Lasts::kOnce, Lasts::kForever}) {
    bool struck = true;
    for (std::size_t number = 0; struck && !testing::Test::HasFailure(); ++number) {
      SCOPED_TRACE(name + ", allocation " + std::to_string(number) +
                   (lasts == Lasts::kOnce ? " fails" : " and all that follow fail"));
      const std::size_t before = liveAllocations();
      {
        auto subject = make();
        bool failed = false;
        {
          const AllocationFault fault(number, lasts);
          try {
            act(subject);
          } catch (const std::bad_alloc&) {
            failed = true;
          }
          struck = fault.struck();
        }
        check(subject, failed);
        if (failed) {
          EXPECT_NO_THROW(act(subject)) << "there is memory again";
          check(subject, false);
        }
      }
      EXPECT_EQ(liveAllocations(), before) << "not freed";
    }
  }
}

}  // namespace fcl_fibers::test
