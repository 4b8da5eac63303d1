// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/object_order.h"

#include <stdexcept>

#include "numerics/recorded_scenes.h"
#include "numerics/specimen.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
OrderHash objectOrderHash(const std::string& name, int threads) {
  const Assembly<S> fibers = recordedScene<S>(name);
  const Specimen<S> specimen(fibers, Form::kObjects);
  Hash given, found;
  for (std::size_t i = 0; i < specimen.truth().size(); ++i) given.add(specimen.truth()[i]);
  for (FiberTreeOptions options : allKinds()) {
    options.threads = threads;
    const std::vector<NumberPair> pairs = specimen.pairs(options);
    if (pairs.empty()) throw std::logic_error("The scene has no pairs to put in order.");
    found.add(std::uint64_t{pairs.size()});
    for (const NumberPair& pair : pairs) found.addPair(pair.a, pair.b);
  }
  return {name + (sizeof(S) == 4 ? ", float" : ", double"), given.value(), found.value()};
}

}  // namespace

std::vector<OrderHash> objectOrderHashes(int threads) {
  std::vector<OrderHash> hashes;
  for (const std::string& name : recordedNames()) {
    hashes.push_back(objectOrderHash<float>(name, threads));
    hashes.push_back(objectOrderHash<double>(name, threads));
  }
  return hashes;
}

}  // namespace fcl_fibers::test
