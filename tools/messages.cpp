// SPDX-License-Identifier: BSD-3-Clause
#include "messages.h"

#include <cstdio>
#include <stdexcept>

#include "benchmarks/harness/progress.h"

namespace fcl_fibers::tools {
namespace {

std::string program_name = "fcl_fibers";

}  // namespace

const std::string& programName() { return program_name; }
void setProgramName(const std::string& name) { program_name = name; }

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw std::runtime_error("writing to stdout failed");
  }
}

void progress(const std::string& line) {
  if (line.empty()) return benchmarks::endProgress();
  benchmarks::showProgress(line);
}

void warn(const std::string& what, const std::string& text) {
  progress("");
  std::fprintf(stderr, "%s: warning: %s: %s\n", program_name.c_str(), what.c_str(), text.c_str());
}

std::string countText(std::size_t count) {
  std::string text = std::to_string(count);
  for (int i = static_cast<int>(text.size()) - 3; i > 0; i -= 3) {
    text.insert(static_cast<std::size_t>(i), 1, ',');
  }
  return text;
}

std::string counted(std::size_t count, const char* one) {
  return countText(count) + " " + one + (count == 1 ? "" : "s");
}

}  // namespace fcl_fibers::tools
