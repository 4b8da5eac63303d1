// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "arrays/array_source.h"
#include "arrays/joints.h"
#include "fibers/fiber_table.h"
#include "index/segment_index.h"

namespace fcl_fibers::arrays {

/// Throws std::invalid_argument that names a call of FiberTree.
[[noreturn]] void refuse(const char* call, const std::string& what);

/// The fibers of a FiberTree and their index.
class FiberIndex {
 public:
  /// Throws std::invalid_argument if an option is out of range.
  explicit FiberIndex(const FiberTreeOptions& options);

  const FiberTreeOptions& options() const { return options_; }
  const fibers::FiberTable& table() const { return table_; }
  const index::SegmentIndex& operator*() const { return index_; }
  index::SegmentIndex& index() { return index_; }
  const index::SegmentIndex* operator->() const { return &index_; }
  std::size_t memoryUsage() const;

  /// See BareContact::layout; of the contacts with another index, if one is given.
  std::uint32_t layout(const FiberIndex* other = nullptr) const;

  template <typename S>
  void build(const FiberArrays<S>& fibers);
  /// @param start  null if the fibers rest
  template <typename S>
  void update(const FiberArrays<S>* start, const FiberArrays<S>& fibers);

  /// Whether the fibers have as many points as those of the index.
  template <typename S>
  bool hasFibersOf(const FiberArrays<S>& fibers) const;

  /// While anybody holds what it returns, an update leaves the volumes to the first search that
  /// needs them.
  std::shared_ptr<const void> watch() const { return watch_; }

  /// The number of the last build() or update() that was not refused, of all indexes.
  std::uint64_t updateNumber() const { return update_number_; }
  /// The number of the last build() of these, which may give the names of segments to others.
  std::uint64_t buildNumber() const { return build_number_; }

  /// See FiberTree::segments().
  std::vector<std::int32_t> segments() const;

  /// See FiberTree::volumes().
  std::vector<TreeVolume> volumes(int depth) const;

  /// Tells what is missing for a query, or returns null if nothing is.
  const char* problem(bool needs_capsules = false, bool needs_step = false) const;

 private:
  fibers::FiberTable emptyTable() const;
  void beginChange();
  template <typename S>
  void rebuild(const char* call, const ArraySource<S>& source, fibers::FiberTable* table,
               Joints joints = {});
  template <typename S>
  void refit(const char* call, const ArraySource<S>& source, bool may_wait);

  FiberTreeOptions options_;
  fibers::FiberTable table_;
  Joints joints_;
  index::SegmentIndex index_;
  std::uint32_t layout_ = 0;
  bool is_valid_ = true;  ///< false after a build or an update has thrown
  std::uint64_t build_number_ = 0, update_number_ = 0;
  std::shared_ptr<const void> watch_ = std::make_shared<char>();
};

}  // namespace fcl_fibers::arrays
