// SPDX-License-Identifier: BSD-3-Clause
#include "table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace fcl_fibers::benchmarks {
namespace {

double seconds(const Timing& timing, Phase phase) {
  return timing[static_cast<std::size_t>(phase)];
}

/// What contenders are ranked by.
double updateAndSelf(const Timing& timing) {
  return seconds(timing, Phase::kUpdate) + seconds(timing, Phase::kSelfCollision);
}

/// Three significant digits without an exponent.
std::string threeDigits(double value) {
  int decimals = 2;
  for (double bound = 9.995; value >= bound && decimals > 0; bound *= 10) --decimals;
  for (double bound = 0.9995; value < bound && decimals < 6; bound /= 10) ++decimals;
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

std::string processorName() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

std::string phaseCell(const Preflight& preflight, const Timing& timing, Phase phase) {
  if (!std::isnan(seconds(timing, phase))) return timeText(seconds(timing, phase));
  if (!preflight.right() && preflight.phase == phase) return preflight.note;
  const double once = preflight.seconds[static_cast<std::size_t>(phase)];
  if (preflight.verdict == Preflight::Verdict::kTooSlow && !std::isnan(once)) {
    return "~" + timeText(once);
  }
  return "-";
}

void printAgainstFcl(const std::vector<Contender>& contenders, const std::vector<Timing>& timings) {
  TextTable table(
      {"times as fast", "as FCL's best with", "set-up", "update", "self-collision", "frame"});
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (!contenders[i].ours || std::isnan(updateAndSelf(timings[i]))) continue;
    for (const Boxes boxes : {Boxes::kStock, Boxes::kTight}) {
      const Timing* const best = fclBest(contenders, timings, {boxes});
      if (best == nullptr) continue;
      const std::size_t b = static_cast<std::size_t>(best - timings.data());
      TextTable::Row row = {contenders[i].title(),
                            boxes == Boxes::kStock ? "stock boxes: " : "tight boxes: "};
      row.back() += contenders[b].manager;
      for (std::size_t p = 0; p < best->size(); ++p) {
        row.push_back(ratioText((*best)[p] / timings[i][p]));
      }
      table.add(std::move(row));
    }
  }
  table.print();
}

void printEqualWork(const std::vector<Contender>& contenders,
                    const std::vector<Preflight>& preflights) {
  std::string line;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    // Checked after the motion is checked before it.
    if (contenders[i].reported != Reported::kTightBoxes || !preflights[i].frames[1].checked) {
      continue;
    }
    line += (line.empty() ? "" : "; ") + contenders[i].title() + " " +
            countText(preflights[i].frames[0].reported) + " and " +
            countText(preflights[i].frames[1].reported);
  }
  if (line.empty()) return;
  std::printf("Pairs of overlapping tight boxes before and after the motion: %s.\n", line.c_str());
}

/// Where memoryUsage() and what malloc gave differ by more than a twentieth.
void printStatedBytes(const std::vector<Contender>& contenders,
                      const std::vector<Preflight>& preflights, std::size_t segments) {
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const auto stated = static_cast<double>(preflights[i].bytes_stated);
    const auto measured = static_cast<double>(preflights[i].bytes);
    if (stated == 0 || std::abs(stated - measured) <= 0.05 * measured) continue;
    std::printf("memoryUsage() of %s: %s bytes/segment.\n", contenders[i].title().c_str(),
                countText(preflights[i].bytes_stated / segments).c_str());
  }
}

}  // namespace

Circumstances circumstances(int argc, char** argv) {
  Circumstances result;
  result.machine =
      processorName() + ", " + std::to_string(std::thread::hardware_concurrency()) + " cores";
#ifdef __clang__
  result.compiler = "clang " __clang_version__;
#else
  result.compiler = "g++ " __VERSION__;
#endif
  result.build_type = FCL_FIBERS_BUILD_TYPE;
  const char* const commit = std::getenv("FCL_FIBERS_COMMIT");
  result.commit = commit == nullptr ? "unknown" : commit;
  for (int i = 0; i < argc; ++i) {
    std::string word = argv[i];
    // The folder of the program and of result files says nothing to others.
    if (i == 0) word = word.substr(word.find_last_of('/') + 1);
    if (word.rfind("--benchmark_out", 0) == 0) continue;
    result.command += (i == 0 ? "" : " ") + word;
  }
  return result;
}

void TextTable::print() const {
  std::vector<std::size_t> widths;
  for (const Row& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < widths.size(); ++c) {
      const std::string& cell = rows_[r][c];
      const std::string padding(widths[c] - cell.size(), ' ');
      // The first column holds names, the others numbers.
      std::printf("| %s ", (c == 0 ? cell + padding : padding + cell).c_str());
    }
    std::printf("|\n");
    if (r > 0) continue;
    for (std::size_t c = 0; c < widths.size(); ++c) {
      std::printf(c == 0 ? "|%s-" : "|%s:", std::string(widths[c] + 1, '-').c_str());
    }
    std::printf("|\n");
  }
}

std::string timeText(double seconds) {
  if (std::isnan(seconds)) return "-";
  return seconds < 0.9995 ? threeDigits(1e3 * seconds) + " ms" : threeDigits(seconds) + " s";
}

std::string ratioText(double ratio) {
  if (std::isnan(ratio)) return "-";
  return threeDigits(ratio);
}

std::string countText(std::size_t count) {
  std::string text = std::to_string(count);
  for (std::size_t i = text.size(); i > 3;) text.insert(i -= 3, ",");
  return text;
}

const Timing* fclBest(const std::vector<Contender>& contenders, const std::vector<Timing>& timings,
                      const std::vector<Boxes>& boxes) {
  const Timing* best = nullptr;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (contenders[i].ours || std::isnan(updateAndSelf(timings[i])) ||
        std::find(boxes.begin(), boxes.end(), contenders[i].boxes) == boxes.end()) {
      continue;
    }
    if (best == nullptr || updateAndSelf(timings[i]) < updateAndSelf(*best)) best = &timings[i];
  }
  return best;
}

void printScene(const std::vector<Contender>& contenders, const std::vector<Preflight>& preflights,
                const std::vector<Timing>& timings, const MovingFibers& fibers,
                const Circumstances& circumstances) {
  std::printf("\n%s\n\n%s; %s, %s; commit %s; `%s`\n\n", fibers.name().c_str(),
              circumstances.machine.c_str(), circumstances.compiler.c_str(),
              circumstances.build_type.c_str(), circumstances.commit.c_str(),
              circumstances.command.c_str());

  const Timing* const best = fclBest(contenders, timings, {Boxes::kStock, Boxes::kTight});
  TextTable table({"manager", "set-up", "update", "self-collision", "frame", "pairs", "touching",
                   "bytes/segment", "ratio to FCL's best"});
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Preflight& preflight = preflights[i];
    const Timing& timing = timings[i];
    TextTable::Row row = {contenders[i].title() + (&timing == best ? " (FCL's best)" : "")};
    for (int p = 0; p < kPhases; ++p) {
      row.push_back(phaseCell(preflight, timing, static_cast<Phase>(p)));
    }
    const PairCounts& counts = preflight.frames[0];
    row.push_back(counts.checked ? countText(counts.reported) : "-");
    row.push_back(counts.checked ? countText(counts.touching) : "-");
    row.push_back(preflight.bytes == 0 ? "-" : countText(preflight.bytes / fibers.segmentCount()));
    row.push_back(best == nullptr ? "-" : ratioText(updateAndSelf(*best) / updateAndSelf(timing)));
    table.add(std::move(row));
  }
  table.print();

  std::printf("\nRatio: update + self-collision of FCL's best, divided by the manager's own.\n");
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (!preflights[i].detail.empty()) {
      std::printf("%s refused: %s\n", contenders[i].title().c_str(), preflights[i].detail.c_str());
    }
  }
  printEqualWork(contenders, preflights);
  printStatedBytes(contenders, preflights, fibers.segmentCount());
  std::printf("\n");
  printAgainstFcl(contenders, timings);
  std::fflush(stdout);
}

}  // namespace fcl_fibers::benchmarks
