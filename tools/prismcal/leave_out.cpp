// SPDX-License-Identifier: MIT
#include "tools/prismcal/leave_out.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::recordings {
std::string end_of_second(std::int64_t second, bool is_date) {
  return is_date ? utc_text(second + 1) : fmt::format("{} s", second + 1);
}

std::string leave_out_range(std::int64_t first, std::int64_t last, bool is_date) {
  return is_date ? utc_text(first + 1) + ".." + utc_text(last + 1) : fmt::format("{}..{}", first + 1, last + 1);
}

LeaveOut::LeaveOut(const std::vector<std::string>& ranges) {
  for (const std::string& text : ranges) ranges_.push_back({text});
}

Result<void> LeaveOut::begin(std::int64_t first_second, bool is_date) {
  if (std::exchange(begun_, true)) return {};
  const auto seconds_of = [&](const std::string& text, double open) -> std::optional<double> {
    constexpr double kSinceStart = 1e8;  // smaller numbers are seconds since the start: 1e8 s since 1970 is in 1973
    if (text.empty()) return open;
    if (const auto number = parse_number<double>(text))
      return is_date && *number < kSinceStart ? *number + static_cast<double>(first_second) : *number;
    const auto date = tables::iso_time(text);
    return date && is_date ? std::optional(static_cast<double>(date->ns) / 1e9) : std::nullopt;
  };
  for (Range& range : ranges_) {
    const std::size_t dots = range.text.size() > 2 ? range.text.find("..") : std::string::npos;
    const bool has_dots = dots != std::string::npos;
    const auto from_s = has_dots ? seconds_of(range.text.substr(0, dots), -HUGE_VAL) : std::nullopt,
               to_s = has_dots ? seconds_of(range.text.substr(dots + 2), HUGE_VAL) : std::nullopt;
    if (!from_s || !to_s)
      return make_error("--leave-out",
                        fmt::format("found \"{}\", expected FROM..TO, as {}", range.text,
                                    is_date ? "2026-11-23T09:11:00Z..2026-11-23T09:12:00Z or 7001..7031 (s)"
                                            : "7001..7031 (s): the recording's times have no date"));
    if (*from_s > *to_s)
      return make_error("--leave-out", fmt::format("found \"{}\", which ends before it begins", range.text));
    range.from_s = *from_s, range.to_s = *to_s;
  }
  return {};
}

bool LeaveOut::contains(std::int64_t second) {
  const auto begin = static_cast<double>(second);
  const bool counted_before = last_ == second;
  last_ = second;
  bool any = false;
  for (Range& range : ranges_) {
    if (begin + 1 < range.from_s || begin >= range.to_s) continue;
    range.seconds += !counted_before;
    any = true;
  }
  return any;
}

std::vector<std::string> LeaveOut::unmatched() const {
  std::vector<std::string> texts;
  for (const Range& range : ranges_) {
    if (range.seconds == 0) texts.push_back(range.text);
  }
  return texts;
}

std::vector<std::string> LeaveOut::notes() const {
  std::vector<std::string> notes;
  for (const Range& range : ranges_)
    notes.push_back(fmt::format("--leave-out {}: {} left out", range.text, counted(range.seconds, "second")));
  return notes;
}

}  // namespace prism::recordings
