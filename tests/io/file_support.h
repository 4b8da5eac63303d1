// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include <fcl_fibers/io/fiber_file.h>

namespace fcl_fibers::io {

/// The bytes of a file, put together by hand.
class FileBytes {
 public:
  FileBytes& text(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  FileBytes& zeros(std::size_t count) {
    bytes_.append(count, '\0');
    return *this;
  }
  template <typename T>
  FileBytes& little(T number) {
    bytes_ += encoded(number);
    return *this;
  }
  template <typename T>
  FileBytes& big(T number) {
    const std::string bytes = encoded(number);
    bytes_.append(bytes.rbegin(), bytes.rend());
    return *this;
  }
  template <typename T>
  FileBytes& setLittle(std::size_t offset, T number) {
    bytes_.replace(offset, sizeof number, encoded(number));
    return *this;
  }

  std::size_t size() const { return bytes_.size(); }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename T>
  static std::string encoded(T number) {
    using Word = std::conditional_t<
        sizeof(T) == 8, std::uint64_t,
        std::conditional_t<sizeof(T) == 4, std::uint32_t,
                           std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;
    static_assert(sizeof(Word) == sizeof(T));
    Word word;
    std::memcpy(&word, &number, sizeof word);
    std::string bytes;
    for (std::size_t i = 0; i < sizeof word; ++i) {
      bytes += static_cast<char>(std::uint64_t{word} >> (8 * i) & 0xFF);
    }
    return bytes;
  }

  std::string bytes_;
};

/// The numbers of a closed line of three points and an open one of two, as VTK's formats have them.
constexpr float kTwoLinesPoints[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, .5F, 7, 8, 9};
constexpr int kTwoLinesIndices[] = {0, 1, 2, 0, 3, 4};

/// That the scene is as FiberPolylines says.
void expectWellFormed(const FiberPolylines& scene);

/// That it is these two lines.
void expectTwoLines(const FiberFile& file);

/// That parsing throws std::runtime_error naming the file, the place and the reason.
void expectRefusal(const std::string& bytes, FiberFormat format, const std::string& place,
                   const std::string& reason);

/// That parsing gives a scene as FiberPolylines says, or refuses with a place, and takes no more
/// memory than readFibers says. Returns whether there is a scene.
/// @param numbers_from  of radii and groups, which neurons have by their type
bool parsesSafely(const std::string& bytes, FiberFormat format,
                  const std::string& numbers_from = "");

/// For all beginnings of a valid file. Those shorter than `needed` have to be refused.
void expectSafeTruncations(const std::string& bytes, FiberFormat format, std::size_t needed);

/// For all beginnings of a valid file: they are refused or warned of.
void expectToldTruncations(const std::string& bytes, FiberFormat format);

/// For a valid file with each of its bits flipped.
void expectSafeBitFlips(const std::string& bytes, FiberFormat format);

/// Of real files, which are no part of this project; those that use it skip where it is absent.
std::string realFile(const std::string& name);

}  // namespace fcl_fibers::io
