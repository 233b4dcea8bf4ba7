// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/block_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/plain_text.hpp"

namespace prism::recordings {
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
    values.push_back(static_cast<double>(blocks.second(i) - blocks.second(0) + features.length_s) / 3600);
  return values;
}

evaluation::RateSource BlockTable::second_bias_deg_per_h() const {
  return {seconds.size(), [this](std::size_t first, std::span<double> rates) {
            for (std::size_t i = 0; i < rates.size(); ++i) rates[i] = seconds.rates()[first + i] - earth_rate_deg_per_h;
          }};
}

BlockTableBuilder::BlockTableBuilder(const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                     std::string name)
    : extractor_(features) {
  table_.name = std::move(name);
  table_.features = features;
  table_.blocks = table_.warming = WindowList(features);
  table_.earth_rate_deg_per_h = earth_rate_deg_per_h;
}

void BlockTableBuilder::reserve(std::size_t seconds) {
  table_.blocks.reserve(seconds / static_cast<std::size_t>(table_.features.length_s));
}

Result<void> BlockTableBuilder::push(const compensation::SecondMean& original, bool begins_session) {
  ++pushed_;
  if (begins_session) extractor_.reset();
  session_begins_ = session_begins_ || begins_session;
  if (original.partial) return {};
  ++whole_;
  clocks_differ_ += original.clocks_differ;
  compensation::SecondMean second_mean = original;
  if (std::exchange(session_begins_, false)) {
    constexpr std::int64_t kGap = 1;  // the real time between two sessions is unknown
    shift_s_ = last_ && second_mean.second <= *last_ ? *last_ + 1 + kGap - second_mean.second : 0;
  }
  second_mean.second += shift_s_;
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

// The 1 Hz series, the missing seconds and the gaps.
void BlockTableBuilder::add_second(const compensation::SecondMean& second_mean) {
  if (const std::int64_t gap_s = last_ ? second_mean.second - *last_ - 1 : 0; gap_s > 0) {
    miss(static_cast<std::size_t>(gap_s));
    // Marks a gap in the series for the Allan deviation; 60 s are enough for any length.
    for (std::int64_t i = 1; i <= std::min<std::int64_t>(gap_s, 60); ++i) table_.seconds.push(*last_ + i, kUnknown);
  }
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
  table_.seconds.push(second_mean.second, known ? second_mean.rate_deg_per_h : kUnknown);
  resolution_.push(known ? second_mean.rate_deg_per_h : kUnknown);
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
    return error(fmt::format("found {} in {}, expected {} s without a gap for a block", counted(pushed_, "second"),
                             counted(table_.gaps + (pushed_ > 0 ? 1 : 0), "segment"),
                             compensation::history_s(table_.features)));
  }
  table_.rate_step_deg_per_h = resolution_.step_deg_per_h();
  return std::move(table_);
}

Result<BlockTable> make_block_table(std::span<const compensation::SecondMean> second_means,
                                    const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                    const std::string& name, std::span<const std::size_t> sessions) {
  BlockTableBuilder builder(features, earth_rate_deg_per_h, name);
  std::size_t session = 0;
  for (std::size_t i = 0; i < second_means.size(); ++i) {
    const bool begins = session < sessions.size() && sessions[session] == i;
    session += begins;
    if (auto done = builder.push(second_means[i], begins); !done) return tl::unexpected<Error>(done.error());
  }
  return builder.finish();
}

}  // namespace prism::recordings
