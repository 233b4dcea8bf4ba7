// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/table_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "tools/prismcal/recordings/leave_out.hpp"

namespace prism::recordings {
namespace {

constexpr std::array<const char*, 3> kNames = {"rate", "temperature", "uhfo"}, kUnitNames = {"deg/h", "degC", "V"};

bool equal(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

constexpr std::size_t kFew = 5;

/// Seconds [begin, end) of a series that are far from those before and after them.
struct FarBlock {
  std::size_t begin = 0, end = 0;
  double level = 0;     ///< median, or of the largest part
  double distance = 0;  ///< from the rates next to it
};

/// Median of at most 21 values, evenly spaced.
double median_between(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  const std::size_t stride = (end - begin) / 21 + 1;
  std::vector<double> some;
  for (std::size_t i = begin; i < end; i += stride) some.push_back(values[i]);
  return evaluation::median_of(std::move(some));
}

/// Parts of one block touch: a second that is only partly far has a mean of its own.
void add_block(const FarBlock& block, std::vector<FarBlock>& blocks) {
  if (blocks.empty() || blocks.back().end < block.begin) return blocks.push_back(block);
  FarBlock& last = blocks.back();
  const bool is_larger = block.end - block.begin > last.end - last.begin;
  last = {last.begin, block.end, (is_larger ? block : last).level, (is_larger ? block : last).distance};
}

bool have_one_level(const std::vector<FarBlock>& blocks) {
  return std::all_of(blocks.begin(), blocks.end(), [&](const FarBlock& b) { return b.level == blocks[0].level; });
}

/// Runs of rates between two steps above `far`, after which the rates are as before. A step that stays begins none. A
/// run at the start or end of the record needs one step only. The search ends once more than kFew runs have several
/// levels.
std::vector<FarBlock> far_blocks(const std::vector<double>& rates, double far) {
  constexpr std::size_t kNear = 10, kMostSteps = 16;
  const std::size_t count = rates.size(), longest = std::clamp<std::size_t>(count / 20, 1, 600);
  const auto steps = [&](std::size_t i) { return std::fabs(rates[i] - rates[i - 1]) > far; };
  std::vector<double> before;  // the last rates that are not far
  const auto block_at = [&](std::size_t begin) {
    FarBlock block{begin, begin, 0, 0};
    std::size_t tried = 0;
    for (std::size_t j = begin + 1; j <= std::min(count, begin + longest) && tried < kMostSteps; ++j) {
      if (j < count && !steps(j)) continue;
      ++tried;
      if (before.empty() && j == count) break;
      const double after = j < count ? median_between(rates, j, std::min(count, j + kNear)) : kUnknown;
      const double level = before.empty() ? after : evaluation::median_of(before);
      block.level = median_between(rates, begin, j);
      block.distance = std::fabs(block.level - level);
      const bool returns = j == count || std::fabs(after - level) <= std::max(far, 0.2 * block.distance);
      if (block.distance > far && returns) {
        block.end = j;
        break;
      }
    }
    return block;
  };
  std::vector<FarBlock> blocks;
  for (std::size_t i = 0; i < count && (blocks.size() <= kFew || have_one_level(blocks));) {
    const FarBlock block = i == 0 || steps(i) ? block_at(i) : FarBlock{i, i, 0, 0};
    if (block.end > i) {
      add_block(block, blocks);
      i = block.end;
      continue;
    }
    before.push_back(rates[i]);
    if (before.size() > kNear) before.erase(before.begin());
    ++i;
  }
  return blocks;
}

/// "outlier at 7001 s: 1000 deg/h, …" for one second, "30 s from … to … at 9999 deg/h, …" for more.
std::string far_text(const FarBlock& block, std::int64_t first, std::int64_t last, bool is_date, double noise) {
  const std::string begin = end_of_second(first, is_date);
  if (block.end - block.begin == 1)
    return fmt::format("outlier at {}: {:.6g} deg/h, {:.3g} times the noise from its neighbours; left out", begin,
                       block.level, block.distance / noise);
  return fmt::format("{} s from {} to {} at {:.6g} deg/h, far from the rest ({:.3g} times the noise): left out",
                     block.end - block.begin, begin, end_of_second(last, is_date), block.level, block.distance / noise);
}

}  // namespace

TableJudge::TableJudge() : plausibility_(compensation::PlausibilityLimits{}) {}

QuantitySet TableJudge::push(const Sample& sample, std::size_t line) {
  const bool repeats = any_ && equal(sample.rate_deg_per_h, last_.rate_deg_per_h) && sample.time_ns == last_.time_ns &&
                       equal(sample.temperature_degc, last_.temperature_degc) && equal(sample.uhfo_v, last_.uhfo_v);
  if (repeats && ++repeated_ == 1) first_repeated_line_ = line;
  last_ = sample;
  any_ = true;
  compensation::Rejections rejections;
  const QuantitySet implausible = plausibility_.implausible(sample);
  if (implausible.any()) plausibility_.explain(sample, implausible, rejections);
  const auto judge = [&](std::size_t quantity, double value, bool bad, const compensation::Rejection& why) {
    Count& count = counts_[quantity];
    if (std::isnan(value)) return;
    ++count.values;
    count.like_kelvin += value > 230 && value < 375;
    if (!bad || ++count.implausible > 1) return;
    count.first_line = line;
    count.why = compensation::rejection_text(why, kUnitNames[quantity]);
  };
  judge(0, sample.rate_deg_per_h, implausible.rate, rejections.rate);
  judge(1, sample.temperature_degc, implausible.temperature, rejections.temperature);
  judge(2, sample.uhfo_v, implausible.uhfo, rejections.uhfo);
  return implausible;
}

Result<std::vector<std::string>> TableJudge::finish(const std::string& path) const {
  std::vector<std::string> notes;
  for (std::size_t q = 0; q < counts_.size(); ++q) {
    const Count& count = counts_[q];
    if (count.implausible == 0) continue;
    const std::string text = fmt::format("{}: {} of {} values implausible, the first in line {}: {}", kNames[q],
                                         count.implausible, count.values, count.first_line, count.why);
    if (q == 1 && 2 * count.like_kelvin > count.values)
      return make_error(path, text + "; looks like kelvin: --map temperature=COLUMN:K");
    if (100 * count.implausible > count.values) return make_error(path, text + "; expected at most 1 %");
    notes.push_back(text + "; left out");
  }
  if (repeated_ > 0)
    notes.push_back(fmt::format("{} repeats the row before it with its time, the first in line {}",
                                counted(repeated_, "row"), first_repeated_line_));
  return notes;
}

std::vector<std::string> judge_seconds(std::vector<compensation::SecondMean>& second_means, bool is_date) {
  constexpr std::size_t kEnough = 50, kConstant_s = 1000;
  constexpr double kFar = 50;
  std::vector<std::string> notes;
  std::vector<double> rates;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < second_means.size(); ++i) {
    const double rate = compensation::without_implausible(second_means[i]).rate_deg_per_h;
    if (!std::isfinite(rate) || second_means[i].partial) continue;
    rates.push_back(rate);
    index.push_back(i);
  }
  if (rates.size() < kEnough) return notes;
  std::vector<double> steps;
  for (std::size_t i = 1; i < rates.size(); ++i) steps.push_back(rates[i] - rates[i - 1]);
  const double noise = evaluation::robust_sd(steps) / std::sqrt(2.0);
  const std::vector<FarBlock> far = noise > 0 ? far_blocks(rates, kFar * noise) : std::vector<FarBlock>();
  const bool used = far.size() <= kFew || have_one_level(far);
  for (std::size_t k = 0; used && k < far.size(); ++k) {
    const std::int64_t first = second_means[index[far[k].begin]].second;
    if (k < kFew) notes.push_back(far_text(far[k], first, second_means[index[far[k].end - 1]].second, is_date, noise));
    for (std::size_t i = far[k].begin; i < far[k].end; ++i) second_means[index[i]].rate_deg_per_h = kUnknown;
  }
  if (used && far.size() > kFew)
    notes.push_back(
        fmt::format("{} more at {:.6g} deg/h: left out", counted(far.size() - kFew, "block"), far[0].level));
  // A thermometer that stops: constant to the last digit after it has moved, for longer than its steps take.
  std::size_t begin = 0, longest = 0, longest_begin = 0;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t i = 0; i < second_means.size(); ++i) {
    const double temperature = compensation::without_implausible(second_means[i]).temperature_degc;
    if (std::isfinite(temperature)) low = std::min(low, temperature), high = std::max(high, temperature);
    if (i > 0 && temperature != second_means[i - 1].temperature_degc) begin = i;
    if (i - begin + 1 > longest && std::isfinite(temperature)) longest = i - begin + 1, longest_begin = begin;
  }
  if (longest >= kConstant_s && 5 * longest >= second_means.size() && high > low)
    notes.push_back(fmt::format("temperature stays at {:.6g} degC from {} to {}: has its sensor stopped?",
                                second_means[longest_begin].temperature_degc,
                                end_of_second(second_means[longest_begin].second, is_date),
                                end_of_second(second_means[longest_begin + longest - 1].second, is_date)));
  return notes;
}

}  // namespace prism::recordings
