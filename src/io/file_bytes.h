// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "io/byte_reader.h"

namespace fcl_fibers::io {

/// Returns what is in a regular file. Throws std::runtime_error with the call, the path and the
/// reason if that is not to be had.
std::string readBytes(const char* call, const std::string& path);

/// Throws as readBytes() does if the file cannot be written.
void writeBytes(const char* call, const std::string& path, const std::string& bytes);

/// Whether the bytes are those of a file that gzip packed. No format of fibers starts so.
bool isPacked(std::string_view bytes);

/// Returns the start of what is packed, of at most `most` bytes, or less where it is damaged.
std::string unpackedStart(std::string_view bytes, std::size_t most);

/// Returns the bytes of a file, which are in `room` if they had to be unpacked. There may be
/// several parts one after another. Refuses a packed file that is truncated, damaged, or unpacks to
/// more than 64 times its size and 16 MiB. Deflate reaches 1032 times the size, where the bytes are
/// all the same; fibers as text unpack to 3 to 20 times. Small files may hold more, because that
/// does no harm.
std::string_view unpacked(const ByteReader& file, std::string& room);

}  // namespace fcl_fibers::io
