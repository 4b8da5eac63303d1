// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "support/touch_oracle.h"

namespace fcl_fibers::test {

/// FNV-1a (Fowler, Noll and Vo), over bytes of numbers.
class Hash {
 public:
  void add(std::uint64_t number) {
    for (int byte = 0; byte < 8; ++byte) {
      value_ = (value_ ^ (number >> (8 * byte) & 0xff)) * 0x100000001b3;
    }
  }
  void add(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    add(bits);
  }
  void add(const GivenCapsule& capsule) {
    for (const auto& vector : {capsule.a, capsule.b, capsule.axis}) {
      for (const double x : vector) add(x);
    }
    add(capsule.radius);
    add(capsule.length);
  }
  void addPair(std::int32_t a, std::int32_t b) {
    add(std::uint64_t{static_cast<std::uint32_t>(a)} << 32 | static_cast<std::uint32_t>(b));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

/// Hashes of a scene and of what all kinds of trees report of it.
struct OrderHash {
  std::string scene;
  std::uint64_t capsules;  ///< as they were given; if these differ, the pairs may
  std::uint64_t pairs;     ///< in the order of the report
};

/// A line for each scene, and one for all.
inline std::string table(const std::string& form, const std::vector<OrderHash>& hashes) {
  std::string text;
  const auto addLine = [&](const std::string& name, std::uint64_t capsules, std::uint64_t pairs) {
    char line[100];
    std::snprintf(line, sizeof line, "%-30s capsules %016llx pairs %016llx\n",
                  (form + ": " + name).c_str(), static_cast<unsigned long long>(capsules),
                  static_cast<unsigned long long>(pairs));
    text += line;
  };
  Hash given, found;
  for (const OrderHash& hash : hashes) {
    addLine(hash.scene, hash.capsules, hash.pairs);
    given.add(hash.capsules);
    found.add(hash.pairs);
  }
  addLine("all", given.value(), found.value());
  return text;
}

}  // namespace fcl_fibers::test
