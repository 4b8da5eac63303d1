// SPDX-License-Identifier: BSD-3-Clause
#include "io/file_support.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pugixml.hpp>

#include "support/allocation_faults.h"

namespace fcl_fibers::io {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using testing::ThrowsMessage;

constexpr char kName[] = "a file";

// Before main, so that pugixml frees nothing that it allocated otherwise.
const bool pugixml_is_counted = [] {
  pugi::set_memory_management_functions([](std::size_t size) { return ::operator new(size); },
                                        [](void* memory) { ::operator delete(memory); });
  return true;
}();

constexpr int kSegmentsPerSpan = 2;

/// What readFibers promises, in sizes of the file.
std::size_t mostMemory(const std::string& bytes, FiberFormat format, bool has_radii) {
  const auto has = [&](const char* word) { return bytes.find(word) != std::string::npos; };
  switch (format) {
    case FiberFormat::kHair:
    case FiberFormat::kTfx:
    case FiberFormat::kTck:
    case FiberFormat::kTrk:
      return 3;
    case FiberFormat::kSwc:
      return 12;
    case FiberFormat::kBcc:
      return 2 * kSegmentsPerSpan + 2;
    case FiberFormat::kPolylines:
      return has_radii ? 7 : 5;
    case FiberFormat::kVtp:
      return has("vtkZLibDataCompressor") ? 16 * 64 : 29;
  }
  throw std::logic_error("there is no such format");
}

/// And some more for messages, and for the pages of the XML parser.
std::size_t fewBytes(FiberFormat format) {
  return std::size_t{format == FiberFormat::kVtp ? 80U : 8U} << 10;
}

}  // namespace

void expectWellFormed(const FiberPolylines& scene) {
  ASSERT_GE(scene.fiberCount(), 1U);
  ASSERT_EQ(scene.point_begin.front(), 0U);
  ASSERT_EQ(scene.point_begin.back(), scene.points.size());
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    ASSERT_GE(scene.point_begin[f + 1], scene.point_begin[f]);
  }
  for (const Point& point : scene.points) {
    for (const double coordinate : point) ASSERT_TRUE(std::isfinite(coordinate));
  }
  ASSERT_TRUE(scene.radius >= 0 && std::isfinite(scene.radius)) << scene.radius;
  if (!scene.radii.empty()) {
    ASSERT_EQ(scene.radii.size(), scene.points.size());
  }
  for (const double radius : scene.radii) ASSERT_TRUE(radius >= 0 && std::isfinite(radius));
  ASSERT_EQ(scene.hasRadiiOfPoints(), !scene.radii.empty());
  for (const auto* numbers : {&scene.samples, &scene.types}) {
    ASSERT_TRUE(numbers->empty() || numbers->size() == scene.points.size());
  }
  ASSERT_TRUE(scene.groups.empty() || scene.groups.size() == scene.fiberCount());
  const auto expectPlaces = [&](const std::vector<std::int32_t>& places, bool are_starts) {
    if (places.empty()) return;
    ASSERT_EQ(places.size(), scene.fiberCount());
    ASSERT_NE(std::count(places.begin(), places.end(), -1), places.size());
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      if (places[f] == -1) continue;
      const auto place = static_cast<std::size_t>(places[f]);
      ASSERT_LT(place, scene.points.size());
      const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
      ASSERT_LT(begin, end);
      ASSERT_NE(place, are_starts ? begin : end - 1);
      ASSERT_EQ(scene.points[place], scene.points[are_starts ? begin : end - 1]);
    }
  };
  expectPlaces(scene.starts_at, true);
  expectPlaces(scene.ends_at, false);
  if (scene.closed.empty()) return;
  ASSERT_EQ(scene.closed.size(), scene.fiberCount());
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    if (!scene.isClosed(f)) continue;
    ASSERT_EQ(scene.points[scene.point_begin[f]], scene.points[scene.point_begin[f + 1] - 1]);
    ASSERT_GE(scene.point_begin[f + 1] - scene.point_begin[f], 4U);
  }
}

void expectTwoLines(const FiberFile& file) {
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 4, 6));
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{0, 0, 0}, Point{1, 0, 0}, Point{1, 1, 0},
                                              Point{0, 0, 0}, Point{0, 1, 0.5}, Point{7, 8, 9}));
  EXPECT_THAT(file.fibers.closed, ElementsAre(1, 0));
  EXPECT_EQ(file.fibers.radius, 0);
  EXPECT_THAT(file.warnings, testing::IsEmpty());
}

void expectRefusal(const std::string& bytes, FiberFormat format, const std::string& place,
                   const std::string& reason) {
  EXPECT_THAT([&] { parseFibers(bytes, kName, format); },
              ThrowsMessage<std::runtime_error>(
                  AllOf(StartsWith("readFibers: 'a file', " + place + ": "), HasSubstr(reason))));
}

bool parsesSafely(const std::string& bytes, FiberFormat format, const std::string& numbers_from) {
  FiberFileOptions options;
  options.segments_per_span = kSegmentsPerSpan;
  options.radius_from = numbers_from;
  options.groups_from = format == FiberFormat::kSwc ? "type" : numbers_from;
  const test::PeakMemory memory;
  bool is_scene = false;
  try {
    const FiberFile file = parseFibers(bytes, kName, format, options);
    is_scene = true;
    expectWellFormed(file.fibers);
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AnyOf(StartsWith("readFibers: 'a file', byte "),
                                    StartsWith("readFibers: 'a file', line ")));
  }
  const std::size_t used = memory.bytes();
  EXPECT_LE(used,
            mostMemory(bytes, format, !numbers_from.empty()) * bytes.size() + fewBytes(format))
      << "of a file of " << bytes.size();
  return is_scene;
}

void expectSafeTruncations(const std::string& bytes, FiberFormat format, std::size_t needed) {
  for (std::size_t size = 0; size <= bytes.size(); ++size) {
    SCOPED_TRACE("the first " + std::to_string(size) + " bytes");
    EXPECT_EQ(parsesSafely(bytes.substr(0, size), format), size >= needed);
  }
}

void expectToldTruncations(const std::string& bytes, FiberFormat format) {
  EXPECT_TRUE(parsesSafely(bytes, format));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    SCOPED_TRACE("the first " + std::to_string(size) + " bytes");
    const std::string start = bytes.substr(0, size);
    if (!parsesSafely(start, format)) continue;
    EXPECT_THAT(parseFibers(start, kName, format).warnings, testing::Contains(HasSubstr("trunc")));
  }
}

void expectSafeBitFlips(const std::string& bytes, FiberFormat format) {
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    SCOPED_TRACE("bit " + std::to_string(bit));
    std::string flipped = bytes;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ 1 << bit % 8);
    parsesSafely(flipped, format);
  }
}

std::string realFile(const std::string& name) {
  const char* const directory = std::getenv("FCL_FIBERS_DATA");
  if (directory == nullptr) return "";
  return (std::filesystem::path(directory) / name).string();
}

}  // namespace fcl_fibers::io
