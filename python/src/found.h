// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_questions.h>

#include "arrays.h"

namespace fcl_fibers::python {

// What queries find, as NumPy has it.

inline py::dtype contactType() {
  const std::size_t a = offsetof(Contact, a), b = offsetof(Contact, b);
  const std::size_t fiber = offsetof(FiberSegment, fiber),
                    segment = offsetof(FiberSegment, segment);
  return structType<Contact>({{"fiber_a", "i8", a + fiber},
                              {"segment_a", "i8", a + segment},
                              {"fiber_b", "i8", b + fiber},
                              {"segment_b", "i8", b + segment},
                              {"s", "f8", offsetof(Contact, s)},
                              {"t", "f8", offsetof(Contact, t)},
                              {"distance", "f8", offsetof(Contact, distance)},
                              {"point_a", "3f8", offsetof(Contact, point_a)},
                              {"point_b", "3f8", offsetof(Contact, point_b)},
                              {"normal", "3f8", offsetof(Contact, normal)}});
}

inline py::dtype meshContactType() {
  const std::size_t a = offsetof(MeshContact, a);
  return structType<MeshContact>({{"fiber", "i8", a + offsetof(FiberSegment, fiber)},
                                  {"segment", "i8", a + offsetof(FiberSegment, segment)},
                                  {"triangle", "i4", offsetof(MeshContact, triangle)},
                                  {"s", "f8", offsetof(MeshContact, s)},
                                  {"weights", "3f8", offsetof(MeshContact, weights)},
                                  {"distance", "f8", offsetof(MeshContact, distance)},
                                  {"solid", "?", offsetof(MeshContact, solid)},
                                  {"point_a", "3f8", offsetof(MeshContact, point_a)},
                                  {"point_b", "3f8", offsetof(MeshContact, point_b)},
                                  {"normal", "3f8", offsetof(MeshContact, normal)}});
}

inline py::dtype impactType() {
  return structType<Impact>({{"a", "i4", offsetof(Impact, pair) + offsetof(SegmentPair, a)},
                             {"b", "i4", offsetof(Impact, pair) + offsetof(SegmentPair, b)},
                             {"time", "f8", offsetof(Impact, time)},
                             {"s", "f8", offsetof(Impact, s)},
                             {"t", "f8", offsetof(Impact, t)}});
}

inline py::dtype meshImpactType() {
  const std::size_t pair = offsetof(MeshImpact, pair);
  return structType<MeshImpact>({{"segment", "i4", pair + offsetof(TrianglePair, segment)},
                                 {"triangle", "i4", pair + offsetof(TrianglePair, triangle)},
                                 {"time", "f8", offsetof(MeshImpact, time)}});
}

static_assert(sizeof(SegmentPair) == 2 * sizeof(std::int32_t) &&
              sizeof(TrianglePair) == 2 * sizeof(std::int32_t));

/// What a query finds, as NumPy has it: pairs as rows, segments as numbers, impacts as structs.
template <class Found>
py::array toNumPy(std::vector<Found>&& all) {
  if constexpr (std::is_same_v<Found, Impact>) {
    return toArray(std::move(all), impactType());
  } else if constexpr (std::is_same_v<Found, MeshImpact>) {
    return toArray(std::move(all), meshImpactType());
  } else {
    return toArray(std::move(all), py::dtype::of<std::int32_t>(),
                   std::is_same_v<Found, std::int32_t> ? 0 : 2);
  }
}

/// Returns the structs of an array that a query returned.
template <typename Struct>
std::vector<Struct> fromArray(const py::array& array, const py::dtype& type) {
  if (!array.dtype().equal(type) || array.ndim() != 1 ||
      (array.flags() & py::array::c_style) == 0) {
    throw py::type_error("impacts are not an array that impacts() returned");
  }
  const auto* const begin = static_cast<const Struct*>(array.data());
  return std::vector<Struct>(begin, begin + array.size());
}

}  // namespace fcl_fibers::python
