// SPDX-License-Identifier: BSD-3-Clause
#include "io/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>

namespace fcl_fibers::io {
namespace {

/// Unpacks until `to` has `most` bytes, and takes off `bytes` what was used. Returns zlib's result
/// and message: Z_OK if there may be more, Z_STREAM_END, Z_BUF_ERROR where the input ends too
/// early, and others for damage.
std::pair<int, const char*> unpack(std::string_view& bytes, std::size_t most, std::string& to) {
  constexpr int kGzip = 16;  // see zlib.h
  z_stream stream{};
  if (inflateInit2(&stream, kGzip + MAX_WBITS) != Z_OK) throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, &inflateEnd);
  std::string buffer(std::size_t{1} << 16, '\0');
  int status = Z_OK;
  while (to.size() < most && (status == Z_OK || (status == Z_STREAM_END && isPacked(bytes) &&
                                                 inflateReset(&stream) == Z_OK))) {
    const std::size_t given = std::min<std::size_t>(bytes.size(), std::size_t{1} << 30);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(given);
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(std::min(most - to.size(), buffer.size()));
    const uInt room = stream.avail_out;
    status = inflate(&stream, Z_NO_FLUSH);
    to.append(buffer, 0, room - stream.avail_out);
    bytes.remove_prefix(given - stream.avail_in);
  }
  return {status, stream.msg == nullptr ? "unknown" : stream.msg};
}

}  // namespace

bool isPacked(std::string_view bytes) {
  constexpr std::string_view kStart = "\x1F\x8B\x08";  // and deflate
  return bytes.substr(0, kStart.size()) == kStart;
}

std::string unpackedStart(std::string_view bytes, std::size_t most) {
  std::string start;
  unpack(bytes, most, start);
  return start;
}

std::string_view unpacked(const ByteReader& file, std::string& room) {
  if (!isPacked(file.bytes())) return file.bytes();
  std::string_view left = file.bytes();
  const std::uint64_t most = 64 * file.size() + (std::uint64_t{16} << 20);
  const auto [status, problem] = unpack(left, static_cast<std::size_t>(most + 1), room);
  const std::uint64_t at = file.size() - left.size();
  if (room.size() > most) {
    file.refuse(at, "the file unpacks to more than ", most,
                " bytes, which is beyond what fibers do; unpack it by gunzip if it is right");
  }
  if (status == Z_BUF_ERROR) file.refuse(at, "the packed file is truncated");
  if (status != Z_STREAM_END) file.refuse(at, "the packed file is damaged: ", problem);
  // Tapes fill a block with zeros.
  if (left.find_first_not_of('\0') != left.npos) {
    file.refuse(at, "bytes follow the end of what is packed");
  }
  return room;
}

}  // namespace fcl_fibers::io
