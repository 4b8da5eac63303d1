// SPDX-License-Identifier: BSD-3-Clause
#include "arrays/pair_order.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <vector>

#include "parallel/unwritten.h"

namespace fcl_fibers::arrays {
namespace {

using fibers::FiberTable;
using Key = std::uint64_t;

/// The bits of numbers up to `largest`.
int bitsOf(std::size_t largest) {
  int bits = 0;
  while (largest >> bits != 0) ++bits;
  return bits;
}

/// The low bits of a key, which are taken off it.
std::size_t take(Key& key, int bits) {
  const Key low = key & ((Key{1} << bits) - 1);
  key >>= bits;
  return static_cast<std::size_t>(low);
}

/// Sorts keys of so many bits: radix sort, whose digits are so small that their counts stay in the
/// cache.
void sortKeys(parallel::UnwrittenVector<Key>& keys, int bits) {
  constexpr int kMost = 11;
  if (keys.size() < std::size_t{1} << kMost) return std::sort(keys.begin(), keys.end());
  const int passes = (bits + kMost - 1) / kMost;
  const int digit = (bits + passes - 1) / passes;
  const Key mask = (Key{1} << digit) - 1;
  parallel::UnwrittenVector<Key> sorted(keys.size());
  std::vector<std::size_t> place(mask + 2);
  for (int shift = 0; shift < bits; shift += digit) {
    std::fill(place.begin(), place.end(), 0);
    for (const Key key : keys) ++place[(key >> shift & mask) + 1];
    std::partial_sum(place.begin(), place.end(), place.begin());
    for (const Key key : keys) sorted[place[key >> shift & mask]++] = key;
    keys.swap(sorted);
  }
}

/// Sorts what keyOf(found) turns into keys, and foundOf(key) back.
template <class Found, class KeyOf, class FoundOf>
void sortByKey(Found* all, std::size_t count, int bits, const KeyOf& keyOf,
               const FoundOf& foundOf) {
  parallel::UnwrittenVector<Key> keys(count);
  std::transform(all, all + count, keys.begin(), keyOf);
  sortKeys(keys, bits);
  std::transform(keys.begin(), keys.end(), all, foundOf);
}

template <class Pair>
void sortPairs(Pair* pairs, std::size_t count) {
  std::size_t any_a = 0, any_b = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [a, b] = pairs[i];
    any_a |= static_cast<std::size_t>(a);
    any_b |= static_cast<std::size_t>(b);
  }
  const int b_bits = bitsOf(any_b);
  const auto keyOf = [&](const Pair& pair) {
    const auto& [a, b] = pair;
    return static_cast<Key>(a) << b_bits | static_cast<Key>(b);
  };
  sortByKey(pairs, count, bitsOf(any_a) + b_bits, keyOf, [&](Key key) {
    const auto b = static_cast<std::int32_t>(take(key, b_bits));
    return Pair{static_cast<std::int32_t>(key), b};
  });
}

/// The largest number of a segment along its fiber, or more.
std::size_t longest(const FiberTable& table) {
  std::size_t longest = 0, end = static_cast<std::size_t>(table.idCount());
  for (std::size_t f = table.fiberCount(); f-- > 0;) {
    const auto begin = static_cast<std::size_t>(table.beginOf(f));
    longest = std::max(longest, end - begin);
    end = begin;
  }
  return longest;
}

}  // namespace

void sortFound(Order order, const FiberTable& a, const FiberTable& b, SegmentPair* found,
               std::size_t count) {
  if (order == Order::kSegments || count == 0) return sortPairs(found, count);
  const int fiber_a = bitsOf(a.fiberCount() - 1), fiber_b = bitsOf(b.fiberCount() - 1),
            number_a = bitsOf(longest(a)), number_b = bitsOf(longest(b));
  if (fiber_a + fiber_b + number_a + number_b > 64) {
    const auto key = [&](const SegmentPair& pair) {
      return std::tuple(a.placeOf(pair.a).fiber, b.placeOf(pair.b).fiber, pair.a, pair.b);
    };
    return std::sort(found, found + count,
                     [&](const SegmentPair& p, const SegmentPair& q) { return key(p) < key(q); });
  }
  const auto keyOf = [&](const SegmentPair& pair) {
    const FiberSegment p = a.placeOf(pair.a), q = b.placeOf(pair.b);
    const Key fibers = Key{p.fiber} << fiber_b | Key{q.fiber};
    return (fibers << number_a | Key{p.number}) << number_b | Key{q.number};
  };
  sortByKey(found, count, fiber_a + fiber_b + number_a + number_b, keyOf, [&](Key key) {
    const auto q = static_cast<std::int32_t>(take(key, number_b));
    const auto p = static_cast<std::int32_t>(take(key, number_a));
    const std::size_t of_b = take(key, fiber_b);
    return SegmentPair{a.beginOf(static_cast<std::size_t>(key)) + p, b.beginOf(of_b) + q};
  });
}

void sortFound(TrianglePair* found, std::size_t count) { sortPairs(found, count); }
void sortFound(std::int32_t* found, std::size_t count) { std::sort(found, found + count); }

}  // namespace fcl_fibers::arrays
