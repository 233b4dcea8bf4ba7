// SPDX-License-Identifier: MIT
#include "tools/prismcal/block_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "base/plain_text.hpp"
#include "compensation/block_stability.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/series.hpp"
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
  for (std::size_t i = 0; i < size(); ++i) values.push_back(compensation::input_value(blocks[i], features, input));
  return values;
}

std::vector<double> BlockTable::hours() const {
  std::vector<double> values;
  for (std::size_t i = 0; i < size(); ++i)
    values.push_back(static_cast<double>(second(i) - second(0) + features.length_s) / 3600);
  return values;
}

double BlockTable::mean_rate_deg_per_h() const {
  const double sum = std::accumulate(bias_deg_per_h.begin(), bias_deg_per_h.end(), 0.0);
  return sum / static_cast<double>(size()) + earth_rate_deg_per_h;
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
    miss(static_cast<std::size_t>(gap_s), false), sparse_ += gap_s > table_.features.max_gap_s;
  const bool known = std::isfinite(second_mean.rate_deg_per_h);
  any_rate_ = any_rate_ || known;
  const bool has_temperature = std::isfinite(second_mean.temperature_degc);
  any_temperature_ = any_temperature_ || has_temperature;
  if (!last_temperature_) last_temperature_ = second_mean.second - 1;
  if (has_temperature) last_temperature_ = second_mean.second, without_temperature_ = 0;
  const bool too_long = second_mean.second - *last_temperature_ > table_.features.max_gap_s;
  if (!known) {
    miss(1, true);
  } else if (too_long) {
    miss(1 + std::exchange(without_temperature_, 0), true);
  } else {
    without_temperature_ += !has_temperature;
  }
  append(table_.seconds, second_mean.second, second_mean.rate_deg_per_h);
  if (!last_) table_.first_s = second_mean.second;
  table_.last_s = second_mean.second;
  in_gap_ = !known || too_long;
  table_.missing_frames += second_mean.missing_frames;
}

void BlockTableBuilder::miss(std::size_t seconds, bool have_rows) {
  table_.missing_s += seconds;
  if (have_rows) table_.unused_s += seconds;
  if (!in_gap_) ++table_.gaps;
  in_gap_ = true;
}

void BlockTableBuilder::add_window(const compensation::Window& window) {
  const std::int64_t second = window.second_mean.second;
  if (window.state != compensation::WindowState::kReady) {
    table_.warming.push_back(window);
    on_grid_ = false;
    return;
  }
  table_.follows.push_back(on_grid_ && second == next_end_);
  table_.blocks.push_back(window);
  table_.bias_deg_per_h.push_back(window.rate_deg_per_h - table_.earth_rate_deg_per_h);
  next_end_ = second + table_.features.length_s;
  on_grid_ = true;
}

Result<BlockTable> BlockTableBuilder::finish() {
  if (table_.blocks.empty()) {
    const bool all_differ = clocks_differ_ > 0 && clocks_differ_ == whole_;
    const std::string clocks = fmt::format(
        "clocks_differ marks {} {}: the rate_hz of the description does not fit; correct it and replay the capture",
        all_differ ? "all" : fmt::format("{} of", clocks_differ_), counted(whole_, "second"));
    if (all_differ) return make_error(table_.name, clocks);
    const auto error = [&](const std::string& why) {
      return make_error(table_.name, clocks_differ_ > 0 ? why + "; " + clocks : why);
    };
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
  const auto begin = [&](const Recording& of) -> Result<void> {
    if (builder) return {};
    if (auto good = check(of); !good) return good;
    return earth_rate_of(of, site).map([&](double earth_rate) { builder.emplace(features, earth_rate, of.name); });
  };
  auto recording =
      read_recording(path, source, [&](const Recording& of, const compensation::SecondMean& second_mean, bool begins) {
        return begin(of).and_then([&] { return builder->push(second_mean, begins); });
      });
  if (!recording) return tl::unexpected<Error>(recording.error());
  if (auto good = begin(*recording); !good) return tl::unexpected<Error>(good.error());
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

namespace {

using nlohmann::json;

constexpr std::size_t kSeconds = 32;
constexpr double kLogRounding_deg_per_h = 2e-6;

struct Shared {
  std::size_t files = 0, seconds = 0, compared = 0;
  /// Two equal seconds may be chance if the rate is coarse; shared data has most of them.
  bool convincing() const { return seconds >= 2 && 2 * seconds >= compared; }
};

// Provenance may be edited by hand: returns null if `object` is not an object or has no such member.
json member(const json& object, const char* key) { return object.is_object() ? object.value(key, json()) : json(); }

std::size_t shared_files(const json& facts, const Recording& recording) {
  std::set<std::string> trained;
  for (const json& file : member(facts, "files")) {
    if (const json sha256 = member(file, "sha256"); sha256.is_string()) trained.insert(sha256.get<std::string>());
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(recording.files, [&](const SourceFile& file) { return trained.contains(file.sha256); }));
}

struct Point {
  std::int64_t second;
  double rate_deg_per_h;
};

std::vector<Point> points_in(const json& fingerprint) {
  std::vector<Point> points;
  for (const json& point : fingerprint) {
    if (point.is_array() && point.size() == 2 && point[0].is_number() && point[1].is_number())
      points.push_back({point[0].get<std::int64_t>(), point[1].get<double>()});
  }
  return points;
}

/// Compares with the seconds of the table that are `later` seconds after the points.
Shared equal_seconds(const std::vector<Point>& points, const BlockTable& table, std::int64_t later, double tolerance) {
  Shared shared;
  for (const Point& point : points) {
    const auto rate = value_at(table.seconds, point.second + later);
    if (!rate) continue;
    ++shared.compared;
    shared.seconds += std::abs(*rate - point.rate_deg_per_h) <= tolerance;
  }
  return shared;
}

/// Of the rate from second to second, at these points.
double noise_deg_per_h(const std::vector<Point>& points, const BlockTable& table, std::int64_t later) {
  double squares = 0, count = 0;
  for (const Point& point : points) {
    const auto rate = value_at(table.seconds, point.second + later),
               next = value_at(table.seconds, point.second + later + 1);
    if (!rate || !next) continue;
    squares += (*next - *rate) * (*next - *rate) / 2;
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

Shared compare_seconds(const std::vector<Point>& points, const BlockTable& table) {
  constexpr std::size_t kEnough = 8;
  constexpr std::int64_t kLostAtStart_s = 5;
  const Shared exact = equal_seconds(points, table, 0, kLogRounding_deg_per_h);
  if (exact.convincing()) return exact;
  // Another program may have rounded the rates, and written times of another zone or from 0.
  const std::vector<Point> own = points_in(fingerprint_json(table));
  if (points.empty() || own.empty()) return exact;
  std::vector<std::int64_t> shifts = {0};
  for (std::int64_t lost = -kLostAtStart_s; lost <= kLostAtStart_s; ++lost)
    shifts.push_back(own.front().second - points.front().second + lost);
  for (const std::int64_t later : shifts) {
    const Shared near = equal_seconds(points, table, later, noise_deg_per_h(points, table, later) / 10);
    if (near.seconds >= kEnough && 10 * near.seconds >= 9 * near.compared) return near;
  }
  return exact;
}

}  // namespace

nlohmann::ordered_json fingerprint_json(const BlockTable& table) {
  std::size_t known = 0;
  for_each_known(table.seconds, [&](std::int64_t, double) { ++known; });
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  const std::size_t count = std::min(kSeconds, known);
  std::size_t at = 0;
  for_each_known(table.seconds, [&](std::int64_t second, double rate) {
    // Rounded twice, as in the models of version 0.2.
    if (points.size() < count && at++ == points.size() * known / count)
      points.push_back({second, rate - table.earth_rate_deg_per_h + table.earth_rate_deg_per_h});
  });
  return points;
}

std::string overlap_text(const std::string& provenance_json, const Recording& recording, const BlockTable& table) {
  const json provenance = json::parse(provenance_json, nullptr, false);
  const bool coarse = rounding_step(table.seconds) > 0;  // two days with the same profile have equal seconds
  Shared shared;
  for (const json& facts : member(provenance, "recordings")) {
    shared.files += shared_files(facts, recording);
    if (coarse) continue;
    const Shared same = compare_seconds(points_in(member(facts, "fingerprint")), table);
    shared.seconds += same.seconds;
    shared.compared += same.compared;
  }
  if (shared.files > 0 && recording.files.size() == 1) return "the model was trained on this file (same SHA-256)";
  if (shared.files > 0)
    return fmt::format("the model was trained on {} of these {} files (same SHA-256)", shared.files,
                       recording.files.size());
  if (!shared.convincing()) return {};
  return fmt::format("the model was trained on data of this recording ({} of {} compared seconds have the same rate)",
                     shared.seconds, shared.compared);
}

}  // namespace prism::recordings
