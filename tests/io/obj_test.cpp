// SPDX-License-Identifier: BSD-3-Clause
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcl_fibers/io/mesh_file.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/obj_text.h"
#include "support/allocation_faults.h"
#include "support/temporary_file.h"

namespace fcl_fibers::io {
namespace {

using test::TemporaryFile;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;
using testing::ThrowsMessage;

const std::string kPoints = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const std::string kTriangle = kPoints + "f 1 2 3\n";

void expectRefusal(const std::string& text, std::size_t line, const std::string& reason) {
  EXPECT_THAT([&] { parseMesh(text, "a mesh"); },
              ThrowsMessage<std::runtime_error>(
                  StartsWith("readMesh: 'a mesh', line " + std::to_string(line) + ": " + reason)))
      << text;
}

void expectTriangle(const std::string& text) {
  SCOPED_TRACE(text);
  const MeshFile mesh = parseMesh(text, "a mesh");
  EXPECT_THAT(mesh.points, ElementsAre(Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}));
  EXPECT_THAT(mesh.triangles, ElementsAre(0, 1, 2));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

TEST(ObjFile, ReadsPointsAndTriangles) {
  // If this fails, a mesh is elsewhere, or inside out.
  expectTriangle(kTriangle);
  const TemporaryFile file(".any", kTriangle);
  const MeshFile mesh = readMesh(file.path());
  const TriangleMesh built(meshArrays(mesh));
  EXPECT_EQ(built.pointCount(), 3U);
  EXPECT_EQ(built.triangleCount(), 1U);
  EXPECT_EQ(meshArrays(MeshFile()).triangle_count, 0U);
}

TEST(ObjFile, EveryWayToWriteAFace) {
  // If this fails, files of some programs are refused, or a face has other points.
  for (const char* face :
       {"1 2 3", "+1 +2 +3", "-3 -2 -1", "1/7 2/7 3/7", "1// 2// 3//", "1/ 2/ 3/", "1/2/ 2/2/ 3/2/",
        "1//1 2//1 3//1", "1/0 2/0 3/0", " 1/1/1  2/1/1\t3/1/1 ", "1 2 3 # four", "1 2 3#4",
        "1 2\\\n3", "1 \\\n 2 \\\n\\\n3 \\\n", "\\\n1 2 3", "1 2 3\\\n# five"}) {
    expectTriangle(kPoints + "f " + face);
    expectTriangle(kPoints + "f " + face + "\nl 1 2\n");
    expectTriangle(replaced(kPoints + "f " + face + "\n", "\n", "\r\n"));
    expectTriangle(replaced(kPoints + "f " + face + "\n", "\n", "\r"));
  }
  expectTriangle(kPoints + "f 1 2 3 \\");
  expectTriangle("f 1 2 3\n" + kPoints);
  expectTriangle("v 0 0 0\nv 1 0 0\nf -2 2 3\nv 0 1 0\n");
}

TEST(ObjFile, EveryWayToWriteAPoint) {
  // If this fails, files of some programs are refused, or a point is elsewhere.
  for (const char* point :
       {"1 0 0 1.0", "1 0 0 0.5 0.5 0.5", "+1 -0 +.0", "1e0 0.0e+00 0E5", "\t1\t0\t0\t",
        "1 0 0# a corner", "1 0 0 # v 2 2 2", "1 \\\n0 0", "1\\\n 0 0", "1. 0 0 \\\n1"}) {
    const std::string points = std::string("v 0 0 0\nv ") + point + "\n \tv 0 1 0\n";
    expectTriangle(points + "f 1 2 3");
    expectTriangle(replaced(points, "\n", "\r\n") + "f 1 2 3");
  }
  EXPECT_EQ(parseMesh("v 0.1 1e308 5e-324\nv 0 0 0\nv 1 0 0\nf 1 2 3", "").points[0],
            (Point{0.1, 1e308, 5e-324}));
}

TEST(ObjFile, AllElseIsPassedOver) {
  // If this fails, a file is refused for what no collision depends on, or a name swallows a face.
  for (const char* line : {"# a comment",
                           "#f 1 2 9",
                           "mtllib a b.mtl",
                           "usemtl a\\b",
                           "usemtl a\\",
                           "g a # b",
                           "o head\\",
                           "s off",
                           "vn 0 0 1",
                           "vt 0 0",
                           "vp 1",
                           "l 1 2",
                           "p 1",
                           "curv 0 1 \\\n1 2",
                           "l 1 2 \\\n3 1",
                           "# a comment \\",
                           "F 1 2 9",
                           "fo 1",
                           "",
                           " ",
                           "\\",
                           "\x1b[2J",
                           "usemtl \xe4\xf6"}) {
    expectTriangle(kPoints + line + "\nf 1 2 3\n");
    expectTriangle(line + ("\n" + kTriangle));
  }
  expectTriangle("\xEF\xBB\xBF" + kTriangle);
}

TEST(ObjFile, RefusalsTellTheLineAndTheReason) {
  // If this fails, a mesh loses a part of it, and fibers pass there.
  for (const char* text : {"", "\n\n", "fibers are no mesh", "l 1 2"}) {
    EXPECT_THAT([&] { parseMesh(text, "a mesh"); },
                ThrowsMessage<std::runtime_error>(HasSubstr("there is no face; give a Wavefront")));
  }
  expectRefusal(kPoints, 4, "there is no face; ");
  expectRefusal(kPoints + "f 1 2 4", 4, "the face has point 4, and the file has 3");
  expectRefusal(kPoints + "f 1 2 3 9\nv 0 0 0", 4, "the face has point 9, and the file has 4");
  expectRefusal(kPoints + "f 1 2 -4", 4, "the face has point -4, and 3 are before it");
  expectRefusal(kPoints + "f 1 2 9223372036854775807", 4,
                "the face has point 9223372036854775807, and the file has 3");
  expectRefusal(kPoints + "f 1 2 -9223372036854775808", 4,
                "the face has point -9223372036854775808, and 3 are before it");
  for (const std::string word :
       {"0", "x", "/1", "1.0", "1\\2", "--1", "++1", "+-1", "9223372036854775808", "\\"}) {
    expectRefusal(kPoints + "\nf 1 \\\n 2 " + word + " 3", 6,
                  "'" + word.substr(0, word.find('/')) + "' does not name a point; points count");
  }
  expectRefusal(kPoints + "f 1 2", 4, "the face has 2 points; it needs 3");
  expectRefusal(kPoints + "f", 4, "the face has 0 points");
  expectRefusal("v 0 0 0\nv nan 0 0\n", 2, "'nan' is no finite number");
  expectRefusal("v 0 0 0\rv inf 0 0\r", 2, "'inf' is no finite number");
  expectRefusal("v 0 0 0\r\nv 1,5 0 0\r\n", 2, "'1,5' is no finite number");
  expectRefusal("v 0 1e999 0\n", 1, "'1e999' is no finite number");
  expectRefusal("v 0 0\n", 1, "the point has fewer than three coordinates");
  expectRefusal("v 0 0 # 0\n", 1, "the point has fewer than three coordinates");
  expectRefusal("v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3 4\n", 6,
                "the face crosses itself; ");
}

TEST(ObjFile, RefusalsAreShortAndPrintable) {
  // If this fails, a broken file sends commands to the terminal, or fills it.
  const std::string wild = "\x1b[2J\x1b]0;owned\x07\xff" + std::string(3000000, 'A');
  for (const std::string& text : {"v " + wild + " 0 0\n", kPoints + "f 1 2 " + wild + "\n"}) {
    try {
      parseMesh(text, "a mesh");
      ADD_FAILURE();
    } catch (const std::runtime_error& error) {
      const std::string what = error.what();
      EXPECT_LT(what.size(), 200U);
      EXPECT_TRUE(std::all_of(what.begin(), what.end(), [](char c) {
        return c >= ' ' && c <= '~';
      })) << what;
    }
  }
}

TEST(ObjFile, NamesAFileThatCannotBeRead) {
  // If this fails, a mistyped path is reported as a broken mesh, or a pipe waits for ever.
  const auto refuses = [](const std::string& path, const std::string& reason) {
    EXPECT_THAT([&] { readMesh(path); }, ThrowsMessage<std::runtime_error>(
                                             StartsWith("readMesh: '" + path + "' " + reason)));
  };
  refuses(testing::TempDir() + "no_such_folder/no_such_file.obj", "does not exist");
  refuses(testing::TempDir(), "is a directory");
  const std::string pipe = testing::TempDir() + "pipe" + std::to_string(getpid()) + ".obj";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  refuses(pipe, "is not a regular file");
  unlink(pipe.c_str());
}

/// That parsing gives triangles of the file's points, or refuses with a line, and takes no more
/// memory than readMesh says.
void expectSafe(const std::string& text, std::size_t most = 12) {
  const test::PeakMemory memory;
  try {
    const MeshFile mesh = parseMesh(text, "a mesh");
    ASSERT_GE(mesh.triangles.size(), 3U);
    for (const std::int32_t point : mesh.triangles) {
      ASSERT_TRUE(point >= 0 && static_cast<std::size_t>(point) < mesh.points.size());
    }
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), StartsWith("readMesh: 'a mesh', line "));
  }
  EXPECT_LE(memory.bytes(), most * text.size() + 8192);
}

TEST(ObjFile, BrokenFilesAreRefusedOrReadSafely) {
  // If this fails, a truncated or damaged file crashes the program or asks for memory without end.
  const std::string text =
      "# a box\nv 0 0 0\nv 1 0 0\nv 1 1 0\r\nv .5 5e-1 0\nv 0 1 0 1\nusemtl a\nf 1/1 2/1 3/1 "
      "\\\n4/1 "
      "-1//2\nf 1 2 3#c\n";
  for (std::size_t size = 0; size <= text.size(); ++size) expectSafe(text.substr(0, size));
  for (std::size_t bit = 0; bit < 8 * text.size(); ++bit) {
    std::string flipped = text;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
    expectSafe(flipped);
  }
}

TEST(ObjFile, MemoryIsBoundedByTheFile) {
  // If this fails, a large mesh takes more memory than its user was told.
  std::string points, triangles = kPoints, face = kPoints + "v 1 1 1\nf";
  for (int i = 0; i < 20000; ++i) points += "v 0 0 0\n";
  for (int i = 0; i < 20000; ++i) triangles += "f 1 2 3\n";
  for (int i = 0; i < 3000; ++i) face += " 1";
  expectSafe(points + "f 1 2 3\n");
  expectSafe(triangles);
  expectSafe(face, 100);
}

}  // namespace
}  // namespace fcl_fibers::io
