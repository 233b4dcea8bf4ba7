// SPDX-License-Identifier: MIT
// What the station answers to each question, as JSON. Unknown quantities are null.
#include <algorithm>
#include <cmath>

#include "compensation/compensated_text.hpp"
#include "compensation/text_number.hpp"
#include "config/version.hpp"
#include "daemon/station.hpp"

namespace prism::daemon {
namespace {

using nlohmann::ordered_json;

ordered_json known(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }

double seconds(std::int64_t time_ns) { return static_cast<double>(time_ns / 1000) / 1e6; }

const char* state_name(LineState state) {
  constexpr const char* kNames[] = {"none", "connecting", "receiving", "silent", "replaying", "ended"};
  return kNames[static_cast<int>(state)];
}

ordered_json row_json(const compensation::Compensated& row) {
  std::string text;
  compensation::append_json(text, row);
  return ordered_json::parse(text);
}

ordered_json row_json(const compensation::CompensatedWindow& row) {
  std::string text;
  compensation::append_json(text, row);
  return ordered_json::parse(text);
}

ordered_json counters_json(const wire::DecoderCounters& c) {
  return {{"bytes", c.bytes},
          {"frames", c.frames},
          {"bad_check", c.bad_check},
          {"bad_length", c.bad_length},
          {"bad_body", c.bad_body},
          {"skipped_bytes", c.skipped_bytes},
          {"resyncs", c.resyncs},
          {"timeouts", c.timeouts},
          {"unconfirmed", c.unconfirmed},
          {"out_of_range", c.out_of_range}};
}

ordered_json clock_json(const drivers::ClockStatus& c) {
  return {{"samples", c.samples},
          {"missing_frames", c.missing_frames},
          {"duplicates", c.duplicates},
          {"resets", c.resets},
          {"period_s", known(c.period_s)},
          {"period_is_estimated", c.period_is_estimated},
          {"residual_s", known(c.residual_s)}};
}

ordered_json model_brief(const compensation::ModelPtr& model) {
  if (!model) return nullptr;
  return {{"id", model->info().id}, {"kind", model->info().kind}, {"name", model->info().name}};
}

ordered_json series_json(const compensation::RunningVariance& series) {
  return {{"blocks", series.count()}, {"mean_deg_per_h", known(series.mean())}, {"sd_deg_per_h", known(series.sd())}};
}

}  // namespace

ordered_json Station::status() const {
  const config::Config& c = setup_.config;
  ordered_json json = {{"name", c.name},
                       {"version", kVersion},
                       {"state", state_name(state_)},
                       {"detail", state_detail_},
                       {"state_since_s", seconds(state_since_ns_)},
                       {"started_s", seconds(started_ns_)},
                       {"device", c.line.device},
                       {"gyro_serial", c.gyro.serial},
                       {"frames", setup_.frames->name},
                       {"clock", c.device_clock ? "device" : "host"},
                       {"sessions", sessions_},
                       {"model", model_brief(setup_.model)},
                       {"fallback_model", model_brief(setup_.fallback)}};
  json["line"] = counters_json(pipeline_->decoder().counters());
  json["timing"] = clock_json(pipeline_->clock().status());
  json["sample"] = has_last_ ? row_json(last_) : ordered_json();
  json["window"] = history_.empty() ? ordered_json() : row_json(history_.back());
  json["warm_s"] = history_.empty() ? 0 : history_.back().window.warm_s;
  if (rows_) {
    const LogCounters& log = rows_->counters();
    json["log"] = {{"directory", c.log ? c.log->directory : ""},
                   {"rows", log.rows.load()},
                   {"dropped", log.dropped.load()},
                   {"segments", log.segments.load()}};
  }
  if (recorder)
    json["capture"] = {{"directory", c.capture ? c.capture->directory : ""},
                       {"dropped_bytes", recorder->dropped_bytes()}};
  json["clients"] = {{"connected", publisher.clients()}, {"lost_rows", publisher.lost_rows()}};
  return json;
}

ordered_json Station::line() const {
  ordered_json json = {{"device", setup_.config.line.device},
                       {"state", state_name(state_)},
                       {"detail", state_detail_},
                       {"sessions", sessions_},
                       {"baud", setup_.line.baud},
                       {"notes", line_notes_}};
  json["decoder"] = counters_json(pipeline_->decoder().counters());
  json["timing"] = clock_json(pipeline_->clock().status());
  json["nominal_period_s"] = setup_.frames->period_s();
  json["hardware"] = nullptr;
  if (hardware_) {
    json["hardware"] = {{"received", hardware_->received},
                        {"framing_errors", hardware_->framing_errors},
                        {"parity_errors", hardware_->parity_errors},
                        {"overruns", hardware_->overruns},
                        {"breaks", hardware_->breaks},
                        {"buffer_overruns", hardware_->buffer_overruns}};
  }
  return json;
}

ordered_json Station::bias() const {
  const compensation::Correction& correction = pipeline_->engine().correction();
  ordered_json json = {{"time_s", has_last_ ? ordered_json(seconds(last_.sample.time_ns)) : ordered_json()},
                       {"rate_deg_per_h", known(has_last_ ? last_.sample.rate_deg_per_h : kUnknown)},
                       {"bias_deg_per_h", known(correction.bias_deg_per_h)},
                       {"sd_deg_per_h", known(correction.sd_deg_per_h)},
                       {"corrected_deg_per_h", known(has_last_ ? last_.corrected_deg_per_h : kUnknown)}};
  const bool windowed = !history_.empty();
  json["mean_rate_deg_per_h"] = known(windowed ? history_.back().window.rate_deg_per_h : kUnknown);
  json["corrected_mean_deg_per_h"] = known(windowed ? history_.back().corrected_mean_deg_per_h : kUnknown);
  json["temperature_degc"] = known(windowed ? history_.back().window.temperature_degc : kUnknown);
  json["slope_degc_per_s"] = known(windowed ? history_.back().window.slope_degc_per_s : kUnknown);
  json["uhfo_v"] = known(windowed ? history_.back().window.uhfo_v : kUnknown);
  json["quality"] = compensation::quality_text(correction.quality);
  json["model"] = setup_.model ? ordered_json(setup_.model->info().id) : ordered_json();
  return json;
}

ordered_json Station::stability() const {
  const auto improvement = stability_.improvement();
  return {{"block_s", pipeline_->engine().model() ? pipeline_->engine().model()->info().features.length_s : 100},
          {"divisor", "N-1"},
          {"all", series_json(stability_.all())},
          {"raw", series_json(stability_.raw())},
          {"corrected", series_json(stability_.corrected())},
          {"improvement", improvement ? ordered_json(*improvement) : ordered_json()},
          {"model", model_brief(setup_.model)}};
}

ordered_json Station::model() const {
  if (!setup_.model) return nullptr;
  const compensation::ModelInfo& info = setup_.model->info();
  ordered_json json = model_brief(setup_.model);
  json["file"] = setup_.config.model;
  json["gyro_serial"] = info.gyro_serial;
  json["inputs"] = info.inputs;
  json["window"] = {
      {"length_s", info.features.length_s},
      {"slope", info.features.slope == compensation::SlopeMethod::kDifference ? "difference" : "least_squares"},
      {"end_mean_s", info.features.end_mean_s},
      {"max_gap_s", info.features.max_gap_s},
      {"lag_time_constants_s", info.features.lag_time_constants_s}};
  json["domain"] = {{"min", info.domain.min}, {"max", info.domain.max}};
  json["provenance"] = ordered_json::parse(info.provenance_json);
  return json;
}

ordered_json Station::config() const {
  const config::Config& c = setup_.config;
  ordered_json json = {{"file", c.path}, {"name", c.name}};
  json["gyro"] = {{"serial", c.gyro.serial},
                  {"axis", setup_.frames->gyro.axis},
                  {"sign", c.gyro.sign},
                  {"unit_scale", setup_.frames->gyro.scale}};
  json["line"] = {{"device", c.line.device},
                  {"baud", setup_.line.baud},
                  {"data_bits", setup_.line.data_bits},
                  {"stop_bits", setup_.line.stop_bits},
                  {"silence_s", c.line.silence_s},
                  {"retry_min_s", c.line.retry_min_s},
                  {"retry_max_s", c.line.retry_max_s}};
  json["frames"] = {{"file", c.frames},
                    {"name", setup_.frames->name},
                    {"id", setup_.frames->id},
                    {"rate_hz", setup_.frames->rate_hz}};
  json["clock"] = c.device_clock ? "device" : "host";
  json["model"] = c.model;
  json["fallback_model"] = c.fallback_model;
  json["max_bias_deg_per_h"] = c.engine.max_bias_deg_per_h;
  json["log"] = c.log ? ordered_json(c.log->directory) : ordered_json();
  json["capture"] = c.capture ? ordered_json(c.capture->directory) : ordered_json();
  json["socket"] = c.socket.path;
  return json;
}

ordered_json Station::history(std::size_t count) const {
  ordered_json rows = ordered_json::array();
  const std::size_t first = history_.size() - std::min(count, history_.size());
  for (std::size_t i = first; i < history_.size(); ++i) rows.push_back(row_json(history_[i]));
  return rows;
}

ordered_json Station::events(std::size_t count) const {
  ordered_json list = ordered_json::array();
  const auto& recent = events_.recent();
  const std::size_t first = recent.size() - std::min(count, recent.size());
  for (std::size_t i = first; i < recent.size(); ++i) list.push_back(ordered_json::parse(event_json(recent[i])));
  return list;
}

}  // namespace prism::daemon
