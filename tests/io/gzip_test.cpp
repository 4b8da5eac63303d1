// SPDX-License-Identifier: BSD-3-Clause
#include <zlib.h>

#include <cstddef>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/io/mesh_file.h>

#include "io/file_support.h"
#include "support/allocation_faults.h"
#include "support/temporary_file.h"

namespace fcl_fibers::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::string packed(const std::string& bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 16 + MAX_WBITS, 9, Z_DEFAULT_STRATEGY), Z_OK);
  std::string result(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  return result;
}

const char kText[] = "1 2 3\n4 5 6\n";
const char kNeuron[] = "1 1 1 2 3 1 -1\n2 1 4 5 6 1 1\n";

void expectRead(const FiberFile& file, FiberFormat format) {
  EXPECT_EQ(file.format, format);
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{1, 2, 3}, Point{4, 5, 6}));
  EXPECT_THAT(file.warnings, testing::IsEmpty());
}

void refuses(const std::string& bytes, const std::string& reason) {
  EXPECT_THAT([&] { parseFibers(bytes, "a.txt.gz"); },
              ThrowsMessage<std::runtime_error>(
                  testing::AllOf(HasSubstr("'a.txt.gz', byte "), HasSubstr(reason))));
}

TEST(GzipTest, UnpacksFilesOfAnyFormat) {
  // If this fails, files are refused as they come from archives and other programs.
  expectRead(parseFibers(packed(kText), "a.txt.gz"), FiberFormat::kPolylines);
  // The name tells a neuron from text, and neither tells that a file is packed.
  expectRead(parseFibers(packed(kNeuron), "a.SWC.GZ"), FiberFormat::kSwc);
  expectRead(parseFibers(packed(kNeuron), "a.swc"), FiberFormat::kSwc);
  expectRead(parseFibers(packed(kNeuron), "any name", FiberFormat::kSwc), FiberFormat::kSwc);
  expectRead(parseFibers(packed(kText), "standard input"), FiberFormat::kPolylines);
  EXPECT_THAT([] { parseFibers(packed(packed(kText)), "a.txt.gz.gz"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("is packed twice by gzip")));
  const std::string vtp =
      "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"2\" NumberOfLines=\"1\">"
      "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3 4 5 6"
      "</DataArray></Points><Lines><DataArray type=\"Int32\" Name=\"connectivity\" "
      "format=\"ascii\">"
      "0 1</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">2</DataArray>"
      "</Lines></Piece></PolyData></VTKFile>";
  EXPECT_EQ(recognizeFormat(packed(vtp), "a"), FiberFormat::kVtp);
  expectRead(parseFibers(packed(vtp), "a"), FiberFormat::kVtp);
  const test::TemporaryFile file(".swc.gz", packed(kNeuron));
  expectRead(readFibers(file.path()), FiberFormat::kSwc);
  expectRead(readFibers(file.path(), FiberFormat::kSwc), FiberFormat::kSwc);
}

TEST(GzipTest, UnpacksSeveralPartsAndLargeFiles) {
  // If this fails, what was packed in parts, as by bgzip, is read up to the end of the first.
  std::string parts, lines;
  for (const char* part : {"", "1 2", " 3\n", "", "4 5 6\n"}) parts += packed(part);
  expectRead(parseFibers(parts, "any name"), FiberFormat::kPolylines);
  expectRead(parseFibers(parts + std::string(600, '\0'), "a.txt.gz"), FiberFormat::kPolylines);
  for (int i = 0; i < 100000; ++i) lines += std::to_string(i) + " 0 0\n";
  const std::string file = packed(lines);
  const test::PeakMemory memory;
  const FiberPolylines scene = parseFibers(file, "a.txt.gz").fibers;
  // What readFibers promises for text, and the buffers of unpacking.
  EXPECT_LE(memory.bytes(), (5 + 3) * lines.size() + (std::size_t{200} << 10));
  ASSERT_EQ(scene.points.size(), 100000U);
  EXPECT_EQ(scene.points.back()[0], 99999);
}

TEST(GzipTest, DamageIsRefused) {
  // If this fails, a file that was not copied to its end passes for whole, or damage for points.
  const std::string whole = packed(kText);
  for (std::size_t size = 3; size < whole.size(); ++size) {
    refuses(whole.substr(0, size), "the packed file is truncated");
    refuses(whole + whole.substr(0, size), "the packed file is truncated");
  }
  for (std::size_t bit = 8 * 10; bit < 8 * whole.size(); ++bit) {
    std::string flipped = whole;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ 1 << bit % 8);
    try {
      // A few bits fill the last byte.
      expectRead(parseFibers(flipped, "a.txt.gz"), FiberFormat::kPolylines);
      EXPECT_EQ(bit / 8, whole.size() - 9);
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr("'a.txt.gz', byte "));
    }
  }
  std::string checksum = whole;
  checksum[whole.size() - 8] = static_cast<char>(checksum[whole.size() - 8] ^ 1);
  refuses(checksum, "the packed file is damaged: incorrect data check");
  refuses(whole + "more", "bytes follow the end of what is packed");
}

TEST(GzipTest, ErrorsAreOfTheUnpackedFile) {
  // If this fails, the place of an error is nowhere in the file that its author has.
  EXPECT_THAT([&] { parseFibers(packed("1 2 3\n4 x 6\n"), "a.txt.gz"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("'a.txt.gz', line 2: 'x' is no")));
  EXPECT_THAT([&] { parseFibers(packed("?"), "a.gz"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("'a.gz' has no known format")));
  EXPECT_THAT([&] { parseFibers(packed("?"), "brain.nii.gz"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("'brain.nii.gz' is an image of voxels")));
}

TEST(GzipTest, ABombIsRefused) {
  // If this fails, a small file fills the memory. Packed zeros become a thousandth of themselves.
  const std::string part = packed(std::string(std::size_t{1} << 20, '0'));
  std::string bomb;
  for (int i = 0; i < 20; ++i) bomb += part;
  refuses(bomb, "the file unpacks to more than ");
  // Text of the same line all over is fine as long as it is short.
  std::string lines;
  for (int i = 0; i < 100000; ++i) lines += "0 0 0\n";
  EXPECT_EQ(parseFibers(packed(lines), "a.txt.gz").fibers.points.size(), 100000U);
}

TEST(GzipTest, UnpacksMeshes) {
  // If this fails, a mesh has to be unpacked although fibers need not be.
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_THAT(parseMesh(packed(triangle), "a.obj.gz").triangles, ElementsAre(0, 1, 2));
  EXPECT_THAT([&] { parseMesh(packed(triangle).substr(0, 20), "a.obj.gz"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("readMesh: 'a.obj.gz', byte 20: ")));
}

}  // namespace
}  // namespace fcl_fibers::io
