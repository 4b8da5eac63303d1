// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/recorded_object.h"

namespace fcl_fibers::broadphase {

// A record is a text with one call, object or shape a line, in the order of the program:
//
//     fcl_fibers record 1
//     scalar double
//     first fcl::DynamicAABBTreeCollisionManager<double>
//     second boxes 0 0 0 0 0 1 0            options, see managerLine()
//     shape 0 capsule 1p-3 1 / / BOUNDS     sizes or points / indices / bounds
//     object 0 0 POSE BOX                   its number, its shape, twelve and six numbers
//     registerObjects 0 1 2
//     update
//     collide self stopped 17               the callback ended it at this pair
//     difference TEXT                       what it was written for
//     end
//
// Shapes and objects are written again when they have changed.
constexpr char kRecordHead[] = "fcl_fibers record 1";

/// The words for a manager: `boxes` or `spheres` with the options of a FiberCollisionManager, or
/// the name of another class. Threads are left out, as no pair depends on them.
template <typename S>
std::string managerLine(const fcl::BroadPhaseCollisionManager<S>& manager);

/// Makes the change of this name in the manager. Throws std::invalid_argument if there is none.
template <typename S>
void makeChange(fcl::BroadPhaseCollisionManager<S>& manager, std::string_view call,
                const std::vector<fcl::CollisionObject<S>*>& objects);

/// The lines of a record, in memory.
class Record {
 public:
  /// @param is_kept  if not, nothing is
  explicit Record(bool is_kept) : is_kept_(is_kept) {}

  void append(const std::string& line);
  void clear();
  std::size_t bytes() const { return bytes_; }
  /// Writes a file of these lines and the given ones, whole or not at all. Throws
  /// std::runtime_error if that fails.
  void write(const std::string& path, const std::string& head, const std::string& last) const;

 private:
  bool is_kept_;
  std::vector<std::string> blocks_;  // A single text would be copied as it grows.
  std::size_t bytes_ = 0;
};

std::string shapeLine(const RecordedShape& shape);
std::string objectLine(std::size_t number, const RecordedState& state);

}  // namespace fcl_fibers::broadphase
