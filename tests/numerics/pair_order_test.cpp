// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "numerics/array_order.h"
#include "numerics/object_order.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

std::string hashes(int threads) {
  return table("arrays", arrayOrderHashes(threads)) + table("objects", objectOrderHashes(threads));
}

std::string contentOf(const std::string& path) {
  std::ifstream file(FCL_FIBERS_SOURCE_DIR "/" + path);
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

// Programs that depend on the order of contacts, as most solvers do, could not be run twice, or on
// another machine. Scripts compare other instruction sets, compilers and levels of optimization,
// by what fcl_fibers_numerics_run prints.
TEST(PairOrder, IsTheRecordedOneForAnyNumberOfThreadsAndAnyAddresses) {
  const std::string recorded = contentOf("tests/data/pair_order/hashes.txt");
  for (const int threads : {1, 2, 5}) {
    // What is allocated next is elsewhere and in another order.
    Random random(static_cast<std::uint64_t>(threads));
    std::vector<std::unique_ptr<char[]>> clutter(2000);
    for (auto& block : clutter) block = std::make_unique<char[]>(1 + random.below(2000));
    random.shuffle(clutter);
    clutter.resize(1000);

    EXPECT_EQ(hashes(threads), recorded) << threads << " threads";
  }
}

TEST(PairOrder, IsThatOfTheDocument) {
  const std::string document = contentOf("docs/numerics.md");
  std::istringstream recorded(contentOf("tests/data/pair_order/hashes.txt"));
  int found = 0;
  for (std::string line; std::getline(recorded, line);) {
    if (line.find(": all ") == std::string::npos) continue;
    const std::string pairs = line.substr(line.rfind(' ') + 1);
    EXPECT_NE(document.find(pairs), std::string::npos) << line;
    ++found;
  }
  EXPECT_EQ(found, 2);
}

}  // namespace
}  // namespace fcl_fibers::test
