// SPDX-License-Identifier: MIT
#include "daemon/answers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/compensated_text.hpp"
#include "compensation/text_number.hpp"
#include "config/version.hpp"
#include "daemon/arrival_clock.hpp"

namespace prism::daemon {
namespace {

using nlohmann::ordered_json;

ordered_json known(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }

double seconds(std::int64_t time_ns) {
  const std::int64_t whole_us = time_ns / 1000;
  return static_cast<double>(whole_us) / 1e6;
}

const char* state_name(LineState state) {
  constexpr const char* kNames[] = {"none", "connecting", "receiving", "silent", "replaying", "ended"};
  return kNames[static_cast<int>(state)];
}

template <class Row>
ordered_json row_json(const Row& row) {
  std::string text;
  compensation::append_json(text, row);
  return ordered_json::parse(text);
}

/// What is measured now. No line that delivers, or no frame on it yet: nothing is, whatever came before. The quality is
/// that of the correction in force, and implausible where the last sample or the last second is.
struct Current {
  const compensation::Compensated* sample = nullptr;
  const compensation::CompensatedWindow* window = nullptr;
  compensation::Correction correction{kUnknown, kUnknown, kUnknown, compensation::kNoData};
};

Current current(const Instance& instance) {
  const Acquisition& acquisition = instance.acquisition;
  if (!instance.line.delivers() || acquisition.last_sample() == nullptr) return {};
  Current now{acquisition.last_sample(), acquisition.last_window(), acquisition.engine().correction()};
  now.correction.quality |= now.sample->correction.quality & compensation::kImplausible;
  if (now.window) now.correction.quality |= now.window->correction.quality & compensation::kImplausible;
  return now;
}

// The row, or one of the same members without a number in it.
template <class Row>
ordered_json row_or_nothing(const Row* row, std::uint32_t quality) {
  if (row != nullptr) return row_json(*row);
  ordered_json json = row_json(Row{});
  for (auto& [key, value] : json.items()) value = nullptr;
  json["quality"] = compensation::quality_text(quality);
  return json;
}

ordered_json age_json(const Instance& instance) {
  if (instance.line.last_data_ns == 0) return nullptr;
  return seconds(host_time_ns() - instance.line.last_data_ns);
}

// How long the means of the window are of, how much history is gathered, and how much a correction takes.
void put_window_length(ordered_json& json, const Instance& instance, const Current& now) {
  json["window_s"] = instance.acquisition.block_s();
  json["warm_s"] = now.window ? now.window->window.warm_s : 0;
  json["full_s"] = instance.acquisition.full_s();
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
          {"missing_by_arrival", c.missing_by_arrival},
          {"duplicates", c.duplicates},
          {"resets", c.resets},
          {"period_s", known(c.period_s)},
          {"period_is_estimated", c.period_is_estimated},
          {"residual_s", known(c.residual_s)}};
}

// What is not looked at is null.
ordered_json limits_json(const compensation::SensorLimits& limits, const char* range, double unit, const char* slope) {
  ordered_json json = {{range, {known(limits.low / unit), known(limits.high / unit)}}};
  if (slope != nullptr) json[slope] = known(limits.greatest_slope_per_s);
  json["stuck_s"] = known(limits.stuck_s);
  return json;
}

ordered_json plausibility_json(const compensation::PlausibilityLimits& limits) {
  return {{"rate", limits_json(limits.rate, "range_deg_per_s", kDegPerSInDegPerH, nullptr)},
          {"temperature", limits_json(limits.temperature, "range_degc", 1, "greatest_slope_degc_per_s")},
          {"uhfo", limits_json(limits.uhfo, "range_v", 1, nullptr)}};
}

// deg/h per second; null: not limited, or no model.
ordered_json slew_json(const pipeline::Setup& setup) {
  const compensation::EngineSettings& engine = setup.config.engine;
  if (!setup.model) return nullptr;
  return known(compensation::greatest_slew_deg_per_h_per_s(*setup.model, engine.slew, engine.max_bias_deg_per_h));
}

// What a standard deviation is of: a run that was not seen, or, of models of version 0.1, what the model itself had.
const char* sd_of(const compensation::Model& model) { return model.info().spread ? "run" : "model"; }

ordered_json model_brief(const compensation::ModelPtr& model) {
  if (!model) return nullptr;
  return {{"id", model->info().id}, {"kind", model->info().kind}, {"name", model->info().name}, {"sd", sd_of(*model)}};
}

ordered_json series_json(const compensation::RunningVariance& series) {
  return {{"blocks", series.count()}, {"mean_deg_per_h", known(series.mean())}, {"sd_deg_per_h", known(series.sd())}};
}

}  // namespace

ordered_json status_answer(const Instance& instance) {
  const Acquisition& acquisition = instance.acquisition;
  const pipeline::Setup& setup = acquisition.setup();
  const config::Config& c = setup.config;
  ordered_json json = {{"name", c.name},
                       {"version", kVersion},
                       {"state", state_name(instance.line.state)},
                       {"detail", instance.line.detail},
                       {"state_since_s", seconds(instance.line.since_ns)},
                       {"started_s", seconds(instance.started_ns)},
                       {"device", c.line.device},
                       {"gyro_serial", c.gyro.serial},
                       {"frames", setup.frames->name},
                       {"clock", c.device_clock ? "device" : "host"},
                       {"sessions", acquisition.sessions()},
                       {"model", model_brief(setup.model)},
                       {"fallback_model", model_brief(setup.fallback)}};
  json["line"] = counters_json(acquisition.pipeline().decoder().counters());
  json["timing"] = clock_json(acquisition.pipeline().clock().status());
  const Current now = current(instance);
  json["quality"] = compensation::quality_text(now.correction.quality);
  json["age_s"] = age_json(instance);
  json["sample"] = row_or_nothing(now.sample, now.correction.quality);
  json["window"] = row_or_nothing(now.window, now.correction.quality);
  put_window_length(json, instance, now);
  if (const LogCounters* log = acquisition.log()) {
    json["log"] = {{"directory", c.log ? c.log->directory : ""},
                   {"rows", log->rows.load()},
                   {"dropped", log->dropped.load()},
                   {"segments", log->segments.load()},
                   {"pending", log->pending.load()},
                   {"unsynced", log->unsynced.load()}};
  }
  if (acquisition.capture() != nullptr)
    json["capture"] = {{"directory", c.capture ? c.capture->directory : ""},
                       {"dropped_bytes", acquisition.capture()->dropped_bytes()}};
  json["clients"] = {{"connected", instance.publisher.clients()}, {"lost_rows", instance.publisher.lost_rows()}};
  return json;
}

ordered_json line_answer(const Instance& instance) {
  const Acquisition& acquisition = instance.acquisition;
  const pipeline::Setup& setup = acquisition.setup();
  ordered_json json = {{"device", setup.config.line.device},
                       {"state", state_name(instance.line.state)},
                       {"detail", instance.line.detail},
                       {"sessions", acquisition.sessions()},
                       {"baud", setup.line.baud},
                       {"notes", instance.line.notes}};
  json["decoder"] = counters_json(acquisition.pipeline().decoder().counters());
  json["timing"] = clock_json(acquisition.pipeline().clock().status());
  json["nominal_period_s"] = setup.frames->period_s();
  json["hardware"] = nullptr;
  if (instance.line.hardware) {
    json["hardware"] = {{"received", instance.line.hardware->received},
                        {"framing_errors", instance.line.hardware->framing_errors},
                        {"parity_errors", instance.line.hardware->parity_errors},
                        {"overruns", instance.line.hardware->overruns},
                        {"breaks", instance.line.hardware->breaks},
                        {"buffer_overruns", instance.line.hardware->buffer_overruns}};
  }
  return json;
}

ordered_json bias_answer(const Instance& instance) {
  const pipeline::Setup& setup = instance.acquisition.setup();
  const Current now = current(instance);
  const auto [sample, window, correction] = now;
  ordered_json json = {{"time_s", sample ? ordered_json(seconds(sample->sample.time_ns)) : ordered_json()},
                       {"rate_deg_per_h", known(sample ? sample->sample.rate_deg_per_h : kUnknown)},
                       {"bias_deg_per_h", known(correction.bias_deg_per_h)},
                       {"sd_deg_per_h", known(correction.sd_deg_per_h)},
                       {"sd_mean_deg_per_h", known(correction.sd_mean_deg_per_h)},
                       {"corrected_deg_per_h", known(sample ? sample->corrected_deg_per_h : kUnknown)}};
  json["second_rate_deg_per_h"] = known(window ? window->window.bucket.rate_deg_per_h : kUnknown);
  json["second_corrected_deg_per_h"] = known(window ? window->corrected_deg_per_h : kUnknown);
  json["mean_rate_deg_per_h"] = known(window ? window->window.rate_deg_per_h : kUnknown);
  json["corrected_mean_deg_per_h"] = known(window ? window->corrected_mean_deg_per_h : kUnknown);
  json["temperature_degc"] = known(window ? window->window.temperature_degc : kUnknown);
  json["slope_degc_per_s"] = known(window ? window->window.slope_degc_per_s : kUnknown);
  json["uhfo_v"] = known(window ? window->window.uhfo_v : kUnknown);
  put_window_length(json, instance, now);
  json["quality"] = compensation::quality_text(correction.quality);
  json["age_s"] = age_json(instance);
  json["model"] = setup.model ? ordered_json(setup.model->info().id) : ordered_json();
  const auto& by = correction.quality & compensation::kFallback ? setup.fallback : setup.model;
  json["sd"] = by ? ordered_json(sd_of(*by)) : ordered_json();
  return json;
}

ordered_json stability_answer(const Instance& instance) {
  const Acquisition& acquisition = instance.acquisition;
  const pipeline::Setup& setup = acquisition.setup();
  const auto improvement = acquisition.stability().improvement();
  return {{"block_s", acquisition.block_s()},
          {"divisor", "N-1"},
          {"all", series_json(acquisition.stability().all())},
          {"raw", series_json(acquisition.stability().raw())},
          {"corrected", series_json(acquisition.stability().corrected())},
          {"improvement", improvement ? ordered_json(*improvement) : ordered_json()},
          {"model", model_brief(setup.model)}};
}

ordered_json model_answer(const Instance& instance) {
  const pipeline::Setup& setup = instance.acquisition.setup();
  if (!setup.model) return nullptr;
  const compensation::ModelInfo& info = setup.model->info();
  ordered_json json = model_brief(setup.model);
  json["file"] = setup.config.model;
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

ordered_json config_answer(const Instance& instance) {
  const pipeline::Setup& setup = instance.acquisition.setup();
  const config::Config& c = setup.config;
  ordered_json json = {{"file", c.path}, {"name", c.name}};
  json["gyro"] = {{"serial", c.gyro.serial},
                  {"axis", setup.frames->gyro.axis},
                  {"sign", c.gyro.sign},
                  {"unit_scale", setup.frames->gyro.scale}};
  json["line"] = {{"device", c.line.device},           {"baud", setup.line.baud},
                  {"data_bits", setup.line.data_bits}, {"stop_bits", setup.line.stop_bits},
                  {"silence_s", c.line.silence_s},     {"retry_min_s", c.line.retry_min_s},
                  {"retry_max_s", c.line.retry_max_s}};
  json["frames"] = {
      {"file", c.frames}, {"name", setup.frames->name}, {"id", setup.frames->id}, {"rate_hz", setup.frames->rate_hz}};
  json["clock"] = c.device_clock ? "device" : "host";
  json["model"] = c.model;
  json["fallback_model"] = c.fallback_model;
  json["max_bias_deg_per_h"] = c.engine.max_bias_deg_per_h;
  json["max_slew_deg_per_h_per_s"] = slew_json(setup);
  json["plausibility"] = plausibility_json(c.engine.plausibility);
  json["log"] = c.log ? ordered_json(c.log->directory) : ordered_json();
  json["capture"] = c.capture ? ordered_json(c.capture->directory) : ordered_json();
  json["socket"] = c.socket.path;
  return json;
}

std::string summary(const Instance& instance) {
  const Acquisition& acquisition = instance.acquisition;
  const std::string& device = acquisition.setup().config.line.device;
  switch (instance.line.state) {
    case LineState::kReceiving:
      return fmt::format("receiving from {}, {} frames, quality {}", device, acquisition.frames(),
                         compensation::quality_text(current(instance).correction.quality));
    case LineState::kReplaying:
      return fmt::format("replaying, {} frames", acquisition.frames());
    default:
      return fmt::format("{}: {}", device.empty() ? "no line" : device,
                         instance.line.detail.empty() ? "waiting" : instance.line.detail);
  }
}

}  // namespace prism::daemon
