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

/// Earlier index in the upper half, later index in the lower: sorts as pairs do.
using Pair = std::uint64_t;
using Pairs = std::vector<Pair>;
using FramePairs = std::array<Pairs, MovingFibers::kFrames>;

/// See MovingFibers::nextInFiber().
using NextInFiber = std::vector<std::uint32_t>;

bool areAdjacent(const NextInFiber& next, Pair pair) {
  const std::size_t i = pair >> 32;
  const std::size_t j = pair & 0xffffffff;
  return i != j && (next[i] == j || next[j] == i);
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
class Checker {
 public:
  explicit Checker(const MovingFibers& fibers)
      : capsules_(fibers.capsules()), next_(fibers.nextInFiber()) {
    block_.reserve(kBlock);
  }

  static bool callback(Object* a, Object* b, void* data) {
    static_cast<Checker*>(data)->add(MovingFibers::index(a), MovingFibers::index(b));
    return false;
  }

  double secondsJudging() const { return seconds_judging_; }

  /// Once, when the query has ended: what was counted, and the different touching pairs in order.
  std::pair<PairCounts, Pairs> finish() {
    judgeBlock();
    const std::size_t reported_touching = touching_.size();
    std::sort(touching_.begin(), touching_.end());
    touching_.erase(std::unique(touching_.begin(), touching_.end()), touching_.end());
    counts_.touching = touching_.size();
    counts_.repeated = reported_touching - touching_.size();
    counts_.adjacent = static_cast<std::size_t>(std::count_if(
        touching_.begin(), touching_.end(), [&](Pair pair) { return areAdjacent(next_, pair); }));
    counts_.checked = true;
    return {counts_, std::move(touching_)};
  }

 private:
  static constexpr std::size_t kBlock = 1 << 20;

  void add(std::size_t i, std::size_t j) {
    block_.push_back(Pair{std::min(i, j)} << 32 | Pair{std::max(i, j)});
    if (block_.size() == kBlock) {
      pauseAlarm([&] { seconds_judging_ += seconds([&] { judgeBlock(); }); });
    }
  }

  void judgeBlock() {
    for (const Pair pair : block_) judge(pair);
    counts_.reported += block_.size();
    block_.clear();
  }

  void judge(Pair pair) {
    const std::size_t i = pair >> 32;
    const std::size_t j = pair & 0xffffffff;
    if (i == j) {
      ++counts_.with_itself;
      return;
    }
    const Contact kind = contact(capsules_[i], capsules_[j]);
    if (kind == Contact::kTouching) touching_.push_back(pair);
    if (kind == Contact::kApart) ++counts_.apart;
    if (kind == Contact::kBoundary) ++counts_.undecided;
  }

  std::vector<Capsule> capsules_;
  NextInFiber next_;
  Pairs block_;
  Pairs touching_;
  PairCounts counts_;
  double seconds_judging_ = 0;
};

/// One contender's run, in the child.
struct Run {
  const Contender& contender;
  MovingFibers& fibers;
  const PreflightLimits& limits;
  Trace& trace;
  std::FILE* pairs_file;

  void run() {
    fibers.bringTo(0, contender.boxes);
    const std::size_t bytes_before = allocatedBytes();
    std::unique_ptr<Manager> manager;
    time(Phase::kSetUp, [&] { manager = contender.setUp(fibers); });
    trace.bytes = bytesOf(*manager, bytes_before);

    if (limits.check || !limits.update) query(*manager, trace.frames[0]);
    if (const auto* ours = dynamic_cast<const FiberCollisionManager<double>*>(manager.get())) {
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

  static std::size_t bytesOf(const Manager& manager, std::size_t bytes_before) {
    const std::size_t allocated = allocatedBytes() - bytes_before;
    const auto* foreign = dynamic_cast<const ForeignManager*>(&manager);
    return foreign == nullptr ? allocated : foreign->libraryBytes(allocated);
  }

  void moveTo(int frame, Manager& manager) {
    fibers.setPoses(frame);
    time(Phase::kUpdate, [&] { update(contender, fibers, manager); });
  }

  void query(const Manager& manager, PairCounts& counts) {
    if (!limits.check) {
      time(Phase::kDetection, [&] { counts.reported = countPairs(manager).pairs; });
      return;
    }
    Checker checker(fibers);
    time(Phase::kDetection, [&] { manager.collide(&checker, Checker::callback); });
    trace.seconds[static_cast<std::size_t>(Phase::kDetection)] -= checker.secondsJudging();
    const auto [checked, touching] = checker.finish();
    const std::size_t written =
        std::fwrite(touching.data(), sizeof(Pair), touching.size(), pairs_file);
    if (written < touching.size() || std::fflush(pairs_file) != 0) failSystemCall("fwrite");
    counts = checked;
  }
};

[[noreturn]] void runChild(Run run) {
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
  Child(const Contender& contender, MovingFibers& fibers, const PreflightLimits& limits)
      : limits_(limits), pairs_file_(std::tmpfile(), std::fclose) {
    void* const shared =
        mmap(nullptr, sizeof(Trace), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) failSystemCall("mmap");
    trace_.reset(new (shared) Trace{});
    if (!pairs_file_) failSystemCall("tmpfile");
    pid_ = fork();
    if (pid_ < 0) failSystemCall("fork");
    if (pid_ == 0) runChild({contender, fibers, limits, *trace_, pairs_file_.get()});
  }

  /// How it ended, and the pairs that it reported and that touch.
  std::pair<Preflight, FramePairs> wait() const {
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

    FramePairs pairs;
    std::rewind(pairs_file_.get());
    for (std::size_t f = 0; f < pairs.size(); ++f) {
      pairs[f].resize(result.frames[f].touching);
      const std::size_t count = pairs[f].size();
      if (std::fread(pairs[f].data(), sizeof(Pair), count, pairs_file_.get()) < count) {
        throw std::runtime_error("preflight: pairs are missing in the temporary file");
      }
    }
    return {result, std::move(pairs)};
  }

 private:
  struct Unmap {
    void operator()(Trace* trace) const { munmap(trace, sizeof(Trace)); }
  };

  PreflightLimits limits_;
  std::unique_ptr<Trace, Unmap> trace_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> pairs_file_;
  pid_t pid_;
};

void judgeWrong(Preflight& result, std::size_t frame, std::size_t count, const std::string& what) {
  result.verdict = Preflight::Verdict::kWrong;
  result.phase = Phase::kDetection;
  result.note = "wrong: " + std::to_string(count) + what + (frame == 0 ? "" : " after update");
}

/// What is wrong whatever the others report.
void judgeAlone(const Contender& contender, Preflight& result) {
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

void judgeMissed(Preflight& result, const FramePairs& truth, bool without_adjacent) {
  for (std::size_t f = 0; f < result.frames.size(); ++f) {
    const PairCounts& counts = result.frames[f];
    const std::size_t found = counts.touching - (without_adjacent ? counts.adjacent : 0);
    if (counts.checked && found < truth[f].size()) {
      return judgeWrong(result, f, truth[f].size() - found, " missed");
    }
  }
}

/// Bounds may be rounded outward, so ours may report a few more pairs, and none less.
constexpr double kRoundingExcess = 0.01;

/// Each of ours against FCL's manager of its group, if there is one, or else against the fewest
/// pairs. What some leave out counts for none.
void judgeWork(const std::vector<Contender>& contenders, std::vector<Preflight>& results,
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

std::vector<Preflight> preflightAll(const std::vector<Contender>& contenders, MovingFibers& fibers,
                                    const PreflightLimits& limits) {
  const bool without_adjacent =
      std::any_of(contenders.begin(), contenders.end(),
                  [](const Contender& contender) { return contender.leaves_out_adjacent; });
  const NextInFiber next = fibers.nextInFiber();
  std::vector<Preflight> results;
  FramePairs truth;
  std::deque<Child> running;
  for (std::size_t started = 0; results.size() < contenders.size();) {
    if (started < contenders.size() && running.size() < limits.at_once) {
      const Contender& contender = contenders[started];
      showProgress(fibers.name() + (limits.check ? ": check " : ": try ") +
                   std::to_string(++started) + "/" + std::to_string(contenders.size()) + ": " +
                   contender.title());
      running.emplace_back(contender, fibers, limits);
      continue;
    }
    auto [result, pairs] = running.front().wait();
    running.pop_front();
    judgeAlone(contenders[results.size()], result);
    results.push_back(result);
    for (std::size_t f = 0; f < truth.size(); ++f) {
      const auto isLeftOut = [&](Pair pair) { return without_adjacent && areAdjacent(next, pair); };
      pairs[f].erase(std::remove_if(pairs[f].begin(), pairs[f].end(), isLeftOut), pairs[f].end());
      if (pairs[f] == truth[f]) continue;
      Pairs merged;
      std::set_union(truth[f].begin(), truth[f].end(), pairs[f].begin(), pairs[f].end(),
                     std::back_inserter(merged));
      truth[f] = std::move(merged);
    }
  }
  for (Preflight& result : results) {
    if (result.verdict != Preflight::Verdict::kWrong) judgeMissed(result, truth, without_adjacent);
  }
  judgeWork(contenders, results, without_adjacent);
  endProgress();
  return results;
}

bool oursAreRight(const std::vector<Contender>& contenders,
                  const std::vector<Preflight>& preflights) {
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const bool slow = preflights[i].verdict == Preflight::Verdict::kTooSlow;
    if (contenders[i].ours && !preflights[i].right() && !slow) return false;
  }
  return true;
}

}  // namespace fcl_fibers::benchmarks
