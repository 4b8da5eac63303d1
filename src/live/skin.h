// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace fcl_fibers::live {

/// Chooses how far beyond what touches pairs are listed. A wide skin lasts long, and each update
/// tests more pairs. If motion is so fast that no list pays, each update searches, and now and then
/// one measures whether that is still so. It decides by counts and lengths alone, so equal calls
/// lead to equal choices.
///
/// Lengths are in units of the usual distance of two axes that touch. Costs are in tests of a
/// listed pair.
class Skin {
 public:
  /// @param is_chosen  whether the skin is not given
  explicit Skin(bool is_chosen) : is_chosen_(is_chosen) {}

  bool isChosen() const { return is_chosen_; }

  /// Tells how many segments the last search had, and how many pairs with overlapping volumes.
  void setSearch(std::size_t segments, std::size_t seen);
  /// Tells how many segments the last search for what touches a mesh had, and about how many touch.
  void setMeshSearch(std::size_t segments, std::size_t touching);
  /// Tells how many pairs that search has found, and how many of them touch.
  void setFound(std::size_t listed, std::size_t touching);
  /// Tells by how much segments that are near each other come nearer in an update.
  void setSpeed(double speed) { speed_ = speed; }
  /// Tells about how many pairs of nodes an update has asked.
  void setAsked(double asked) { asked_ += (asked - asked_) / 4; }

  /// Returns the skin of the search that comes next: 0 if it makes no list.
  double next();

  /// Whether the next update has to measure the speed, after a search that made no list.
  bool wantsSpeed() const;

  /// What a search without a skin costs.
  double costOfSearch() const { return search_; }

 private:
  double costOf(double skin, double speed) const;

  bool is_chosen_;
  double speed_ = -1;  ///< negative if it is not known
  double last_ = 0;    ///< what next() returned last
  double listed_skin_ = 0;
  double segments_ = 0, search_ = 0, asked_ = 0;
  double near_ = 0, touching_ = 0;         ///< near: listed, and apart
  std::int64_t rest_ = 0, next_rest_ = 4;  ///< updates that search before it asks again
};

}  // namespace fcl_fibers::live
