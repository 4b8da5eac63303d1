// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <thread>

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

/// Lets other threads of Python run while it lives.
class Unlocked {
 public:
  Unlocked() : state_(PyEval_SaveThread()) {}
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;
  ~Unlocked() {
    takeLock([this] { PyEval_RestoreThread(state_); });
  }

 private:
  PyThreadState* state_;
};

/// Holds the interpreter's lock while it lives, on a thread that has let it go.
class Locked {
 public:
  Locked() : state_(takeLock([] { return PyGILState_Ensure(); })) {}
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;
  ~Locked() { PyGILState_Release(state_); }

 private:
  PyGILState_STATE state_;
};

}  // namespace fcl_fibers::python
