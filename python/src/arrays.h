// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

namespace fcl_fibers::python {

namespace py = pybind11;

/// A range of numbers or structs of a NumPy array.
template <typename T>
class Borrowed {
 public:
  explicit Borrowed(const py::array& array)
      : data_(static_cast<const T*>(array.data())),
        size_(static_cast<std::size_t>(array.shape(0))) {}

  const T* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  const T* data_;
  std::size_t size_;
};

/// Memory for structs, all of which are written later. A vector would write zeros first, on one
/// thread.
template <typename T>
class Unwritten {
 public:
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
  explicit Unwritten(std::size_t size) : memory_(::operator new(size * sizeof(T))), size_(size) {}

  T* data() { return static_cast<T*>(memory_.get()); }
  std::size_t size() const { return size_; }

 private:
  struct Free {
    void operator()(void* memory) const { ::operator delete(memory); }
  };
  std::unique_ptr<void, Free> memory_;
  std::size_t size_;
};

/// Makes a NumPy array that takes over the memory of a vector or the like, with no copy.
/// @param columns  of each row, or 0 for an array of one dimension
template <class Found>
py::array toArray(Found&& found, const py::dtype& type, std::size_t columns = 0) {
  static_assert(!std::is_reference_v<Found>, "it is moved from");
  auto kept = std::make_unique<Found>(std::move(found));
  std::vector<std::size_t> shape = {kept->size()};
  if (columns > 0) shape.push_back(columns);
  const void* const data = kept->data();
  const py::capsule owner(kept.get(), [](void* memory) { delete static_cast<Found*>(memory); });
  kept.release();
  return py::array(type, shape, {}, data, owner);
}

/// Returns the dtype of one of our structs; `fields` are (name, format, offset).
template <typename Struct>
py::dtype structType(const std::vector<std::tuple<const char*, const char*, std::size_t>>& fields) {
  static_assert(std::is_trivially_copyable_v<Struct>);
  py::list names, formats, offsets;
  for (const auto& [name, format, offset] : fields) {
    names.append(name);
    formats.append(format);
    offsets.append(offset);
  }
  return py::dtype(std::move(names), std::move(formats), std::move(offsets), sizeof(Struct));
}

/// Refuses what Python's side of the module never passes: another type, or elements apart.
/// @param columns  of each row, or 0 for an array of one dimension
template <typename T>
const T* requireArray(const char* name, const py::array& array, std::size_t columns = 0) {
  const bool fits = py::isinstance<py::array_t<T, py::array::c_style>>(array) &&
                    array.ndim() == (columns > 0 ? 2 : 1) &&
                    (columns == 0 || static_cast<std::size_t>(array.shape(1)) == columns);
  if (!fits) throw py::type_error(std::string(name) + " has another type, shape or order");
  return static_cast<const T*>(array.data());
}

/// What describes the fibers of a tree and stays the same over updates. It owns its numbers.
struct FiberLayout {
  std::vector<std::size_t> begin;
  std::vector<std::size_t> end;  ///< FiberArrays::point_end, and one more; empty if null
  std::vector<std::uint8_t> closed;
  std::vector<std::int32_t> groups;
  std::vector<std::uint32_t> meets, categories;
  std::vector<std::int32_t> root_segments;
  std::vector<std::int32_t> starts_at, ends_at;
};

/// The points and radii of fibers, which are arrays of the Python program. Both have the same type,
/// float32 or float64.
struct FiberNumbers {
  py::array points;   ///< (points, 3), with strides
  py::array radii;    ///< (1), (fibers) or (points)
  int radii_are = 0;  ///< FiberArrays::Radii

  bool isFloat() const { return py::isinstance<py::array_t<float>>(points); }

  /// Returns the same numbers as doubles, which float can be converted to without an error.
  FiberNumbers asDouble() const {
    if (!isFloat()) return *this;
    using Doubles = py::array_t<double, py::array::c_style>;
    const Doubles all[] = {Doubles::ensure(points), Doubles::ensure(radii)};
    if (!all[0] || !all[1]) throw std::bad_alloc();
    return {all[0], all[1], radii_are};
  }

  /// The arrays as C++ takes them. They are borrowed from this and the layout.
  template <typename S>
  FiberArrays<S> view(const FiberLayout& layout) const {
    using Radii = typename FiberArrays<S>::Radii;
    const auto orNull = [](const auto& numbers) {
      return numbers.empty() ? nullptr : numbers.data();
    };
    FiberArrays<S> arrays;
    if (!py::isinstance<py::array_t<S>>(points) || points.ndim() != 2 || points.shape(1) != 3) {
      throw py::type_error("points have another type or shape");
    }
    arrays.points = static_cast<const S*>(points.data());
    arrays.point_count = static_cast<std::size_t>(points.shape(0));
    if ((points.flags() & py::array::c_style) == 0) {
      arrays.point_stride = points.strides(0);
      arrays.axis_stride = points.strides(1);
    }
    arrays.point_begin = layout.begin.data();
    arrays.point_end = orNull(layout.end);
    arrays.fiber_count = layout.begin.size() - 1;
    arrays.radii = requireArray<S>("radii", radii);
    arrays.radii_are = static_cast<Radii>(radii_are);
    const std::size_t needed = arrays.radii_are == Radii::kOne        ? 1
                               : arrays.radii_are == Radii::kPerFiber ? arrays.fiber_count
                                                                      : arrays.point_count;
    if (static_cast<std::size_t>(radii.size()) != needed) {
      throw py::value_error("radii are " + std::to_string(radii.size()) + " numbers instead of " +
                            std::to_string(needed));
    }
    arrays.closed = orNull(layout.closed);
    arrays.groups = orNull(layout.groups);
    arrays.meets = orNull(layout.meets);
    arrays.categories = orNull(layout.categories);
    arrays.root_segments = orNull(layout.root_segments);
    arrays.starts_at = orNull(layout.starts_at);
    arrays.ends_at = orNull(layout.ends_at);
    return arrays;
  }
};

/// Calls use(FiberArrays<float or double>).
template <class Use>
auto withArrays(const FiberNumbers& numbers, const FiberLayout& layout, Use&& use) {
  return numbers.isFloat() ? use(numbers.view<float>(layout)) : use(numbers.view<double>(layout));
}

}  // namespace fcl_fibers::python
