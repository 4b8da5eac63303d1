// SPDX-License-Identifier: BSD-3-Clause
#include "io/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <new>

namespace fcl_fibers::io {
namespace {

constexpr std::string_view kEnding = ".gz";

/// Unpacks bytes piece by piece.
class Inflater {
 public:
  explicit Inflater(std::string_view bytes) : bytes_(bytes), rest_(bytes) {
    constexpr int kGzip = 16;  // see zlib.h
    if (inflateInit2(&stream_, kGzip + MAX_WBITS) != Z_OK) throw std::bad_alloc();
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() { inflateEnd(&stream_); }

  /// Appends at most `most` bytes, and at least one if it returns Z_OK. Other results are
  /// Z_STREAM_END at the end of a part, Z_BUF_ERROR where the input ends too early, and those of
  /// zlib for damage.
  int append(std::string& to, std::size_t most) {
    stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
    stream_.avail_out = static_cast<uInt>(std::min(most, buffer_.size()));
    const uInt room = stream_.avail_out;
    int status = Z_OK;
    while (status == Z_OK && stream_.avail_out > 0) {
      if (stream_.avail_in == 0) takeInput();
      status = inflate(&stream_, Z_NO_FLUSH);
    }
    to.append(buffer_, 0, room - stream_.avail_out);
    return status;
  }

  /// The bytes after the last one that was used.
  std::string_view left() const {
    return bytes_.substr(bytes_.size() - rest_.size() - stream_.avail_in);
  }

  /// Begins with the next part, if another one follows.
  bool startPart() { return isPacked(left()) && inflateReset(&stream_) == Z_OK; }

  const char* problem() const { return stream_.msg == nullptr ? "unknown" : stream_.msg; }

 private:
  void takeInput() {
    const std::size_t size = std::min<std::size_t>(rest_.size(), std::size_t{1} << 30);
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(rest_.data()));
    stream_.avail_in = static_cast<uInt>(size);
    rest_.remove_prefix(size);
  }

  z_stream stream_{};
  std::string buffer_ = std::string(std::size_t{1} << 16, '\0');
  std::string_view bytes_;
  std::string_view rest_;  ///< that zlib has not got
};

}  // namespace

bool isPacked(std::string_view bytes) {
  constexpr std::string_view kStart = "\x1F\x8B\x08";  // and deflate
  return bytes.substr(0, kStart.size()) == kStart;
}

std::string nameOfUnpacked(const std::string& name) {
  if (name.size() <= kEnding.size()) return name;
  const std::size_t stem = name.size() - kEnding.size();
  const bool ends =
      std::equal(kEnding.begin(), kEnding.end(), name.begin() + static_cast<std::ptrdiff_t>(stem),
                 [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
  return ends ? name.substr(0, stem) : name;
}

std::string unpackedStart(std::string_view bytes, std::size_t most) {
  Inflater inflater(bytes);
  std::string start;
  int status = Z_OK;
  while (start.size() < most &&
         (status == Z_OK || (status == Z_STREAM_END && inflater.startPart()))) {
    status = inflater.append(start, most - start.size());
  }
  return start;
}

std::string unpacked(const ByteReader& file) {
  const std::string_view bytes = file.bytes();
  const std::uint64_t most = mostUnpacked(bytes.size());
  Inflater inflater(bytes);
  std::string all;
  while (true) {
    const int status = inflater.append(all, static_cast<std::size_t>(most + 1 - all.size()));
    const std::uint64_t at = bytes.size() - inflater.left().size();
    if (all.size() > most) {
      file.refuse(at, "the file unpacks to more than ", most,
                  " bytes, which is beyond what fibers do; unpack it by gunzip if it is right");
    }
    if (status == Z_OK) continue;
    if (status == Z_BUF_ERROR) file.refuse(at, "the packed file is truncated");
    if (status != Z_STREAM_END) file.refuse(at, "the packed file is damaged: ", inflater.problem());
    if (inflater.startPart()) continue;
    // Tapes fill a block with zeros.
    if (inflater.left().find_first_not_of('\0') == bytes.npos) return all;
    file.refuse(at, "bytes follow the end of what is packed");
  }
}

}  // namespace fcl_fibers::io
