// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "judge/preflight.h"

/// @file
/// What preflightAll() lets one contender do, in a process of its own.
namespace fcl_fibers::benchmarks {

/// See MovingFibers::nextInFiber().
using NextInFiber = std::vector<std::uint32_t>;

inline bool areAdjacent(const NextInFiber& next, const CapsulePair& pair) {
  const auto [i, j] = pair;
  return i != j && (next[i] == j || next[j] == i);
}

inline std::size_t adjacentCount(const NextInFiber& next, const std::vector<CapsulePair>& pairs) {
  return static_cast<std::size_t>(std::count_if(
      pairs.begin(), pairs.end(), [&](const auto& pair) { return areAdjacent(next, pair); }));
}

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Written by the child, read by the parent once the child has ended.
struct Trace : Measured {
  bool finished = false;
  std::array<char, 400> refusal = {};
  std::atomic<double> deadline = kNever;  ///< when the parent ends the child

  /// Work that the deadline does not count.
  template <typename Work>
  void pauseDeadline(Work&& work) {
    const double left = deadline - tools::secondsNow();
    deadline = kNever;
    work();
    deadline = tools::secondsNow() + left;
  }
};

[[noreturn]] inline void failSystemCall(const char* name) {
  throw std::system_error(errno, std::generic_category(), name);
}

inline std::size_t allocatedBytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// Collects what a query reports and judges it, in blocks: some report hundreds of millions of
/// pairs, and the exact tests take longer than some managers, so they are kept out of the query's
/// time.
template <typename S>
class Checker {
 public:
  Checker(const BasicMovingFibers<S>& fibers, Trace& trace)
      : fibers_(fibers),
        trace_(trace),
        capsules_(fibers.capsules()),
        next_(fibers.nextInFiber()),
        rounding_(fibers.rounding()) {
    block_.reserve(kBlock);
  }

  static bool callback(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data) {
    static_cast<Checker*>(data)->add(a, b);
    return false;
  }

  double secondsJudging() const { return seconds_judging_; }

  /// Once, when the query has ended.
  /// @param due  pairs that touch, in order
  PairCounts finish(const std::vector<CapsulePair>& due) {
    judgeBlock();
    const std::size_t reported_touching = touching_.size();
    std::sort(touching_.begin(), touching_.end());
    touching_.erase(std::unique(touching_.begin(), touching_.end()), touching_.end());
    counts_.touching = touching_.size();
    counts_.repeated = reported_touching - touching_.size();
    counts_.adjacent = adjacentCount(next_, touching_);
    counts_.checked = true;
    std::vector<CapsulePair> missed;
    std::set_difference(due.begin(), due.end(), touching_.begin(), touching_.end(),
                        std::back_inserter(missed));
    if (!missed.empty()) trace_.missed = missed.front();
    return counts_;
  }

 private:
  static constexpr std::size_t kBlock = 1 << 20;
  static constexpr std::uint32_t kForeign = std::numeric_limits<std::uint32_t>::max();

  /// Its number, or that of none.
  std::uint32_t numberOf(const fcl::CollisionObject<S>* object) const {
    if (object == nullptr) return kForeign;
    const std::size_t number = BasicMovingFibers<S>::index(object);
    const auto& objects = fibers_.objects();
    if (number >= objects.size() || objects[number] != object) return kForeign;
    return static_cast<std::uint32_t>(number);
  }

  void add(const fcl::CollisionObject<S>* a, const fcl::CollisionObject<S>* b) {
    const std::uint32_t i = numberOf(a), j = numberOf(b);
    if (i == kForeign || j == kForeign) {
      ++counts_.foreign;
      return;
    }
    block_.emplace_back(std::min(i, j), std::max(i, j));
    if (block_.size() == kBlock) {
      trace_.pauseDeadline([&] { seconds_judging_ += seconds([&] { judgeBlock(); }); });
    }
  }

  void judgeBlock() {
    for (const CapsulePair& pair : block_) judge(pair);
    counts_.reported += block_.size();
    block_.clear();
  }

  void judge(const CapsulePair& pair) {
    const auto [i, j] = pair;
    if (i == j) {
      ++counts_.with_itself;
      return;
    }
    const Contact kind = contact(capsules_[i], capsules_[j], rounding_);
    if (kind == Contact::kTouching) touching_.push_back(pair);
    if (kind == Contact::kApart) ++counts_.apart;
    if (kind == Contact::kBoundary) ++counts_.undecided;
  }

  const BasicMovingFibers<S>& fibers_;
  Trace& trace_;
  std::vector<Capsule> capsules_;
  NextInFiber next_;
  double rounding_;
  std::vector<CapsulePair> block_;
  std::vector<CapsulePair> touching_;
  PairCounts counts_;
  double seconds_judging_ = 0;
};

/// Pairs that touch in each frame, in order.
struct Truth {
  std::array<std::vector<CapsulePair>, MovingFibers::kFrames> pairs;
  std::array<std::size_t, MovingFibers::kFrames> adjacent = {};
};

/// One contender's run, in the child.
template <typename S>
struct Run {
  const BasicContender<S>& contender;
  BasicMovingFibers<S>& fibers;
  const PreflightLimits& limits;
  const Truth& truth;
  Trace& trace;

  void run() {
    contender.bringTo(fibers, 0);
    const std::size_t bytes_before = allocatedBytes();
    std::unique_ptr<BasicManager<S>> manager;
    time(Phase::kSetUp, [&] { manager = contender.setUp(fibers); });
    trace.bytes = bytesOf(*manager, bytes_before);

    if (limits.check || !limits.update) query(*manager, 0, 0);
    if (const auto* ours = dynamic_cast<const FiberCollisionManager<S>*>(manager.get())) {
      trace.bytes_stated = ours->memoryUsage();
    }
    if (limits.update) {
      moveTo(1, *manager);
      query(*manager, 1, 1);
      // All but FCL's are timed back and forth; an update may end one way and not the other.
      if (limits.check && !contender.is_renewed) moveTo(0, *manager);
      if (limits.again && !contender.is_renewed) {
        query(*manager, 0, 2);
        moveTo(1, *manager);
        query(*manager, 1, 3);
      }
    }
    trace.bytes_after_frames = bytesOf(*manager, bytes_before);
    trace.finished = true;
  }

  /// Notes the seconds that the work takes.
  template <typename Work>
  void time(Phase phase, Work&& work) {
    trace.phase = phase;
    trace.deadline = tools::secondsNow() + limits.phase_seconds;
    trace.seconds[static_cast<std::size_t>(phase)] = seconds(work);
    trace.deadline = kNever;
  }

  static std::size_t bytesOf(const BasicManager<S>& manager, std::size_t bytes_before) {
    const std::size_t allocated = allocatedBytes() - bytes_before;
    const auto* foreign = dynamic_cast<const ForeignManager*>(&manager);
    return foreign == nullptr ? allocated : foreign->libraryBytes(allocated);
  }

  void moveTo(int frame, BasicManager<S>& manager) {
    contender.setPoses(fibers, frame);
    time(Phase::kUpdate, [&] { update(contender, fibers, manager); });
  }

  void query(const BasicManager<S>& manager, std::size_t frame, std::size_t number) {
    PairCounts& counts = trace.frames[number];
    if (!limits.check) {
      time(Phase::kDetection, [&] { counts.reported = countPairs(manager).pairs; });
      return;
    }
    Checker<S> checker(fibers, trace);
    time(Phase::kDetection, [&] { manager.collide(&checker, Checker<S>::callback); });
    trace.seconds[static_cast<std::size_t>(Phase::kDetection)] -= checker.secondsJudging();
    counts = checker.finish(truth.pairs[frame]);
  }
};

template <typename S>
[[noreturn]] void runChild(Run<S> run) {
  // A manager that goes astray is to leave no core file, no abort message in the output, and the
  // rest of the machine its memory.
  const rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const auto memory =
      static_cast<rlim_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
  const rlimit address_space = {memory, memory};
  setrlimit(RLIMIT_AS, &address_space);
  const int nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDOUT_FILENO);
  if (!run.limits.show_errors) dup2(nowhere, STDERR_FILENO);
  const auto refuse = [&](const char* text) {
    std::strncpy(run.trace.refusal.data(), text, run.trace.refusal.size() - 1);
  };

  try {
    run.run();
    _exit(0);
  } catch (const std::bad_alloc&) {
    refuse("out of memory");
  } catch (const std::exception& error) {
    refuse(*error.what() == '\0' ? "an exception without a text" : error.what());
  } catch (...) {
    refuse("an exception that is no std::exception");
  }
  _exit(1);
}

/// One contender's run in a process of its own, which starts at once.
class Child {
 public:
  template <typename S>
  Child(const BasicContender<S>& contender, BasicMovingFibers<S>& fibers,
        const PreflightLimits& limits, const Truth& truth)
      : limits_(limits) {
    void* const shared =
        mmap(nullptr, sizeof(Trace), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) failSystemCall("mmap");
    trace_.reset(new (shared) Trace{});
    std::fflush(nullptr);  // or the child writes it once more, if it ends by exit()
    pid_ = fork();
    if (pid_ < 0) failSystemCall("fork");
    if (pid_ == 0) runChild(Run<S>{contender, fibers, limits, truth, *trace_});
  }

  /// Whether it has ended. Ends it if it is too late, whatever it does with signals.
  bool hasEnded() {
    if (ended_) return true;
    if (tools::secondsNow() > trace_->deadline) {
      kill(pid_, SIGKILL);
      is_too_slow_ = true;
    }
    const pid_t ended = waitpid(pid_, &status_, is_too_slow_ ? 0 : WNOHANG);
    if (ended < 0) failSystemCall("waitpid");
    ended_ = ended > 0;
    return ended_;
  }

  /// How it ended, once it has.
  Preflight result() const {
    Preflight result;
    static_cast<Measured&>(result) = *trace_;
    if (is_too_slow_) {
      result.verdict = Preflight::Verdict::kTooSlow;
      std::ostringstream note;
      note << '>' << limits_.phase_seconds << " s";
      result.note = note.str();
    } else if (trace_->refusal[0] != '\0') {
      result.verdict = Preflight::Verdict::kRefused;
      result.note = "refused";
      result.detail = trace_->refusal.data();
    } else if (!trace_->finished) {
      result.verdict = Preflight::Verdict::kCrashed;
      result.note = "crashed";
      result.detail = WIFSIGNALED(status_)
                          ? strsignal(WTERMSIG(status_))
                          : "it ended the process with " + std::to_string(WEXITSTATUS(status_));
    }
    std::replace(result.detail.begin(), result.detail.end(), '\n', ' ');
    return result;
  }

 private:
  struct Unmap {
    void operator()(Trace* trace) const { munmap(trace, sizeof(Trace)); }
  };

  PreflightLimits limits_;
  std::unique_ptr<Trace, Unmap> trace_;
  pid_t pid_;
  int status_ = 0;
  bool ended_ = false;
  bool is_too_slow_ = false;
};

}  // namespace fcl_fibers::benchmarks
