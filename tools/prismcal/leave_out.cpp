// SPDX-License-Identifier: MIT
#include "tools/prismcal/leave_out.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::recordings {
namespace {

/// Smaller numbers are seconds since the start: 1e8 s since 1970 is in 1973.
constexpr double kSinceStart = 1e8;

tl::unexpected<Error> no_range(const std::string& range) {
  return make_error("--leave-out",
                    fmt::format("found \"{}\", expected FROM..TO, as 2026-11-23T09:11:00Z..2026-11-23T09:12:00Z or "
                                "7001..7031 (s)",
                                range));
}

}  // namespace

std::string end_of_second(std::int64_t second, bool is_date) {
  return is_date ? utc_text(second + 1) : fmt::format("{} s", second + 1);
}

std::string leave_out_range(std::int64_t first, std::int64_t last, bool is_date) {
  return is_date ? utc_text(first + 1) + ".." + utc_text(last + 1) : fmt::format("{}..{}", first + 1, last + 1);
}

Result<std::optional<LeaveOut::Time>> LeaveOut::parse_time(const std::string& text, const std::string& range) {
  if (text.empty()) return std::nullopt;
  if (const auto number = parse_number<double>(text)) return Time{*number, false};
  const auto date = tables::iso_time(text);
  if (!date) return no_range(range);
  return Time{static_cast<double>(date->ns) / 1e9, true};
}

Result<LeaveOut> LeaveOut::parse(const std::vector<std::string>& ranges) {
  LeaveOut leave_out;
  for (const std::string& text : ranges) {
    const std::size_t dots = text.find("..");
    if (dots == std::string::npos || text.size() == 2) return no_range(text);
    const auto from = parse_time(text.substr(0, dots), text), to = parse_time(text.substr(dots + 2), text);
    if (!from) return tl::unexpected<Error>(from.error());
    if (!to) return tl::unexpected<Error>(to.error());
    if (*from && *to && (*from)->is_date == (*to)->is_date && (*from)->s > (*to)->s)
      return make_error("--leave-out", fmt::format("found \"{}\", which ends before it begins", text));
    leave_out.ranges_.push_back({text, *from, *to});
  }
  return leave_out;
}

Result<void> LeaveOut::begin(std::int64_t first_second, bool is_date) {
  if (std::exchange(begun_, true)) return {};
  for (Range& range : ranges_) {
    for (const auto& time : {range.from, range.to}) {
      if (time && time->is_date && !is_date)
        return make_error("--leave-out", fmt::format("found the date \"{}\", expected seconds: the recording's times "
                                                     "have no date",
                                                     range.text));
    }
    const auto absolute = [&](const Time& time) {
      const bool since_start = is_date && !time.is_date && time.s < kSinceStart;
      return since_start ? static_cast<double>(first_second) + time.s : time.s;
    };
    range.from_s = range.from ? absolute(*range.from) : -HUGE_VAL;
    range.to_s = range.to ? absolute(*range.to) : HUGE_VAL;
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
