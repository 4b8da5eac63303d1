// SPDX-License-Identifier: BSD-3-Clause
#include "judge/preflight.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
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
#include <string>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

#include <fcl_fibers/fiber_collision_manager.h>

#include "tools/messages.h"

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

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Seconds of a clock that all processes share.
double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Written by the child, read by the parent once the child has ended.
struct Trace : Measured {
  bool finished = false;
  std::array<char, 400> refusal = {};
  std::atomic<double> deadline = kNever;  ///< when the parent ends the child

  /// Work that the deadline does not count.
  template <typename Work>
  void pauseDeadline(Work&& work) {
    const double left = deadline - now();
    deadline = kNever;
    work();
    deadline = now() + left;
  }
};

[[noreturn]] void failSystemCall(const char* name) {
  throw std::system_error(errno, std::generic_category(), name);
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

template <typename S>
Truth truthOf(BasicMovingFibers<S>& fibers, const PreflightLimits& limits) {
  Truth truth;
  const NextInFiber next = fibers.nextInFiber();
  for (std::size_t frame = 0; frame < (limits.update ? truth.pairs.size() : 1); ++frame) {
    fibers.setPoses(static_cast<int>(frame));
    const std::vector<Capsule> capsules = fibers.capsules();
    truth.pairs[frame] = touchingPairs(capsules, fibers.rounding());
    truth.adjacent[frame] = adjacentCount(next, truth.pairs[frame]);
    if constexpr (std::is_same_v<S, float>) {
      // A manager that misses all of these would pass.
      const std::size_t open =
          touchingPairs(capsules, fibers.rounding(), Contact::kBoundary).size();
      if (open <= truth.pairs[frame].size()) continue;
      throw std::invalid_argument(
          "'" + fibers.name() + "': rounding of float decides " + std::to_string(open) +
          " pairs, and " + std::to_string(truth.pairs[frame].size()) +
          " touch for certain; take double, or a scene nearer to the origin");
    }
  }
  return truth;
}

/// One contender's run, in the child.
template <typename S>
struct Run {
  const BasicContender<S>& contender;
  BasicMovingFibers<S>& fibers;
  const PreflightLimits& limits;
  const Truth& truth;
  Trace& trace;

  void run() {
    fibers.bringTo(0, contender.boxes);
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
    trace.deadline = now() + limits.phase_seconds;
    trace.seconds[static_cast<std::size_t>(phase)] = seconds(work);
    trace.deadline = kNever;
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
    if (now() > trace_->deadline) {
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

void judgeWrong(Preflight& result, std::size_t frame, std::size_t count, const std::string& what) {
  result.verdict = Preflight::Verdict::kWrong;
  result.phase = Phase::kDetection;
  result.note = "wrong: " + std::to_string(count) + what;
  constexpr std::array kWhen = {"", " after update", " after two updates", " after three updates"};
  result.when = kWhen.at(frame);
}

/// What is wrong whatever the others report.
template <typename S>
void judgeAlone(const BasicContender<S>& contender, Preflight& result) {
  for (std::size_t f = 0; f < result.frames.size(); ++f) {
    const PairCounts& counts = result.frames[f];
    const std::pair<std::size_t, const char*> faults[] = {
        {counts.repeated, " reported again"},
        {counts.with_itself, " with themselves"},
        {counts.foreign, " of objects that it was not given, or whose user data it has changed"},
        {contender.leaves_out_adjacent ? counts.adjacent : 0, " adjacent"},
        {contender.reported == Reported::kTouching ? counts.apart : 0, " not touching"}};
    for (const auto& [count, what] : faults) {
      if (count > 0) return judgeWrong(result, f, count, what);
    }
  }
}

void judgeMissed(Preflight& result, const Truth& truth, bool without_adjacent) {
  for (std::size_t f = 0; f < result.frames.size(); ++f) {
    const PairCounts& counts = result.frames[f];
    const std::size_t found = counts.touching - (without_adjacent ? counts.adjacent : 0);
    const std::size_t frame = f % truth.pairs.size();
    const std::size_t due =
        truth.pairs[frame].size() - (without_adjacent ? truth.adjacent[frame] : 0);
    if (!counts.checked || found >= due) continue;
    judgeWrong(result, f, due - found, " missed");
    if (result.missed && !without_adjacent) {
      const auto [i, j] = *result.missed;
      result.detail = "such as objects " + std::to_string(i) + " and " + std::to_string(j);
    }
    return;
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
        const bool is_known = results[i].frames[f].checked && results[reference].frames[f].checked;
        if (!is_known) continue;
        const std::size_t due = reported(reference, f);
        const bool more =
            static_cast<double>(reported(i, f)) > (1 + kRoundingExcess) * static_cast<double>(due);
        // Nobody computes the spheres exactly, and each tree rounds them in a frame of its own.
        const double least =
            (group == Reported::kSpheres ? 1 - kRoundingExcess : 1) * static_cast<double>(due);
        if (static_cast<double>(reported(i, f)) < least || more) {
          judgeWrong(results[i], f, reported(i, f), " pairs instead of " + std::to_string(due));
        }
      }
    }
  }
}

}  // namespace

std::string Preflight::whyNotTimed() const {
  std::string why = note;
  if (!why.empty()) why += std::string(" in ") + phaseName(phase) + when;
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
    tools::progress(fibers.name() + ": find what touches");
    truth = truthOf(fibers, limits);
  }
  std::vector<Preflight> results;
  std::deque<Child> running;
  for (std::size_t started = 0; results.size() < contenders.size();) {
    if (started < contenders.size() && running.size() < limits.at_once) {
      const auto& contender = contenders[started];
      tools::progress(fibers.name() + (limits.check ? ": check " : ": try ") +
                      std::to_string(++started) + "/" + std::to_string(contenders.size()) + ": " +
                      contender.title());
      running.emplace_back(contender, fibers, limits, truth);
      continue;
    }
    for (bool ended = false; !ended; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      for (Child& child : running) child.hasEnded();
      ended = running.front().hasEnded();
    }
    Preflight result = running.front().result();
    running.pop_front();
    judgeAlone(contenders[results.size()], result);
    if (result.verdict != Preflight::Verdict::kWrong) judgeMissed(result, truth, without_adjacent);
    results.push_back(result);
  }
  judgeWork(contenders, results, without_adjacent);
  tools::progress("");
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
