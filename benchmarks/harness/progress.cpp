// SPDX-License-Identifier: BSD-3-Clause
#include "progress.h"

#include <unistd.h>

#include <cstdio>

namespace fcl_fibers::benchmarks {
namespace {

bool everywhere = false;

bool progressOverwrites() { return isatty(STDERR_FILENO) != 0; }

}  // namespace

void showProgressEverywhere() { everywhere = true; }

void showProgress(const std::string& line) {
  if (!everywhere && !progressOverwrites()) return;
  // "\r\033[K" goes back to the first column and clears the line.
  std::fprintf(stderr, progressOverwrites() ? "\r\033[K%s" : "%s\n", line.c_str());
  std::fflush(stderr);
}

void endProgress() {
  if (progressOverwrites()) std::fputs("\r\033[K", stderr);
}

}  // namespace fcl_fibers::benchmarks
