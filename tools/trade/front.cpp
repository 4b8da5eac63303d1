// SPDX-License-Identifier: BSD-3-Clause
#include "tools/trade/front.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

namespace fcl_fibers::tools::trade {
namespace {

/// Times that differ by less are equal, as two runs differ by as much.
constexpr double kNoise = 1.05;

bool isAsGood(const Outcome& a, const Outcome& b) {
  return a.times <= kNoise * b.times && a.missed_share <= b.missed_share &&
         a.false_share <= b.false_share;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return result;
}

/// One diagram of the picture: shares over times.
class Panel {
 public:
  Panel(double left, std::string title, const std::vector<Row>& rows,
        const std::function<double(const Row&)>& share)
      : left_(left) {
    double least = 1e300, most = 0;
    for (const Row& row : rows) {
      if (row.outcome.is_ended) continue;
      least = std::min(least, row.outcome.seconds);
      most = std::max(most, row.outcome.seconds);
    }
    low_ = std::floor(std::log10(std::max(least, 1e-9)) * 2) / 2;
    high_ = std::max(std::ceil(std::log10(std::max(most, 1e-9)) * 2) / 2, low_ + 0.5);
    svg_ = fmt::format(
        "<text x=\"{:.0f}\" y=\"44\" font-weight=\"bold\">{}</text>\n"
        "<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" fill=\"none\" "
        "stroke=\"#999\"/>\n",
        left, title, left, kTop, kWidth, kHeight);
    for (const double percent : {0.0, 0.01, 0.1, 1.0, 10.0, 100.0}) {
      const double y = yOf(percent / 100);
      svg_ += fmt::format(
          "<line x1=\"{0:.0f}\" x2=\"{1:.0f}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/>"
          "<text x=\"{3:.0f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:g} %</text>\n",
          left, left + kWidth, y, left - 6, y + 4, percent);
    }
    for (double power = std::ceil(low_); power <= high_; ++power) {
      const double x = xOf(std::pow(10.0, power));
      svg_ += fmt::format(
          "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.0f}\" y2=\"{2:.0f}\" stroke=\"#ddd\"/>"
          "<text x=\"{0:.1f}\" y=\"{3:.0f}\" text-anchor=\"middle\">{4}</text>\n",
          x, kTop, kTop + kHeight, kTop + kHeight + 18, timeText(std::pow(10.0, power)));
    }
    // The front first, so that its numbers have room; a point below another one still shows.
    for (const bool on_front : {true, false}) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const Row& row = rows[i];
        if (row.outcome.is_ended || row.is_on_front != on_front) continue;
        if (i > 0 && showsNoDifference(row, rows.front())) continue;
        const double x = xOf(row.outcome.seconds), y = yOf(share(row));
        svg_ += fmt::format(
            "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"><title>{}: {}, {}</title>"
            "</circle>{}\n",
            x, y, on_front ? 5 : 3.5, on_front ? "#c33" : "#69c", escaped(row.dial),
            escaped(row.value), timeText(row.outcome.seconds), numberAt(x, y, i + 1));
      }
    }
  }

  const std::string& svg() const { return svg_; }

  static constexpr double kTop = 60, kWidth = 330, kHeight = 280;

 private:
  double xOf(double seconds) const {
    return left_ + kWidth * (std::log10(std::max(seconds, 1e-9)) - low_) / (high_ - low_);
  }
  /// Logarithmic from 0.01 % on, with room for 0 below.
  static double yOf(double share) {
    const double steps = share > 1e-5 ? std::log10(share) + 5 : 0;
    return kTop + kHeight - 12 - (kHeight - 24) * steps / 5;
  }

  /// Beside a point, where no other number is; or nothing, as pointing at it tells what it is.
  std::string numberAt(double x, double y, std::size_t number) {
    for (const double up : {4.0, -13.0, 15.0, -24.0, 26.0}) {
      const Point at = {x + 6, y - up, 0};
      const bool is_free = std::none_of(numbers_.begin(), numbers_.end(), [&](const Point& p) {
        return std::abs(p[0] - at[0]) < 15 && std::abs(p[1] - at[1]) < 10;
      });
      if (!is_free || at[1] < kTop + 8 || at[1] > kTop + kHeight - 2) continue;
      numbers_.push_back(at);
      return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"10\">{}</text>", at[0], at[1],
                         number);
    }
    return "";
  }

  double left_, low_, high_;
  std::string svg_;
  std::vector<Point> numbers_;  ///< where they are
};

}  // namespace

void markFront(std::vector<Row>& rows) {
  std::vector<Row*> by_time;
  for (Row& row : rows) {
    row.is_on_front = false;
    if (!row.outcome.is_ended) by_time.push_back(&row);
  }
  std::stable_sort(by_time.begin(), by_time.end(),
                   [](const Row* a, const Row* b) { return a->outcome.times < b->outcome.times; });
  // The fastest of those that are equal, and which of these is shown: the first in the table.
  struct Best {
    const Row* fastest;
    Row* shown;
  };
  std::vector<Best> front;
  for (Row* row : by_time) {
    const auto best = std::find_if(front.begin(), front.end(), [&](const Best& other) {
      return isAsGood(other.fastest->outcome, row->outcome);
    });
    if (best == front.end()) {
      front.push_back({row, row});
    } else if (row < best->shown && isAsGood(row->outcome, best->fastest->outcome)) {
      best->shown = row;
    }
  }
  for (const Best& best : front) best.shown->is_on_front = true;
}

bool showsNoDifference(const Row& row, const Row& usual) {
  const Outcome &a = row.outcome, &b = usual.outcome;
  const auto isEqual = [](double x, double y, double factor) {
    return x <= factor * y && y <= factor * x;
  };
  return !a.is_ended && a.reported == b.reported && a.missed == b.missed && a.wrong == b.wrong &&
         isEqual(a.times, b.times, 1.1) &&
         isEqual(static_cast<double>(a.bytes), static_cast<double>(b.bytes), 1.1) &&
         isEqual(a.depth.median, b.depth.median, 2);
}

const Row* choose(const std::vector<Row>& rows, const Wish& wish) {
  const Row* best = nullptr;
  for (const Row& row : rows) {
    const Outcome& outcome = row.outcome;
    const double missed = wish.missed > 0 ? outcome.most_missed : outcome.missed_share;
    const double wrong = wish.wrong > 0 ? outcome.most_false : outcome.false_share;
    const bool fits = !outcome.is_ended && missed <= wish.missed && wrong <= wish.wrong &&
                      (!wish.seconds || outcome.seconds <= *wish.seconds);
    if (fits && (best == nullptr || kNoise * outcome.times < best->outcome.times)) best = &row;
  }
  return best;
}

std::string timeText(double seconds) {
  const auto digits = [](double number) {
    return number >= 100 ? fmt::format("{:.0f}", number) : fmt::format("{:.3g}", number);
  };
  if (seconds < 1e-3) return digits(1e6 * seconds) + " us";
  return seconds < 1 ? digits(1e3 * seconds) + " ms" : digits(seconds) + " s";
}

std::string shareText(double share) { return fmt::format("{:.3g} %", 100 * share); }

std::string frontPicture(const std::string& title, const std::vector<Row>& rows) {
  const Panel missed(70, "contacts missed", rows,
                     [](const Row& row) { return row.outcome.missed_share; });
  const Panel wrong(500, "false among the pairs reported", rows,
                    [](const Row& row) { return row.outcome.false_share; });
  std::string legend;
  double y = Panel::kTop + Panel::kHeight + 50;
  const double top = y;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool is_left = i < (rows.size() + 1) / 2;
    if (i == (rows.size() + 1) / 2) y = top;
    const bool is_as_first = i > 0 && showsNoDifference(rows[i], rows.front());
    const char* const note = rows[i].outcome.is_ended ? " (ended)" : is_as_first ? " (as 1)" : "";
    legend += fmt::format("<text x=\"{}\" y=\"{:.0f}\"{}>{}  {}: {}{}</text>\n", is_left ? 70 : 500,
                          y, rows[i].is_on_front ? " fill=\"#c33\"" : "", i + 1,
                          escaped(rows[i].dial), escaped(rows[i].value), note);
    y += 16;
  }
  const double height = top + 16 * static_cast<double>((rows.size() + 1) / 2) + 10;
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"880\" height=\"{0:.0f}\" "
      "viewBox=\"0 0 880 {0:.0f}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      "<text x=\"70\" y=\"20\" font-size=\"14\">{1}: time of a frame, and what is wrong. Red: "
      "nothing is better in all.</text>\n{2}{3}{4}</svg>\n",
      height, escaped(title), missed.svg(), wrong.svg(), legend);
}

}  // namespace fcl_fibers::tools::trade
