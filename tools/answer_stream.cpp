// SPDX-License-Identifier: BSD-3-Clause
#include "answer_stream.h"

#include "messages.h"

namespace fcl_fibers::tools {

void AnswerStream::write(std::string_view text) {
  constexpr std::size_t kPiece = 1 << 16;
  waiting_ += text;
  if (waiting_.size() >= kPiece) flush();
}

void AnswerStream::finish() {
  flush();
  if (file_) file_->commit();
}

void AnswerStream::flush() {
  progress("");
  if (path_.empty()) {
    print(waiting_);
  } else {
    if (!file_) file_.emplace(path_);
    file_->write(waiting_);
  }
  waiting_.clear();
}

}  // namespace fcl_fibers::tools
