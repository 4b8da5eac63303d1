// SPDX-License-Identifier: BSD-3-Clause
#include "harness/command_line.h"

#include <benchmark/benchmark.h>

#include <fstream>
#include <stdexcept>
#include <thread>

namespace fcl_fibers::benchmarks {
namespace {

/// `AMD EPYC, 2 cores`
std::string machine() {
  std::string processor = "unknown processor";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    if (line.rfind("model name", 0) == 0) processor = line.substr(line.find(':') + 2);
  }
  return processor + ", " + std::to_string(std::thread::hardware_concurrency()) + " cores";
}

/// `g++ 12.2.0`
std::string compiler() {
#ifdef __clang__
  return "clang " __clang_version__;
#else
  return "g++ " __VERSION__;
#endif
}

}  // namespace

void initializeBenchmark(char* program, const std::vector<std::string>& flags) {
  // Google Benchmark would print these and end the program.
  for (const std::string& flag : flags) {
    if (flag.rfind("--benchmark_", 0) != 0 && flag.rfind("--v=", 0) != 0) {
      throw std::invalid_argument("there is no option " + flag + "; see --help");
    }
  }
  std::vector<std::string> texts = {"--benchmark_enable_random_interleaving=true"};
  texts.insert(texts.end(), flags.begin(), flags.end());
  std::vector<char*> pointers = {program};
  for (std::string& text : texts) pointers.push_back(text.data());
  int count = static_cast<int>(pointers.size());
  benchmark::Initialize(&count, pointers.data());
  if (benchmark::ReportUnrecognizedArguments(count, pointers.data())) {
    throw std::invalid_argument("Google Benchmark does not know this option; see --help");
  }
  benchmark::AddCustomContext("machine", machine());
  benchmark::AddCustomContext("compiler", compiler());
}

}  // namespace fcl_fibers::benchmarks
