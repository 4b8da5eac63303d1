// SPDX-License-Identifier: BSD-3-Clause
#include "output_file.h"

#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>

namespace fcl_fibers::tools {
namespace {

namespace fs = std::filesystem;

/// The path of the draft that a signal removes, in a form that a handler may read. There is one
/// draft at a time.
char draft_to_remove[4096];
volatile std::sig_atomic_t has_draft = 0;

constexpr std::array kSignals = {SIGINT, SIGTERM, SIGHUP};
std::array<struct sigaction, kSignals.size()> actions_before;

extern "C" void removeDraftAndEnd(int signal) {
  if (has_draft != 0) unlink(draft_to_remove);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void keepInMind(const std::string& draft) {
  if (draft.size() >= sizeof draft_to_remove) {
    throw std::runtime_error(fmt::format("'{}': the path is too long", draft));
  }
  std::memcpy(draft_to_remove, draft.c_str(), draft.size() + 1);
  has_draft = 1;
  struct sigaction action = {};
  action.sa_handler = removeDraftAndEnd;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &actions_before[i]);
    // A signal that the caller ignores stays ignored.
    if (actions_before[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &action, nullptr);
  }
}

/// A program that goes on has its own handlers again, such as Python's.
void forget() {
  if (has_draft == 0) return;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], &actions_before[i], nullptr);
  }
  has_draft = 0;
}

}  // namespace

OutputFile::OutputFile(const std::string& path) : path_(path), draft_(path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) {
    throw std::runtime_error(fmt::format("'{}' is a directory; give a file", path));
  }
  in_place_ = fs::exists(status) && !fs::is_regular_file(status);
  if (in_place_) return;
  // A link is kept, and its target replaced.
  const fs::path place = fs::exists(status) ? fs::canonical(path) : fs::path(path);
  path_ = place.string();
  draft_ = (place.parent_path() / fmt::format(".part-{}-{}", getpid(), place.filename().string()))
               .string();
  keepInMind(draft_);
  if (!std::ofstream(draft_)) {
    const std::string problem = std::strerror(errno);
    forget();
    throw std::runtime_error(fmt::format("'{}' cannot be written: {}", path, problem));
  }
}

OutputFile::~OutputFile() {
  if (in_place_ || draft_.empty()) return;
  unlink(draft_.c_str());
  forget();
}

void OutputFile::write(std::string_view text) {
  if (!stream_.is_open()) stream_.open(draft_, std::ios::binary);
  stream_ << text;
  requireWritten();
}

void OutputFile::requireWritten() const {
  if (!stream_) throw std::runtime_error(fmt::format("'{}': writing failed", path_));
}

void OutputFile::commit() {
  if (stream_.is_open()) stream_.close();
  requireWritten();
  if (in_place_) return;
  if (std::rename(draft_.c_str(), path_.c_str()) != 0) {
    throw std::runtime_error(
        fmt::format("'{}' cannot be replaced: {}", path_, std::strerror(errno)));
  }
  forget();
  draft_.clear();
}

}  // namespace fcl_fibers::tools
