// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace fcl_fibers::live {

/// Chooses how far beyond what touches pairs are listed, and when all are listed anew. A wide skin
/// lasts long, and each update tests more pairs. If motion is so fast that no list pays, each
/// update searches, and now and then one measures whether that is still so. What a list has cost in
/// fact is counted, too: if searches had cost less, updates search for a while. It decides by
/// counts and lengths alone, so equal calls lead to equal choices.
///
/// Lengths are in units of the usual distance of two axes that touch. Costs are in tests of a
/// listed pair.
class Skin {
 public:
  /// @param is_chosen  whether the skin is not given
  explicit Skin(bool is_chosen) : is_chosen_(is_chosen) {}

  bool isChosen() const { return is_chosen_; }
  bool knowsSpeed() const { return speed_ >= 0; }

  /// Tells how many segments the last search had, and how many pairs with overlapping volumes.
  void setSearch(std::size_t segments, std::size_t seen);
  /// Tells how many segments the last search for what touches a mesh had, and about how many touch.
  void setMeshSearch(std::size_t segments, std::size_t touching);
  /// Tells how many pairs that search has found, and how many of them touch.
  void setFound(std::size_t listed, std::size_t touching);
  /// Tells by how much segments that are near each other have come nearer in `age` updates.
  void setApproach(double approach, std::int64_t age);
  /// Tells about how many nodes an update with a list has compared, and how many it tests.
  void setUpdate(std::int64_t asked, std::size_t tests);

  /// Returns the skin of the search that comes next: 0 if it makes no list.
  /// @param is_used_up  whether the last list has served until too little of its skin was left
  double next(bool is_used_up);

  /// Whether the next update has to measure the speed, after a search that made no list.
  bool wantsSpeed() const;

  /// Whether the last update with the list has cost more than updates did in the mean since the
  /// list was made. As each one costs more than that before, a new list costs less.
  bool isWorn() const { return last_update_ * served_ > spent_; }

  /// How many nodes an update may compare before it lists all pairs instead. Few if
  /// a storm has begun, so that what it asks in vain costs little beside a search.
  std::int64_t mostAsked() const;

 private:
  /// What a search without a skin costs.
  double costOfSearch() const { return plain_ > 0 ? plain_ : search_; }
  double costOf(double skin, double speed) const;
  double rest(std::int64_t& updates, std::int64_t most);

  bool is_chosen_;
  double speed_ = -1;    ///< negative if it is not known
  double expected_ = 0;  ///< what it was when the list was made
  double approach_ = 0;  ///< since then
  /// The share of a skin that is used up when its list dies. It is less than 1 where few segments
  /// are much faster than others.
  double used_ = 0.7;
  double last_ = 0;  ///< what next() returned last
  double listed_skin_ = 0;
  /// What updates with lists of each skin have cost in the mean at about this speed; 0 if there
  /// were none.
  static constexpr int kSkins = 7;
  std::array<double, kSkins> costs_{};
  double segments_ = 0;
  double asked_ = 0;                ///< the mean of nodes that updates with the last list compared
  double search_ = 0;               ///< what the last search cost
  double plain_ = 0;                ///< what the last one without a skin cost; 0 before one
  double spent_ = 0;                ///< what the last list has cost, and its listing
  double served_ = 0;               ///< updates for which that was
  double last_update_ = 0;          ///< the last of them
  double near_ = 0, touching_ = 0;  ///< near: listed, and apart

  // Updates that search before the speed is measured again.
  static constexpr std::int64_t kFirstRest = 4, kFirstLongRest = 16;
  std::int64_t rest_ = 0;
  int in_vain_ = 0;                               ///< how many of the last lists did not pay
  std::int64_t next_rest_ = kFirstRest;           ///< after too fast a motion
  std::int64_t next_long_rest_ = kFirstLongRest;  ///< after a list that did not pay
};

}  // namespace fcl_fibers::live
