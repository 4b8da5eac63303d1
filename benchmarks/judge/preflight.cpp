// SPDX-License-Identifier: BSD-3-Clause
#include "judge/preflight.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <exception>
#include <iterator>
#include <memory>
#include <new>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcl_fibers/fiber_collision_manager.h>

#include "harness/progress.h"

namespace fcl_fibers::benchmarks {
namespace {

/// See MovingFibers::nextInFiber().
using NextInFiber = std::vector<std::uint32_t>;

bool areAdjacent(const NextInFiber& next, const CapsulePair& pair) {
  const auto [i, j] = pair;
  return i != j && (next[i] == j || next[j] == i);
}

std::size_t adjacentCount(const NextInFiber& next, const std::vector<CapsulePair>& pairs) {
  return static_cast<std::size_t>(std::count_if(
      pairs.begin(), pairs.end(), [&](const auto& pair) { return areAdjacent(next, pair); }));
}

/// Written by the child, read by the parent once the child has ended.
struct Trace : Measured {
  bool finished = false;
  std::array<char, 400> refusal = {};
};

[[noreturn]] void failSystemCall(const char* name) {
  throw std::system_error(errno, std::generic_category(), name);
}

/// SIGALRM kills this process after so many seconds, unless called again; 0 calls it off.
void setAlarm(double seconds) {
  itimerval timer = {};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - std::floor(seconds)));
  setitimer(ITIMER_REAL, &timer, nullptr);
}

/// Work that the alarm does not count.
template <typename Work>
void pauseAlarm(Work&& work) {
  const itimerval off = {};
  itimerval left;
  setitimer(ITIMER_REAL, &off, &left);
  work();
  setitimer(ITIMER_REAL, &left, nullptr);
}

std::size_t allocatedBytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// Collects what a query reports and judges it, in blocks: some report hundreds of millions of
/// pairs, and the exact tests take longer than some managers, so they are kept out of the query's
/// time.
template <typename S>
class Checker {
 public:
  explicit Checker(const BasicMovingFibers<S>& fibers)
      : capsules_(fibers.capsules()), next_(fibers.nextInFiber()), rounding_(fibers.rounding()) {
    block_.reserve(kBlock);
  }

  static bool callback(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data) {
    const auto index = [](const auto* object) {
      return static_cast<std::uint32_t>(BasicMovingFibers<S>::index(object));
    };
    static_cast<Checker*>(data)->add(index(a), index(b));
    return false;
  }

  double secondsJudging() const { return seconds_judging_; }

  /// Once, when the query has ended.
  PairCounts finish() {
    judgeBlock();
    const std::size_t reported_touching = touching_.size();
    std::sort(touching_.begin(), touching_.end());
    touching_.erase(std::unique(touching_.begin(), touching_.end()), touching_.end());
    counts_.touching = touching_.size();
    counts_.repeated = reported_touching - touching_.size();
    counts_.adjacent = adjacentCount(next_, touching_);
    counts_.checked = true;
    return counts_;
  }

 private:
  static constexpr std::size_t kBlock = 1 << 20;

  void add(std::uint32_t i, std::uint32_t j) {
    block_.emplace_back(std::min(i, j), std::max(i, j));
    if (block_.size() == kBlock) {
      pauseAlarm([&] { seconds_judging_ += seconds([&] { judgeBlock(); }); });
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

  std::vector<Capsule> capsules_;
  NextInFiber next_;
  double rounding_;
  std::vector<CapsulePair> block_;
  std::vector<CapsulePair> touching_;
  PairCounts counts_;
  double seconds_judging_ = 0;
};

/// One contender's run, in the child.
template <typename S>
struct Run {
  const BasicContender<S>& contender;
  BasicMovingFibers<S>& fibers;
  const PreflightLimits& limits;
  Trace& trace;

  void run() {
    fibers.bringTo(0, contender.boxes);
    const std::size_t bytes_before = allocatedBytes();
    std::unique_ptr<BasicManager<S>> manager;
    time(Phase::kSetUp, [&] { manager = contender.setUp(fibers); });
    trace.bytes = bytesOf(*manager, bytes_before);

    if (limits.check || !limits.update) query(*manager, trace.frames[0]);
    if (const auto* ours = dynamic_cast<const FiberCollisionManager<S>*>(manager.get())) {
      trace.bytes_stated = ours->memoryUsage();
    }
    if (limits.update) {
      moveTo(1, *manager);
      query(*manager, trace.frames[1]);
      // All but FCL's are timed back and forth; an update may end one way and not the other.
      if (limits.check && contender.boxes == Boxes::kNone) moveTo(0, *manager);
    }
    trace.bytes_after_frames = bytesOf(*manager, bytes_before);
    trace.finished = true;
  }

  /// Notes the seconds that the work takes.
  template <typename Work>
  void time(Phase phase, Work&& work) {
    trace.phase = phase;
    setAlarm(limits.phase_seconds);
    trace.seconds[static_cast<std::size_t>(phase)] = seconds(work);
    setAlarm(0);
  }

  static std::size_t bytesOf(const BasicManager<S>& manager, std::size_t bytes_before) {
    const std::size_t allocated = allocatedBytes() - bytes_before;
    const auto* foreign = dynamic_cast<const ForeignManager*>(&manager);
    return foreign == nullptr ? allocated : foreign->libraryBytes(allocated);
  }

  void moveTo(int frame, BasicManager<S>& manager) {
    fibers.setPoses(frame);
    time(Phase::kUpdate, [&] { update(contender, fibers, manager); });
  }

  void query(const BasicManager<S>& manager, PairCounts& counts) {
    if (!limits.check) {
      time(Phase::kDetection, [&] { counts.reported = countPairs(manager).pairs; });
      return;
    }
    Checker<S> checker(fibers);
    time(Phase::kDetection, [&] { manager.collide(&checker, Checker<S>::callback); });
    trace.seconds[static_cast<std::size_t>(Phase::kDetection)] -= checker.secondsJudging();
    counts = checker.finish();
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
  dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);

  try {
    run.run();
    _exit(0);
  } catch (const std::bad_alloc&) {
    std::strncpy(run.trace.refusal.data(), "out of memory", run.trace.refusal.size() - 1);
  } catch (const std::exception& error) {
    std::strncpy(run.trace.refusal.data(), error.what(), run.trace.refusal.size() - 1);
  }
  _exit(1);
}

/// One contender's run in a process of its own, which starts at once.
class Child {
 public:
  template <typename S>
  Child(const BasicContender<S>& contender, BasicMovingFibers<S>& fibers,
        const PreflightLimits& limits)
      : limits_(limits) {
    void* const shared =
        mmap(nullptr, sizeof(Trace), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) failSystemCall("mmap");
    trace_.reset(new (shared) Trace{});
    pid_ = fork();
    if (pid_ < 0) failSystemCall("fork");
    if (pid_ == 0) runChild(Run<S>{contender, fibers, limits, *trace_});
  }

  /// How it ended.
  Preflight wait() const {
    int status = 0;
    if (waitpid(pid_, &status, 0) < 0) failSystemCall("waitpid");

    Preflight result;
    static_cast<Measured&>(result) = *trace_;
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
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
    }
    return result;
  }

 private:
  struct Unmap {
    void operator()(Trace* trace) const { munmap(trace, sizeof(Trace)); }
  };

  PreflightLimits limits_;
  std::unique_ptr<Trace, Unmap> trace_;
  pid_t pid_;
};

void judgeWrong(Preflight& result, std::size_t frame, std::size_t count, const std::string& what) {
  result.verdict = Preflight::Verdict::kWrong;
  result.phase = Phase::kDetection;
  result.note = "wrong: " + std::to_string(count) + what + (frame == 0 ? "" : " after update");
}

/// What is wrong whatever the others report.
template <typename S>
void judgeAlone(const BasicContender<S>& contender, Preflight& result) {
  for (std::size_t f = 0; f < result.frames.size(); ++f) {
    const PairCounts& counts = result.frames[f];
    const std::pair<std::size_t, const char*> faults[] = {
        {counts.repeated, " reported again"},
        {counts.with_itself, " with themselves"},
        {contender.leaves_out_adjacent ? counts.adjacent : 0, " adjacent"},
        {contender.reported == Reported::kTouching ? counts.apart : 0, " not touching"}};
    for (const auto& [count, what] : faults) {
      if (count > 0) return judgeWrong(result, f, count, what);
    }
  }
}

/// Pairs that touch in each frame.
struct Truth {
  std::array<std::size_t, MovingFibers::kFrames> touching = {}, adjacent = {};
};

template <typename S>
Truth truthOf(BasicMovingFibers<S>& fibers, const PreflightLimits& limits) {
  Truth truth;
  const NextInFiber next = fibers.nextInFiber();
  for (int frame = 0; frame < (limits.update ? MovingFibers::kFrames : 1); ++frame) {
    fibers.setPoses(frame);
    const auto pairs = touchingPairs(fibers.capsules(), fibers.rounding());
    truth.touching[static_cast<std::size_t>(frame)] = pairs.size();
    truth.adjacent[static_cast<std::size_t>(frame)] = adjacentCount(next, pairs);
  }
  return truth;
}

void judgeMissed(Preflight& result, const Truth& truth, bool without_adjacent) {
  for (std::size_t f = 0; f < result.frames.size(); ++f) {
    const PairCounts& counts = result.frames[f];
    const std::size_t found = counts.touching - (without_adjacent ? counts.adjacent : 0);
    const std::size_t due = truth.touching[f] - (without_adjacent ? truth.adjacent[f] : 0);
    if (counts.checked && found < due) return judgeWrong(result, f, due - found, " missed");
  }
}

/// Bounds may be rounded outward, so ours may report a few more pairs, and none less.
constexpr double kRoundingExcess = 0.01;

/// Each of ours against FCL's manager of its group, if there is one, or else against the fewest
/// pairs. What some leave out counts for none.
template <typename S>
void judgeWork(const std::vector<BasicContender<S>>& contenders, std::vector<Preflight>& results,
               bool without_adjacent) {
  const auto reported = [&](std::size_t i, std::size_t frame) {
    const PairCounts& counts = results[i].frames[frame];
    return counts.reported - (without_adjacent ? counts.adjacent : 0);
  };
  for (const Reported group : {Reported::kTightBoxes, Reported::kSpheres}) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (contenders[i].reported == group && results[i].right()) members.push_back(i);
    }
    if (members.empty()) continue;
    const auto rank = [&](std::size_t i) {
      return std::make_pair(contenders[i].boxes != Boxes::kTight, reported(i, 0));
    };
    const std::size_t reference =
        *std::min_element(members.begin(), members.end(),
                          [&](std::size_t i, std::size_t j) { return rank(i) < rank(j); });
    for (const std::size_t i : members) {
      if (!contenders[i].ours) continue;
      for (std::size_t f = 0; f < results[i].frames.size(); ++f) {
        const std::size_t due = reported(reference, f);
        const bool more =
            static_cast<double>(reported(i, f)) > (1 + kRoundingExcess) * static_cast<double>(due);
        if (reported(i, f) < due || more) {
          judgeWrong(results[i], f, reported(i, f), " pairs instead of " + std::to_string(due));
        }
      }
    }
  }
}

}  // namespace

std::string Preflight::whyNotTimed() const {
  std::string why = note;
  if (!why.empty()) why += std::string(" in ") + phaseName(phase);
  if (!detail.empty()) why += ": " + detail;
  return why;
}

template <typename S>
std::vector<Preflight> preflightAll(const std::vector<BasicContender<S>>& contenders,
                                    BasicMovingFibers<S>& fibers, const PreflightLimits& limits) {
  const bool without_adjacent =
      std::any_of(contenders.begin(), contenders.end(),
                  [](const auto& contender) { return contender.leaves_out_adjacent; });
  Truth truth;
  if (limits.check) {
    showProgress(fibers.name() + ": find what touches");
    truth = truthOf(fibers, limits);
  }
  std::vector<Preflight> results;
  std::deque<Child> running;
  for (std::size_t started = 0; results.size() < contenders.size();) {
    if (started < contenders.size() && running.size() < limits.at_once) {
      const auto& contender = contenders[started];
      showProgress(fibers.name() + (limits.check ? ": check " : ": try ") +
                   std::to_string(++started) + "/" + std::to_string(contenders.size()) + ": " +
                   contender.title());
      running.emplace_back(contender, fibers, limits);
      continue;
    }
    Preflight result = running.front().wait();
    running.pop_front();
    judgeAlone(contenders[results.size()], result);
    if (result.verdict != Preflight::Verdict::kWrong) judgeMissed(result, truth, without_adjacent);
    results.push_back(result);
  }
  judgeWork(contenders, results, without_adjacent);
  endProgress();
  return results;
}

template <typename S>
bool oursAreRight(const std::vector<BasicContender<S>>& contenders,
                  const std::vector<Preflight>& preflights) {
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const bool slow = preflights[i].verdict == Preflight::Verdict::kTooSlow;
    if (contenders[i].ours && !preflights[i].right() && !slow) return false;
  }
  return true;
}

template std::vector<Preflight> preflightAll(const std::vector<BasicContender<float>>&,
                                             BasicMovingFibers<float>&, const PreflightLimits&);
template std::vector<Preflight> preflightAll(const std::vector<BasicContender<double>>&,
                                             BasicMovingFibers<double>&, const PreflightLimits&);
template bool oursAreRight(const std::vector<BasicContender<float>>&,
                           const std::vector<Preflight>&);
template bool oursAreRight(const std::vector<BasicContender<double>>&,
                           const std::vector<Preflight>&);

}  // namespace fcl_fibers::benchmarks
