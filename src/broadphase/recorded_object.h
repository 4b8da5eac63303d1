// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

namespace fcl_fibers::broadphase {

/// The numbers of a shape, by which it is compared, written and made again.
struct RecordedShape {
  std::string kind;                   ///< such as "capsule"
  std::vector<double> numbers;        ///< its sizes, or its points one after the other
  std::vector<std::int64_t> indices;  ///< three for each triangle, or the faces of fcl::Convex
  std::array<double, 10> bounds{};    ///< aabb_local's least and largest corner, centre, radius

  std::size_t number = 0;                                         ///< in the record
  mutable std::shared_ptr<fcl::CollisionGeometry<double>> exact;  ///< kept by gapBetween()

  bool isRound() const { return kind == "capsule" || kind == "sphere"; }
  bool isOpen() const { return kind == "plane" || kind == "halfspace"; }
};

using RecordedBox = std::array<double, 6>;  ///< a least and a largest corner

/// An object as a manager may read it.
struct RecordedState {
  std::shared_ptr<const RecordedShape> shape;
  std::array<double, 12> pose{};  ///< the rows of the rotation and, behind each, the translation
  RecordedBox box{};              ///< getAABB()
};

/// Whether they agree to the last bit.
///@{
bool isSame(const RecordedShape& a, const RecordedShape& b);
bool isSame(const RecordedState& a, const RecordedState& b);
///@}

/// All that FCL's broad phase knows of a shape without a kind of its own, such as an octree, is its
/// local box, so such a shape is its bounds and a name.
template <typename S>
RecordedShape recordedShape(const fcl::CollisionGeometry<S>* shape);

/// Makes the shape, with its bounds. Throws std::invalid_argument if the numbers are not those of
/// such a shape.
template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeShape(const RecordedShape& recorded);

/// An object that is as one was, also in its box.
template <typename S>
class RecordedObject final : public fcl::CollisionObject<S> {
 public:
  using Shape = std::shared_ptr<fcl::CollisionGeometry<S>>;

  RecordedObject(const Shape& shape, const RecordedState& state) : fcl::CollisionObject<S>(shape) {
    set(shape, state);
  }
  void set(const Shape& shape, const RecordedState& state);
  const RecordedState& state() const { return state_; }

 private:
  RecordedState state_;
};

/// Bounds of the distance of two surfaces, which is negative where the shapes overlap.
struct Gap {
  double low, high;
};

/// Bounds the distance of two objects where they are recorded: that of capsules and spheres in
/// closed form, that of planes by what a shape reaches, that of others by FCL's narrow phase in
/// double. What FCL's boxes may lose, as they are computed in float or double, is within the
/// bounds. Shapes further apart than `reach` may have any upper bound. Nothing is known of numbers
/// that are not finite.
Gap gapBetween(const RecordedState& a, const RecordedState& b, bool is_float, double reach);

RecordedBox hullOf(const RecordedState& state);  ///< around an object's ball and its getAABB()
/// By how much two boxes are apart on the axis on which they are furthest apart.
double boxesApart(const RecordedBox& a, const RecordedBox& b);

/// Appends a blank and the number, as an integer and a power of two such as ` 3p-2`, which comes
/// back to the last bit in every locale.
void appendNumber(std::string& text, double number);
/// Reads what appendNumber() writes. Returns whether the whole word is a number.
bool readNumber(std::string_view word, double& number);

std::string describe(const RecordedState& state);  ///< in words, for people

}  // namespace fcl_fibers::broadphase
