// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/table_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "compensation/second_averager.hpp"

namespace prism::recordings {
namespace {

using Reason = compensation::Rejection::Reason;

constexpr std::array<const char*, 3> kNames = {"rate", "temperature", "uhfo"}, kUnitNames = {"deg/h", "degC", "V"};

bool contains(const std::vector<SecondRange>& ranges, std::int64_t second) {
  const auto at = std::lower_bound(ranges.begin(), ranges.end(), second,
                                   [](const SecondRange& range, std::int64_t wanted) { return range.last < wanted; });
  return at != ranges.end() && at->first <= second;
}

}  // namespace

TableJudge::TableJudge() : plausibility_(compensation::PlausibilityLimits{}) {}

QuantitySet TableJudge::push(const Sample& sample, std::size_t line) {
  compensation::Rejections rejections;
  const QuantitySet implausible = plausibility_.implausible(sample);
  if (implausible.any()) plausibility_.explain(sample, implausible, rejections);
  const auto judge = [&](std::size_t quantity, double value, bool bad, const compensation::Rejection& why) {
    Count& count = counts_[quantity];
    if (std::isnan(value)) return;
    ++count.values;
    count.like_kelvin += like_kelvin(value);
    if (!bad) return;
    const std::int64_t second = compensation::second_number(sample.time_ns);
    for (std::size_t back = 1; back <= std::min<std::size_t>(2, count.rejected.size()); ++back) {
      Rejected& rejected = *(count.rejected.end() - static_cast<std::ptrdiff_t>(back));
      if (rejected.second == second && rejected.why.reason == why.reason) {
        ++rejected.values;
        return;
      }
    }
    count.rejected.push_back({second, 1, line, why});
  };
  judge(0, sample.rate_deg_per_h, implausible.rate, rejections.rate);
  judge(1, sample.temperature_degc, implausible.temperature, rejections.temperature);
  judge(2, sample.uhfo_v, implausible.uhfo, rejections.uhfo);
  return implausible;
}

/// "temperature: 23 of 14400 values implausible: 13 outside their limits, the first in line 12: …; 10 …". Empty: none.
Result<std::string> TableJudge::implausible_text(std::size_t quantity, const std::vector<SecondRange>& explained,
                                                 const std::string& path) const {
  const Count& count = counts_[quantity];
  std::array<Rejected, 2> sums;  // outside the limits, too fast
  for (const Rejected& rejected : count.rejected) {
    if (contains(explained, rejected.second)) continue;
    Rejected& sum = sums[rejected.why.reason == Reason::kTooFast];
    if (sum.values == 0) sum = {0, 0, rejected.first_line, rejected.why};
    sum.values += rejected.values;
  }
  const std::size_t implausible = sums[0].values + sums[1].values;
  if (implausible == 0) return std::string();
  std::string text = fmt::format("{}: {} of {} values implausible", kNames[quantity], implausible, count.values);
  const bool both = sums[0].values > 0 && sums[1].values > 0;
  for (const Rejected& sum : sums) {
    if (sum.values == 0) continue;
    if (both)
      text += fmt::format("{} {} {}", &sum == &sums[0] ? ":" : ";", sum.values,
                          &sum == &sums[0] ? "outside the limits" : "changed too fast");
    text += fmt::format(", the first in line {}: {}", sum.first_line,
                        compensation::rejection_text(sum.why, kUnitNames[quantity]));
  }
  if (quantity == 1 && 2 * count.like_kelvin > count.values)
    return make_error(path, text + "; looks like kelvin: --map temperature=COLUMN:K");
  if (100 * implausible > count.values) return make_error(path, text + "; expected at most 1 %");
  return text + "; left out";
}

Result<std::vector<std::string>> TableJudge::finish(const std::string& path, const JudgedSeconds& seconds) const {
  std::vector<std::string> notes;
  for (std::size_t q = 0; q < counts_.size(); ++q) {
    const auto text = implausible_text(q, seconds.explained[q], path);
    if (!text) return tl::unexpected<Error>(text.error());
    if (!text->empty()) notes.push_back(*text);
  }
  notes.insert(notes.end(), seconds.notes.begin(), seconds.notes.end());
  return notes;
}

}  // namespace prism::recordings
