// SPDX-License-Identifier: MIT
// State and layout of the live screen, without input or output.
#pragma once

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/prismctl/screen/styled_text.hpp"
#include "tools/prismctl/screen/trace.hpp"

namespace prism::screen {

struct Size {
  int columns = 80, rows = 24;
};

/// Steady times are seconds of a monotonic clock. A status is current for 3 s; the screen shows no numbers from an
/// older one, or from one before a disconnect.
class View {
 public:
  View(std::string instance, bool utf8) : instance_(std::move(instance)), utf8_(utf8) {}

  void status(const nlohmann::json& status, double steady_s);
  /// The result of `history`. Call after status().
  void history(const nlohmann::json& result, double steady_s);
  void window(const nlohmann::json& row, double steady_s);
  /// Selects the axis of the charts, until a key selects another; the first axis if the name is unknown.
  void prefer(const std::string& axis) { preferred_ = axis; }
  /// Earlier events, oldest first.
  void events(const nlohmann::json& events);
  void event(const nlohmann::json& event);
  /// prismd is disconnected or does not run; `why`: the reason.
  void gone(const std::string& why) { gone_ = why; }

  /// Handles a key: 1 to 9, a, p, ?, Tab and the name of an axis. Ignores others.
  void key(char key, double steady_s);

  /// Exactly `size.rows` lines of at most `size.columns` columns. `utc`: the clock of this machine, shown in the
  /// corner.
  std::vector<Line> lines(const Size& size, double steady_s, const std::string& utc) const;

 private:
  bool alive(double steady_s) const;
  const nlohmann::json& axis_status(const std::string& axis) const;
  const std::string& charted() const;
  std::vector<Line> numbers_of_all(double steady_s) const;
  void choose(char key);
  Line head(double steady_s) const;
  Line why(double steady_s) const;
  std::vector<Line> numbers(double steady_s) const;
  std::vector<Line> charts(int columns, int rows, double steady_s) const;
  Line counters() const;
  std::vector<Line> last_events(std::size_t count) const;
  Line keys() const;
  double data_now_s(double steady_s) const;

  std::string instance_, gone_;
  bool utf8_;
  nlohmann::json status_;
  double status_steady_s_ = 0, row_steady_s_ = 0;
  std::string preferred_;
  std::vector<std::string> axes_;        ///< names, if there are several
  std::size_t chosen_ = 0;               ///< axis of the charts
  std::map<std::string, Trace> traces_;  ///< by axis; "" for a single axis
  std::deque<nlohmann::json> events_;

  std::size_t span_ = 3;
  bool same_scale_ = false, help_ = false;
  std::optional<double> paused_at_s_;  ///< data time of the charts' right edge
};

}  // namespace prism::screen
