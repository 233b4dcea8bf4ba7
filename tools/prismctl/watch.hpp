// SPDX-License-Identifier: MIT
// State and layout of the live screen of `prismctl watch`, without input or output.
#pragma once

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace prism::prismctl {

struct Size {
  int columns = 80, rows = 24;
};

enum class Colour { kPlain, kFaint, kGood, kWarning, kBad, kCurve };

struct Line {
  std::string text;  ///< UTF-8, each character one column
  Colour colour = Colour::kPlain;
};

/// The window's means of the last day, in order of time.
class Trace {
 public:
  /// Adds the params of a window notification; means of a window that is not full are noisy and not drawn. A row that
  /// is older than the last one (after a clock step, or when history is read again) replaces all points from its time
  /// on.
  void push(const nlohmann::json& row);

  /// A curve of `span_s` until `end_s` in braille dots (2 × 4 per character): `rows` (>= 2) lines of `columns` (> 21),
  /// with `name` and the largest value at the left of the first, the quantity and the smallest value at the left of the
  /// last. The quantity is the corrected rate, or the raw rate if no row in the span has one.
  std::vector<std::string> lines(const std::string& name, double end_s, double span_s, int columns, int rows) const;

 private:
  struct Point {
    double time_s;           ///< data time
    double rate, corrected;  ///< deg/h; NaN where unknown
  };
  std::deque<Point> points_;
};

/// Steady times are seconds of a monotonic clock. A status is current for 3 s; the screen shows no numbers from an
/// older one, or from one before a disconnect.
class Screen {
 public:
  explicit Screen(std::string instance) : instance_(std::move(instance)) {}

  void status(nlohmann::json status, double steady_s);
  /// The params of a window notification, or a row of the history. Call after status().
  void row(const nlohmann::json& row);
  void event(const nlohmann::json& event);
  /// prismd is disconnected or does not run; `why`: the reason.
  void gone(const std::string& why) { gone_ = why; }
  /// 1 to 5: the time span of the traces. Ignores others.
  void key(char key);

  /// Exactly `size.rows` lines of at most `size.columns` columns. `utc`: the clock of this machine, for the corner.
  std::vector<Line> lines(const Size& size, double steady_s, const std::string& utc) const;

 private:
  nlohmann::json current(double steady_s) const;
  std::vector<Line> traces(int columns, int rows, double now_s) const;

  std::string instance_, gone_;
  nlohmann::json status_;
  double status_steady_s_ = 0;
  double row_time_s_ = 0;                ///< data time of the last row
  std::map<std::string, Trace> traces_;  ///< of each axis of the status
  std::deque<Line> events_;              ///< newest last
  std::size_t span_ = 1;
};

}  // namespace prism::prismctl
