// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_questions.h>

#include "arrays.h"

namespace fcl_fibers::python {

// What queries find, as NumPy has it.

/// Where a field is in a struct that has a base class.
template <class Struct, class Base, class Field>
std::size_t offsetIn(Field Base::*field) {
  static const Struct kStruct{};
  return static_cast<std::size_t>(reinterpret_cast<const char*>(&(kStruct.*field)) -
                                  reinterpret_cast<const char*>(&kStruct));
}

using Fields = std::vector<std::tuple<const char*, const char*, std::size_t>>;

inline Fields bareFields() {
  const std::size_t pair = offsetof(BareContact, pair);
  return {{"a", "i4", pair + offsetof(SegmentPair, a)},
          {"b", "i4", pair + offsetof(SegmentPair, b)},
          {"layout", "u4", offsetof(BareContact, layout)},
          {"s", "f8", offsetof(BareContact, s)},
          {"t", "f8", offsetof(BareContact, t)},
          {"distance", "f8", offsetof(BareContact, distance)},
          {"normal", "3f8", offsetof(BareContact, normal)}};
}

inline py::dtype bareType() { return structType<BareContact>(bareFields()); }

inline py::dtype contactType() {
  const std::size_t a = offsetIn<Contact>(&Contact::a), b = offsetIn<Contact>(&Contact::b);
  const std::size_t fiber = offsetof(FiberSegment, fiber), number = offsetof(FiberSegment, number);
  Fields fields = bareFields();
  fields.insert(fields.end(), {{"fiber_a", "i8", a + fiber},
                               {"number_a", "i8", a + number},
                               {"fiber_b", "i8", b + fiber},
                               {"number_b", "i8", b + number},
                               {"point_a", "3f8", offsetIn<Contact>(&Contact::point_a)},
                               {"point_b", "3f8", offsetIn<Contact>(&Contact::point_b)}});
  return structType<Contact>(fields);
}

template <class Struct>
Fields shapeFields() {
  const std::size_t place = offsetIn<Struct>(&Struct::place);
  return {{"segment", "i4", offsetIn<Struct>(&Struct::segment)},
          {"layout", "u4", offsetIn<Struct>(&Struct::layout)},
          {"fiber", "i8", place + offsetof(FiberSegment, fiber)},
          {"number", "i8", place + offsetof(FiberSegment, number)},
          {"s", "f8", offsetIn<Struct>(&Struct::s)},
          {"distance", "f8", offsetIn<Struct>(&Struct::distance)},
          {"point_a", "3f8", offsetIn<Struct>(&Struct::point_a)},
          {"point_b", "3f8", offsetIn<Struct>(&Struct::point_b)},
          {"normal", "3f8", offsetIn<Struct>(&Struct::normal)}};
}

inline py::dtype shapeContactType() {
  return structType<ShapeContact>(shapeFields<ShapeContact>());
}

inline py::dtype meshContactType() {
  Fields fields = shapeFields<MeshContact>();
  fields.insert(fields.end(), {{"triangle", "i4", offsetIn<MeshContact>(&MeshContact::triangle)},
                               {"solid", "?", offsetIn<MeshContact>(&MeshContact::solid)},
                               {"weights", "3f8", offsetIn<MeshContact>(&MeshContact::weights)}});
  return structType<MeshContact>(fields);
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

inline py::dtype fiberPairType() {
  return structType<FiberPair>({{"fiber_a", "i8", offsetof(FiberPair, a)},
                                {"fiber_b", "i8", offsetof(FiberPair, b)},
                                {"begin", "i8", offsetof(FiberPair, begin)},
                                {"end", "i8", offsetof(FiberPair, end)},
                                {"count", "i8", offsetof(FiberPair, count)},
                                {"deepest", "i8", offsetof(FiberPair, deepest)}});
}

inline py::dtype shapeImpactType() {
  return structType<ShapeImpact>({{"segment", "i4", offsetof(ShapeImpact, segment)},
                                  {"time", "f8", offsetof(ShapeImpact, time)}});
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
  } else if constexpr (std::is_same_v<Found, ShapeImpact>) {
    return toArray(std::move(all), shapeImpactType());
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
