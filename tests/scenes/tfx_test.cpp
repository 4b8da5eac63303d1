// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/scenes/tfx.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace fcl_fibers::scenes {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

using Bytes = std::vector<unsigned char>;

void putWord(Bytes& bytes, std::size_t offset, std::uint32_t word) {
  for (std::size_t i = 0; i < 4; ++i) {
    bytes.at(offset + i) = static_cast<unsigned char>(word >> (8 * i) & 0xFF);
  }
}

void putFloat(Bytes& bytes, std::size_t offset, float number) {
  std::uint32_t word = 0;
  std::memcpy(&word, &number, sizeof word);
  putWord(bytes, offset, word);
}

constexpr std::uint32_t kStrands = 2;
constexpr std::uint32_t kPointsPerStrand = 3;
constexpr std::size_t kTrailingBytes = 8;

// A small valid file and where its parts are.
struct SampleFile {
  Bytes bytes;
  std::size_t offset_field;
  std::size_t header_size;
  std::size_t points_begin;
  std::size_t points_end;
  std::size_t point_size;
};

float sampleCoordinate(std::size_t point, std::size_t k) {
  return static_cast<float>(point) + 0.25F * static_cast<float>(k + 1);
}

SampleFile sampleFile(int version) {
  SampleFile file;
  file.offset_field = version == 3 ? 144 : 12;
  file.header_size = version == 3 ? 148 : 160;
  file.point_size = version == 3 ? 12 : 16;
  file.points_begin = file.header_size + 4;
  file.points_end = file.points_begin + kStrands * kPointsPerStrand * file.point_size;
  file.bytes.resize(file.points_end + kTrailingBytes, 0xFF);
  std::fill_n(file.bytes.begin(), file.header_size, static_cast<unsigned char>(0));
  putFloat(file.bytes, 0, static_cast<float>(version));
  putWord(file.bytes, 4, kStrands);
  putWord(file.bytes, 8, kPointsPerStrand);
  putWord(file.bytes, file.offset_field, static_cast<std::uint32_t>(file.points_begin));
  // The fourth number of a version 4 point stays NaN: it is not read.
  for (std::size_t i = 0; i < kStrands * kPointsPerStrand; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      putFloat(file.bytes, file.points_begin + i * file.point_size + 4 * k, sampleCoordinate(i, k));
    }
  }
  return file;
}

void expectSampleScene(const FiberScene& scene) {
  EXPECT_EQ(scene.radius, 0.5);
  EXPECT_THAT(scene.point_begin, testing::ElementsAre(0, 3, 6));
  ASSERT_EQ(scene.points.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(scene.points[i][k], sampleCoordinate(i, k));
  }
}

void expectWellFormed(const FiberScene& scene) {
  ASSERT_GE(scene.fiberCount(), 1U);
  ASSERT_EQ(scene.point_begin.front(), 0U);
  ASSERT_EQ(scene.point_begin.back(), scene.points.size());
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    ASSERT_GE(scene.point_begin[f + 1], scene.point_begin[f] + 2);
  }
  for (const Point& point : scene.points) {
    for (const double coordinate : point) ASSERT_TRUE(std::isfinite(coordinate));
  }
}

class TfxTest : public testing::TestWithParam<int> {
 protected:
  // Tests of several builds may run at once, so the name is drawn, not chosen.
  TfxTest()
      : path_(testing::TempDir() + "fcl_fibers_" + std::to_string(std::random_device()()) + "_" +
              std::to_string(std::random_device()()) + ".tfx") {}
  ~TfxTest() override { std::filesystem::remove(path_); }

  const std::string& path() const { return path_; }

  FiberScene read(const Bytes& bytes) const {
    // Some file systems wait for the disk when a file is overwritten, but not when it is new.
    std::filesystem::remove(path_);
    std::ofstream stream(path_, std::ios::binary);
    stream.write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) throw std::logic_error("the test cannot write " + path_);
    return readTfx(path_, 0.5);
  }

  void expectRefusal(const Bytes& bytes, std::size_t offset, const std::string& reason) const {
    EXPECT_THAT([&] { read(bytes); },
                ThrowsMessage<std::runtime_error>(
                    AllOf(HasSubstr("readTfx: '" + path_ + "'"),
                          HasSubstr("byte " + std::to_string(offset) + ": "), HasSubstr(reason))));
  }

 private:
  std::string path_;
};

INSTANTIATE_TEST_SUITE_P(Version, TfxTest, testing::Values(3, 4),
                         testing::PrintToStringParamName());

TEST_P(TfxTest, ReadsWhatWasWritten) {
  // If this fails, points are read from the wrong place or in the wrong order.
  expectSampleScene(read(sampleFile(GetParam()).bytes));
}

TEST_P(TfxTest, AcceptsMinorVersions) {
  // If this fails, files of version 3.1 or 4.1 are refused though their layout is known.
  SampleFile file = sampleFile(GetParam());
  putFloat(file.bytes, 0, static_cast<float>(GetParam()) + 0.1F);
  expectSampleScene(read(file.bytes));
}

TEST_P(TfxTest, RefusesOtherVersions) {
  // If this fails, a file of unknown layout is read as if it were known.
  SampleFile file = sampleFile(GetParam());
  for (const float version : {0.0F, 1.0F, 2.0F, 2.99F, 5.0F, -3.0F, 1e30F,
                              std::numeric_limits<float>::infinity(), std::nanf("")}) {
    putFloat(file.bytes, 0, version);
    expectRefusal(file.bytes, 0, "version is ");
  }
}

TEST_P(TfxTest, RefusesFilesWithoutStrands) {
  // If this fails, an empty scene hides that a file is broken.
  SampleFile file = sampleFile(GetParam());
  putWord(file.bytes, 4, 0);
  expectRefusal(file.bytes, 4, "there are no strands");
}

TEST_P(TfxTest, RefusesStrandsWithoutSegments) {
  // If this fails, fibers without a segment, or without a point, enter a scene.
  SampleFile file = sampleFile(GetParam());
  for (const std::uint32_t points : {0U, 1U}) {
    putWord(file.bytes, 8, points);
    expectRefusal(file.bytes, 8, "points per strand are " + std::to_string(points));
  }
}

TEST_P(TfxTest, RefusesPointsInsideTheHeader) {
  // If this fails, counts and offsets are read as coordinates.
  SampleFile file = sampleFile(GetParam());
  for (const std::size_t offset : {std::size_t{0}, std::size_t{12}, file.header_size - 1}) {
    putWord(file.bytes, file.offset_field, static_cast<std::uint32_t>(offset));
    expectRefusal(file.bytes, file.offset_field, "inside the header");
  }
}

TEST_P(TfxTest, RefusesPointsBeyondTheFile) {
  // If this fails, memory is filled with what the file does not contain.
  SampleFile file = sampleFile(GetParam());
  for (const std::size_t offset : {file.bytes.size() + 1, std::size_t{0xFFFFFFFF}}) {
    putWord(file.bytes, file.offset_field, static_cast<std::uint32_t>(offset));
    expectRefusal(file.bytes, file.offset_field, "points start at byte " + std::to_string(offset));
  }
  for (const std::size_t offset : {file.points_begin + kTrailingBytes + 1, file.bytes.size()}) {
    putWord(file.bytes, file.offset_field, static_cast<std::uint32_t>(offset));
    expectRefusal(file.bytes, 4, "end beyond the file");
  }
}

TEST_P(TfxTest, RefusesCountsThatTheFileCannotHold) {
  // If this fails, a broken count asks for memory that the machine does not have, or wraps around.
  const std::vector<std::pair<std::uint32_t, std::uint32_t>> counts = {
      {3, 3},                    // one strand too many
      {0xFFFFFFFF, 0xFFFFFFFF},  // bytes beyond 64 bits
      {0x80000000, 0x80000000},  // 2^62 points: times 12 or 16 wraps around to 0
      {0x10000, 0x10000},        // 2^32 points: 0 in 32 bits
      {1, 0xFFFFFFFF},           // a single strand of 48 GiB or more
      {0xFFFFFFFF, 2}};
  for (const auto& [strands, points_per_strand] : counts) {
    SampleFile file = sampleFile(GetParam());
    putWord(file.bytes, 4, strands);
    putWord(file.bytes, 8, points_per_strand);
    expectRefusal(file.bytes, 4, std::to_string(strands) + " strands of ");
  }
}

TEST_P(TfxTest, RefusesCoordinatesThatAreNoNumbers) {
  // If this fails, a NaN enters a scene and is noticed far from its cause.
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {infinity, -infinity, std::nanf("")}) {
    for (std::size_t k = 0; k < 3; ++k) {
      SampleFile file = sampleFile(GetParam());
      const std::size_t offset = file.points_begin + 5 * file.point_size + 4 * k;
      putFloat(file.bytes, offset, bad);
      expectRefusal(file.bytes, offset, "strand 1, point 2: coordinate is ");
    }
  }
}

TEST_P(TfxTest, RefusesEveryTruncationThatLosesAPoint) {
  // If this fails, a file that was not copied to its end is read as if it were whole.
  const SampleFile file = sampleFile(GetParam());
  for (std::size_t size = 0; size < file.bytes.size(); ++size) {
    const Bytes bytes(file.bytes.begin(), file.bytes.begin() + static_cast<std::ptrdiff_t>(size));
    if (size < file.header_size) {
      expectRefusal(bytes, size, "the file ends inside the header");
    } else if (size < file.points_begin) {
      expectRefusal(bytes, file.offset_field, "points start at byte ");
    } else if (size < file.points_end) {
      expectRefusal(bytes, 4, "end beyond the file");
    } else {
      expectSampleScene(read(bytes));
    }
  }
}

TEST_P(TfxTest, AnySingleBitFlippedGivesAnErrorOrAScene) {
  // If this fails, a damaged file crashes the reader or yields a scene that is not one.
  const SampleFile file = sampleFile(GetParam());
  for (std::size_t bit = 0; bit < 8 * file.bytes.size(); ++bit) {
    SCOPED_TRACE("bit " + std::to_string(bit));
    Bytes bytes = file.bytes;
    bytes[bit / 8] = static_cast<unsigned char>(bytes[bit / 8] ^ 1U << bit % 8);
    try {
      expectWellFormed(read(bytes));
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr(path()), HasSubstr(", byte ")));
    }
  }
}

TEST_P(TfxTest, RefusesARadiusThatIsNone) {
  // If this fails, the scene has a radius that no query can answer for.
  read(sampleFile(GetParam()).bytes);
  for (const double bad : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT([&] { readTfx(path(), bad); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("readTfx: radius is ")));
  }
}

TEST(TfxFileTest, NamesAFileThatDoesNotExist) {
  // If this fails, a mistyped path is reported as a broken file, or not at all.
  const std::string path = testing::TempDir() + "no_such_folder/no_such_file.tfx";
  EXPECT_THAT([&] { readTfx(path, 1); }, ThrowsMessage<std::runtime_error>(
                                             AllOf(HasSubstr(path), HasSubstr("does not exist"))));
}

TEST(TfxFileTest, RefusesADirectory) {
  // If this fails, a directory is reported as a broken file, or asks for memory without end.
  EXPECT_THAT([] { readTfx(testing::TempDir(), 1); },
              ThrowsMessage<std::runtime_error>(
                  AllOf(HasSubstr(testing::TempDir()), HasSubstr("is a directory"))));
}

struct RealFile {
  const char* name;
  std::size_t strands;
  std::size_t points_per_strand;
  double shortest_segment, longest_segment;  // to 1 %
};

void PrintTo(const RealFile& file, std::ostream* stream) { *stream << file.name; }

class TfxRealFileTest : public testing::TestWithParam<RealFile> {};

std::filesystem::path dataDirectory() {
  const char* directory = std::getenv("FCL_FIBERS_DATA");
  if (directory != nullptr) return directory;
  return std::filesystem::path(FCL_FIBERS_SOURCE_DIR) / ".." / "shared" / "data";
}

TEST_P(TfxRealFileTest, IsReadAsItIs) {
  // If this fails, files of the real world are read wrongly though our own are read well.
  const RealFile& file = GetParam();
  const std::filesystem::path path = dataDirectory() / file.name;
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << path << " is absent; FCL_FIBERS_DATA names the directory to look in";
  }
  const FiberScene scene = readTfx(path.string(), 0.05);
  expectWellFormed(scene);
  EXPECT_EQ(scene.fiberCount(), file.strands);
  ASSERT_EQ(scene.points.size(), file.strands * file.points_per_strand);
  double shortest = std::numeric_limits<double>::infinity();
  double longest = 0;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    ASSERT_EQ(scene.point_begin[f + 1] - scene.point_begin[f], file.points_per_strand);
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      const Point& p = scene.points[i - 1];
      const Point& q = scene.points[i];
      const double length = std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
      shortest = std::min(shortest, length);
      longest = std::max(longest, length);
    }
  }
  EXPECT_NEAR(shortest, file.shortest_segment, 0.01 * file.shortest_segment);
  EXPECT_NEAR(longest, file.longest_segment, 0.01 * file.longest_segment);
}

INSTANTIATE_TEST_SUITE_P(
    TressFx, TfxRealFileTest,
    testing::Values(RealFile{"tressfx31_ponytail_back.tfx", 517, 16, 0.2236, 2.097},
                    RealFile{"tressfx31_ponytail_front_top.tfx", 876, 16, 0.2003, 2.654},
                    RealFile{"tressfx31_ponytail_side.tfx", 3066, 16, 0.3951, 3.986},
                    RealFile{"tressfx31_ponytail_tail.tfx", 474, 16, 1.825, 6.306},
                    RealFile{"tressfx41_ratboy_mohawk.tfx", 2228, 32, 1.295e-7, 1.171e-2}),
    [](const testing::TestParamInfo<RealFile>& file) {
      return std::filesystem::path(file.param.name).stem().string();
    });

}  // namespace
}  // namespace fcl_fibers::scenes
