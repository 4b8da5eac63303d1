// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/pair_order.h"

#include <cstring>
#include <stdexcept>
#include <type_traits>

#include "numerics/random_scenes.h"

namespace fcl_fibers::test {
namespace {

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
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

std::uint64_t hashOf(const TouchOracle& capsules) {
  Hash hash;
  for (std::size_t i = 0; i < capsules.size(); ++i) {
    const GivenCapsule& capsule = capsules[i];
    for (const auto& vector : {capsule.a, capsule.b, capsule.axis}) {
      for (const double x : vector) hash.add(x);
    }
    hash.add(capsule.radius);
    hash.add(capsule.length);
  }
  return hash.value();
}

template <typename S>
OrderHash orderHash(RandomKind kind, Form form, int threads) {
  const Assembly<S> fibers = randomScene<S>(kind, 1200, 41, HairFiles::none());
  const Specimen<S> specimen(fibers, form);
  Hash hash;
  for (FiberTreeOptions options : allKinds()) {
    options.threads = threads;
    const std::vector<NumberPair> pairs = specimen.pairs(options);
    if (pairs.empty()) throw std::logic_error("The scene has no pairs to put in order.");
    hash.add(std::uint64_t{pairs.size()});
    for (const NumberPair& pair : pairs) {
      hash.add(std::uint64_t{static_cast<std::uint32_t>(pair.a)} << 32 |
               static_cast<std::uint32_t>(pair.b));
    }
  }
  const std::string scalar = std::is_same_v<S, float> ? "float" : "double";
  return {nameOf(kind) + ", " + scalar + (form == Form::kArrays ? ", arrays" : ", objects"),
          hashOf(specimen.truth()), hash.value()};
}

}  // namespace

std::vector<OrderHash> orderHashes(int threads) {
  std::vector<OrderHash> hashes;
  for (const RandomKind kind : kRandomKinds) {
    if (kind == RandomKind::kHair) continue;
    for (const Form form : {Form::kArrays, Form::kObjects}) {
      hashes.push_back(orderHash<float>(kind, form, threads));
      hashes.push_back(orderHash<double>(kind, form, threads));
    }
  }
  return hashes;
}

}  // namespace fcl_fibers::test
