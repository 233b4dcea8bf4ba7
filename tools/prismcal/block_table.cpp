// SPDX-License-Identifier: MIT
#include "tools/prismcal/block_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/block_stability.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/sample_grid.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::recordings {
namespace {

/// A log that was cut from a longer one begins after its session.
bool begins_with_session(const Recording& recording, std::int64_t first_s) {
  constexpr std::int64_t kSlow_s = 60;
  const auto session = tables::iso_time(recording.value("session"));
  return !session || !recording.is_date || first_s - session->ns / compensation::kNanosecondsPerSecond <= kSlow_s;
}

}  // namespace

std::vector<double> BlockTable::column(const std::string& input) const {
  std::vector<double> values;
  values.reserve(blocks.size());
  for (std::size_t i = 0; i < size(); ++i) values.push_back(compensation::input_value(blocks[i], features, input));
  return values;
}

std::vector<double> BlockTable::hours() const {
  std::vector<double> values;
  values.reserve(blocks.size());
  for (std::size_t i = 0; i < size(); ++i)
    values.push_back(static_cast<double>(second(i) - second(0) + features.length_s) / 3600);
  return values;
}

double BlockTable::mean_rate_deg_per_h() const {
  double sum = 0;
  std::size_t count = 0;
  for (const double bias : bias_deg_per_h) {
    if (!std::isfinite(bias)) continue;
    sum += bias;
    ++count;
  }
  return sum / static_cast<double>(count) + earth_rate_deg_per_h;
}

std::vector<double> BlockTable::second_sds() const {
  std::vector<double> sds(size(), kUnknown);
  compensation::RunningVariance values;
  std::size_t block = 0;
  for_each_known(seconds, [&](std::int64_t at, double rate) {
    while (block < size() && second(block) < at) ++block, values = {};
    if (block == size() || at <= second(block) - features.length_s) return;
    values.add(rate);
    if (at == second(block)) sds[block] = values.sd();
  });
  return sds;
}

BlockTableBuilder::BlockTableBuilder(const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                     std::string name)
    : extractor_(features) {
  table_.name = std::move(name);
  table_.features = features;
  table_.earth_rate_deg_per_h = earth_rate_deg_per_h;
}

Result<void> BlockTableBuilder::push(const compensation::SecondMean& original, bool begins_session) {
  ++pushed_;
  if (begins_session) extractor_.reset();
  session_begins_ = session_begins_ || begins_session;
  if (original.partial) return {};
  ++whole_;
  clocks_differ_ += original.clocks_differ;
  compensation::SecondMean second_mean = original;
  const bool begins = std::exchange(session_begins_, false);
  if (begins) {
    constexpr std::int64_t kGap = 1;  // the real time between two sessions is unknown
    shift_s_ = last_ && second_mean.second <= *last_ ? *last_ + 1 + kGap - second_mean.second : 0;
    if (shift_s_ != 0) table_.restarts.push_back(second_mean.second + shift_s_);
  }
  second_mean.second += shift_s_;
  if (begins && (!last_ || second_mean.second - *last_ > kOff_s)) table_.starts.push_back(second_mean.second);
  if (last_ && second_mean.second <= *last_)
    return make_error(table_.name, fmt::format("found second {} out of order", second_mean.second));
  add_second(compensation::without_implausible(second_mean));
  if (!on_grid_ || second_mean.second >= next_end_) {
    add_window(extractor_.push(second_mean));
  } else if (const auto window = extractor_.push_unless_ready(second_mean)) {
    add_window(*window);
  }
  last_ = second_mean.second;
  return {};
}

// The rate of each second, the missing seconds and the gaps.
void BlockTableBuilder::add_second(const compensation::SecondMean& second_mean) {
  if (const std::int64_t gap_s = last_ ? second_mean.second - *last_ - 1 : 0; gap_s > 0)
    miss(static_cast<std::size_t>(gap_s)), sparse_ += gap_s > table_.features.max_gap_s;
  const bool known = std::isfinite(second_mean.rate_deg_per_h);
  any_rate_ = any_rate_ || known;
  const bool has_temperature = std::isfinite(second_mean.temperature_degc);
  any_temperature_ = any_temperature_ || has_temperature;
  if (!last_temperature_) last_temperature_ = second_mean.second - 1;
  if (has_temperature) last_temperature_ = second_mean.second, without_temperature_ = 0;
  const bool too_long = second_mean.second - *last_temperature_ > table_.features.max_gap_s;
  if (!known) {
    leave_unused(1);
  } else if (too_long) {
    leave_unused(1 + std::exchange(without_temperature_, 0));
  } else {
    without_temperature_ += !has_temperature;
  }
  append(table_.seconds, second_mean.second, second_mean.rate_deg_per_h);
  if (!last_) table_.first_s = second_mean.second;
  table_.last_s = second_mean.second;
  in_gap_ = !known || too_long;
  table_.missing_frames += second_mean.missing_frames;
}

void BlockTableBuilder::miss(std::size_t seconds) {
  table_.missing_s += seconds;
  if (!in_gap_) ++table_.gaps;
  in_gap_ = true;
}

void BlockTableBuilder::leave_unused(std::size_t seconds) {
  table_.unused_s += seconds;
  miss(seconds);
}

void BlockTableBuilder::add_window(const compensation::Window& window) {
  const std::int64_t second = window.second_mean.second;
  if (window.state != compensation::WindowState::kReady) {
    table_.warming.push_back(window);
    on_grid_ = false;
    return;
  }
  if (!std::isfinite(window.rate_deg_per_h)) return;
  table_.follows.push_back(on_grid_ && second == next_end_);
  table_.blocks.push_back(window);
  table_.bias_deg_per_h.push_back(window.rate_deg_per_h - table_.earth_rate_deg_per_h);
  next_end_ = second + table_.features.length_s;
  on_grid_ = true;
}

std::string BlockTableBuilder::clocks_text() const {
  return fmt::format(
      "clocks_differ marks {} {}: the rate_hz of the description does not fit; correct it and replay the "
      "capture",
      clocks_differ_ == whole_ ? "all" : fmt::format("{} of", clocks_differ_), counted(whole_, "second"));
}

Result<BlockTable> BlockTableBuilder::finish() {
  if (table_.blocks.empty()) {
    const auto error = [&](const std::string& why) {
      return make_error(table_.name, clocks_differ_ > 0 ? why + "; " + clocks_text() : why);
    };
    if (clocks_differ_ > 0 && clocks_differ_ == whole_) return make_error(table_.name, clocks_text());
    if (pushed_ > 0 && !any_temperature_)
      return error("found no temperature, expected one (in a table: --map temperature=COLUMN:UNIT)");
    if (pushed_ > 0 && !any_rate_) return error("found no rate, expected one");
    if (2 * sparse_ > pushed_)
      return error(step_advice(static_cast<double>(table_.last_s - table_.first_s) / static_cast<double>(pushed_ - 1)));
    return error(fmt::format("found {} in {}, expected {} s without a gap for a block", counted(pushed_, "second"),
                             counted(table_.gaps + (pushed_ > 0 ? 1 : 0), "segment"),
                             compensation::history_s(table_.features)));
  }
  table_.rate_step_deg_per_h = rounding_step(table_.seconds);
  table_.spikes = spikes_text(table_.seconds);
  return std::move(table_);
}

Result<Loaded> read_blocks(const std::string& path, const SourceOptions& source, const SiteOptions& site,
                           const compensation::FeatureDefinition& features,
                           const std::function<Result<void>(const Recording&)>& check) {
  std::optional<BlockTableBuilder> builder;
  const auto begin = [&](const Recording& recording) -> Result<void> {
    if (auto good = check(recording); !good) return good;
    const auto earth_rate = earth_rate_of(recording, site);
    if (!earth_rate) return tl::unexpected<Error>(earth_rate.error());
    builder.emplace(features, *earth_rate, recording.name);
    return {};
  };
  auto recording = read_recording(path, source, {begin, [&](const compensation::SecondMean& second_mean, bool begins) {
                                                   return builder->push(second_mean, begins);
                                                 }});
  if (!recording) return tl::unexpected<Error>(recording.error());
  auto table = builder->finish();
  if (!table) return tl::unexpected<Error>(table.error());
  table->is_date = recording->is_date;
  if (!table->starts.empty() && !begins_with_session(*recording, table->starts.front()))
    table->starts.erase(table->starts.begin());
  if (!site.accept_unit) {
    auto good = check_unit(table->mean_rate_deg_per_h(), table->earth_rate_deg_per_h, table->name);
    if (!good) return tl::unexpected<Error>(good.error());
  }
  return Loaded{std::move(*recording), std::move(*table)};
}

}  // namespace prism::recordings
