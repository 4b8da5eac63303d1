// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "tools/seconds.h"
#include "tools/trade/judge.h"

namespace fcl_fibers::tools::trade {

/// Ends a query that takes too long or finds too much.
class Deadline {
 public:
  /// @param seconds  of what is timed
  explicit Deadline(double seconds) : seconds_(seconds) {}

  void start();  ///< counts from now on
  void pause();
  /// Whether a query that has found so many pairs, and looked at so many, is to end. It looks at
  /// the clock now and then.
  bool isOver(std::size_t found, std::size_t seen);
  bool isOver(std::size_t found) { return isOver(found, found); }
  bool wasOver() const { return was_over_; }

 private:
  double seconds_, end_ = 0;
  bool was_over_ = false;
};

/// The seconds of work that a deadline counts.
template <class Work>
double timed(Deadline& deadline, Work&& work) {
  deadline.start();
  const double taken = seconds(work);
  deadline.pause();
  return taken;
}

/// One way to ask what touches, with all that it keeps between two frames.
class Trial {
 public:
  virtual ~Trial() = default;

  /// Reads the fibers and finds what touches.
  /// @return the seconds that both took together
  virtual double frame(Deadline& deadline) = 0;

  /// What the last frame found, ascending, each pair once, in the names of the trial.
  virtual std::vector<Touch> found() const = 0;

  /// That it holds; 0 if nobody tells.
  virtual std::size_t bytes() const = 0;
};

/// What a dial is turned to.
struct Setting {
  std::string dial;         ///< what is turned, as in `sampling`
  std::string value;        ///< what it is turned to, as in `every 4th point`
  std::string cpp, python;  ///< lines that set it
  std::function<std::unique_ptr<Trial>()> make;
  /// By first point of a segment of the scene: the segment of the trial that it is a part of. Null
  /// if they are the same.
  std::shared_ptr<const std::vector<std::int32_t>> segment_of{};

  std::string name() const { return dial + ": " + value; }
};

/// The ways in which the library can be asked about a scene: first what the tree does by default
/// with neighbours left out as the scene needs it, then one dial after the other turned from there.
/// The scene has to outlive them.
std::vector<Setting> settingsOf(const Scene& scene, const Verdict& verdict);

/// The default of settingsOf(): that of a tree, with pairs along a thick fiber left out as far as
/// one length does that without leaving out a contact.
FiberTreeOptions defaultOptions(const Scene& scene, const Verdict& verdict);

/// The half of a sum of radii that a pair's errors are told in.
double radiusOf(const FiberPolylines& fibers, const Touch& touch);

/// Errors of what was found and is a contact.
struct Errors {
  double median = 0, worst = 0;
  std::size_t count = 0;
};

/// What a setting costs and misses.
struct Outcome {
  bool is_ended = false;     ///< by the deadline; then there is no more than the bytes
  double seconds = 0;        ///< of a frame, median
  double low = 0, high = 0;  ///< quartiles of these
  double times = 0;          ///< of the default's frames, which took turns with these
  std::size_t bytes = 0;     ///< 0 if nobody tells
  std::size_t reported = 0;
  std::size_t contacts = 0, missed = 0;    ///< of those judged
  std::size_t judged = 0, wrong = 0;       ///< pairs reported that were judged, and are no contact
  double missed_share = 0;                 ///< of all contacts, as the sample tells
  double false_share = 0;                  ///< of all pairs reported, as the sample tells
  double most_missed = 0, most_false = 0;  ///< no larger share, with 97.5 % confidence
  Errors depth, normal, place;             ///< radii, degrees, radii
};

/// The share of all contacts that a setting misses at most, with 97.5 % confidence, if it misses
/// none of the sample (Wilson, Probable inference, 1927).
double mostHidden(const Verdict& verdict);

/// What a setting found, beside the truth. Where it has segments of its own, a contact is found if
/// the two segments that have it are reported, or some beside them.
Outcome compare(const Scene& scene, const Verdict& verdict, const Setting& setting,
                const std::vector<Touch>& found);

}  // namespace fcl_fibers::tools::trade
