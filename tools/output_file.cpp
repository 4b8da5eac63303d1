// SPDX-License-Identifier: BSD-3-Clause
#include "output_file.h"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <stdexcept>

#include <fmt/format.h>

namespace fcl_fibers::tools {
namespace {

namespace fs = std::filesystem;

/// The path of the draft that a signal removes, in a form that a handler may read. There is one
/// draft at a time.
char draft_to_remove[4096];
volatile std::sig_atomic_t has_draft = 0;

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
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // A signal that the caller ignores stays ignored.
    if (std::signal(signal, removeDraftAndEnd) == SIG_IGN) std::signal(signal, SIG_IGN);
  }
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
    has_draft = 0;
    throw std::runtime_error(fmt::format("'{}' cannot be written: {}", path, std::strerror(errno)));
  }
}

OutputFile::~OutputFile() {
  if (in_place_ || draft_.empty()) return;
  unlink(draft_.c_str());
  has_draft = 0;
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
  has_draft = 0;
  draft_.clear();
}

}  // namespace fcl_fibers::tools
