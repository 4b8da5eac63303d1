// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_tree.h>

#include "support/assembly.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {

/// What a program hands over: arrays to a FiberTree, or FCL objects to a manager.
enum class Form { kArrays, kObjects };

/// Both kinds of volumes, both topologies and both reports.
std::vector<FiberTreeOptions> allKinds(double margin = 0);
std::string describe(Form form, const FiberTreeOptions& options);

/// What a tree has been through before it is asked.
enum class History {
  kNew,      ///< built from all fibers at once
  kUpdated,  ///< built when all fibers were elsewhere
  kGrown,    ///< built and asked when half of the fibers were missing; the rest came one by one
  kLate,  ///< the same of the last 8 objects, which a manager keeps beside its tree; arrays: kGrown
};

/// Which query a manager is asked; of arrays there is the first only.
enum class Query {
  kCollide,
  kDistance,  ///< by a callback that lowers nothing, so that it is to see every pair
};

/// How objects of another specimen are handed to a query; arrays are as in a manager.
enum class Partner {
  kManager,     ///< in a manager of their own
  kEachObject,  ///< each by itself, in none
};

/// An assembly in one of its forms, to be asked for its pairs in many ways.
template <typename S>
class Specimen {
 public:
  Specimen(const Assembly<S>& fibers, Form form);
  ~Specimen();

  /// The capsules as the library is given them: those of objects have the rounding of their poses.
  const TouchOracle& truth() const { return truth_; }

  /// FCL's objects, of Form::kObjects, as they are numbered; for other managers.
  std::vector<fcl::CollisionObject<S>*> objects() const;
  /// The capsules of these objects as they are now, if they have been moved.
  std::vector<GivenCapsule> capsules() const;

  /// Self-collision of a tree of its own, in the order of the report.
  std::vector<NumberPair> pairs(const FiberTreeOptions& options, History history = History::kNew,
                                Query query = Query::kCollide) const;

  /// Collision of a tree of this specimen's with one of another's, which is of the same form;
  /// objects may have another topology.
  std::vector<NumberPair> pairsWith(const Specimen& other, const FiberTreeOptions& options,
                                    const FiberTreeOptions& other_options,
                                    Partner partner = Partner::kManager,
                                    Query query = Query::kCollide) const;

 private:
  struct Objects;
  std::int32_t numberOf(std::int32_t point) const;

  const Assembly<S>& fibers_;
  std::vector<std::int32_t> number_of_point_;
  std::unique_ptr<Objects> objects_;  ///< none for arrays
  TouchOracle truth_;
};

extern template class Specimen<float>;
extern template class Specimen<double>;

/// What a list of pairs is worth.
struct Findings {
  std::size_t reported = 0;
  std::size_t touching = 0;    ///< of all pairs there are
  std::size_t missed = 0;      ///< of those
  std::size_t repeated = 0;    ///< or of a capsule with itself, or with one that there is not
  std::size_t unpromised = 0;  ///< further apart than the report allows
  std::string first_wrong;

  /// Share of pairs reported that do not touch.
  double falseRate() const {
    return reported == 0 ? 0
                         : static_cast<double>(reported - (touching - missed)) /
                               static_cast<double>(reported);
  }
  bool isRight() const { return missed == 0 && repeated == 0 && unpromised == 0; }
};

/// All pairs that touch, in ascending order.
std::vector<NumberPair> touchingPairs(const TouchOracle& truth, double margin = 0);

/// Of pairs in any order and sense, none of which is to be ignored; see isPromised().
/// @param touching  touchingPairs(truth, options.margin)
Findings examine(const TouchOracle& truth, const std::vector<NumberPair>& touching,
                 const FiberTreeOptions& options, std::vector<NumberPair> reported);

}  // namespace fcl_fibers::test
