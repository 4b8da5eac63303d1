// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

#include "lock.h"

namespace fcl_fibers::python {

namespace py = pybind11;

/// Runs the handlers of signals during a query that has released the interpreter's lock, so that
/// Ctrl-C ends it. An exception that a handler raises stays set until rethrow().
class Signals {
 public:
  /// Returns whether a handler has raised an exception. The clock is read at every 64th call only,
  /// because it takes as long as finding some pairs.
  bool raised() {
    if (++calls_ % 64 != 0) return false;
    const Clock::time_point now = Clock::now();
    if (now < next_) return false;
    next_ = now + kInterval;
    const Locked lock;
    raised_ = PyErr_CheckSignals() != 0;
    return raised_;
  }

  /// Throws the exception, if there is one. The caller holds the interpreter's lock.
  void rethrow() const {
    if (raised_) throw py::error_already_set();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kInterval{50};

  std::size_t calls_ = 0;
  Clock::time_point next_ = Clock::now() + kInterval;
  bool raised_ = false;
};

constexpr char kHint[] =
    "the radius or the margin is probably too large (`python -m fcl_fibers info` tells the radius "
    "of a file at which contact begins); visit_pairs() hands over any number of pairs in blocks";

/// Memory has run out, most likely because a radius far too large makes everything touch. Python
/// raises it as MemoryError.
class TooMany : public std::bad_alloc {
 public:
  /// Takes no memory.
  explicit TooMany(std::size_t found) {
    std::snprintf(text_, sizeof text_, "memory has run out after %zu pairs were found; %s", found,
                  kHint);
  }
  const char* what() const noexcept override { return text_; }

 private:
  char text_[320];
};

/// Returns all that visit(visitor) finds, without the interpreter's lock.
/// @param expected  room for so many is made before, because a vector that grows takes new memory
///                  twice; what is left over is given back if it is much
/// @param limit     more raise ValueError
template <class Found, class Visit>
std::vector<Found> collect(std::size_t expected, std::size_t limit, Visit&& visit) {
  std::vector<Found> all;
  bool are_more = false;
  Signals signals;
  {
    const Unlocked unlocked;
    try {
      all.reserve(std::min(expected, limit));
    } catch (const std::bad_alloc&) {  // the query may find less
    }
    try {
      visit([&](const Found& found) {
        are_more = all.size() == limit;
        if (!are_more) all.push_back(found);
        return are_more || signals.raised();
      });
    } catch (const std::bad_alloc&) {
      throw TooMany(all.size());
    }
    if (are_more) std::vector<Found>().swap(all);
    if (all.capacity() > 2 * all.size()) all.shrink_to_fit();
  }
  signals.rethrow();
  if (are_more) {
    throw py::value_error("there are more pairs than the limit, " + std::to_string(limit) + "; " +
                          kHint);
  }
  return all;
}

/// Returns make(found) of each, without the interpreter's lock.
template <class Made, class Found, class Make>
std::vector<Made> makeEach(const std::vector<Found>& all, Make&& make) try {
  std::vector<Made> made;
  Signals signals;
  {
    const Unlocked unlocked;
    made.reserve(all.size());
    for (const Found& found : all) {
      made.push_back(make(found));
      if (signals.raised()) break;
    }
  }
  signals.rethrow();
  return made;
} catch (const std::bad_alloc&) {
  throw TooMany(all.size());
}

/// Who uses a tree. Only a thread that holds the interpreter's lock looks at it, so it needs none.
struct Users {
  int queries = 0;
  bool changes = false;
};

/// A query of a tree, which may run beside others.
class Query {
 public:
  explicit Query(Users& users) : users_(users) {
    if (users.changes) throw std::runtime_error("another thread builds or updates this tree");
    ++users_.queries;
  }
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;
  ~Query() { --users_.queries; }

 private:
  Users& users_;
};

/// A build or update of a tree, which has to be alone.
class Change {
 public:
  explicit Change(Users& users) : users_(users) {
    if (users.changes || users.queries > 0) {
      throw std::runtime_error(
          "a query, build or update of this tree is still running, in another thread or around "
          "this call");
    }
    users_.changes = true;
  }
  Change(const Change&) = delete;
  Change& operator=(const Change&) = delete;
  ~Change() { users_.changes = false; }

 private:
  Users& users_;
};

}  // namespace fcl_fibers::python
