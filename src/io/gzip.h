// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "io/byte_reader.h"

namespace fcl_fibers::io {

/// Whether the bytes are those of a file that gzip packed. No format of fibers starts so.
bool isPacked(std::string_view bytes);

/// Returns the name without the ending that gzip adds.
std::string nameOfUnpacked(const std::string& name);

/// Returns the start of what is packed, of at most `most` bytes, or less where it is damaged.
std::string unpackedStart(std::string_view bytes, std::size_t most);

/// Returns what is packed, which may be several parts one after another. Refuses a file that is
/// truncated, damaged, or unpacks to more than mostUnpacked() bytes.
std::string unpacked(const ByteReader& file);

/// The most bytes that a file of a size may unpack to. Deflate reaches 1032 times the size, where
/// the bytes are all the same; fibers as text unpack to 3 to 20 times. Small files may hold more,
/// because that does no harm.
constexpr std::uint64_t mostUnpacked(std::uint64_t size) {
  return 64 * size + (std::uint64_t{16} << 20);
}

}  // namespace fcl_fibers::io
