// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <thread>
#include <utility>

#include <pybind11/pybind11.h>

namespace fcl_fibers::python {

/// Calls take(), which takes the interpreter's lock. Once the interpreter ends, it ends any other
/// thread that takes the lock, and unwinds it, which would end the whole process at a destructor.
/// Such a thread has nothing to do any more but wait for the end of the process.
template <class Take>
auto takeLock(Take&& take) {
  try {
    return take();
  } catch (...) {  // The unwinding of pthread_exit() stops here; nothing else is thrown.
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
  }
}

/// What this thread has let go; null while it holds the interpreter's lock.
inline PyThreadState*& released() {
  thread_local PyThreadState* state = nullptr;
  return state;
}

/// Lets other threads of Python run while it lives, on a thread that holds the lock.
class Unlocked {
 public:
  Unlocked() { released() = PyEval_SaveThread(); }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;
  ~Unlocked() {
    takeLock([] { PyEval_RestoreThread(std::exchange(released(), nullptr)); });
  }
};

/// Holds the interpreter's lock while it lives, on the thread of an Unlocked, or on one that holds
/// it already. PyGILState_Ensure() would read a null pointer once the interpreter has ended, which
/// it does before the process.
class Locked {
 public:
  Locked() : was_released_(released() != nullptr) {
    if (!was_released_) return;
    takeLock([] { PyEval_RestoreThread(std::exchange(released(), nullptr)); });
  }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;
  ~Locked() {
    if (was_released_) released() = PyEval_SaveThread();
  }

 private:
  bool was_released_;
};

}  // namespace fcl_fibers::python
