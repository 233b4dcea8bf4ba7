// SPDX-License-Identifier: MIT
#include "daemon/socket/answers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/host_time.hpp"
#include "base/text_number.hpp"
#include "compensation/compensated_text.hpp"
#include "config/config.hpp"
#include "config/socket_protocol.hpp"
#include "config/version.hpp"

namespace prism::socket {
namespace {

using nlohmann::ordered_json;

ordered_json known(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }
ordered_json text_or_null(const std::string& text) { return text.empty() ? ordered_json() : ordered_json(text); }

// Null if the driver does not count.
ordered_json hardware_json(const std::optional<transport::LineCounters>& counters) {
  if (!counters) return nullptr;
  return {{"received", counters->received},
          {"framing_errors", counters->framing_errors},
          {"parity_errors", counters->parity_errors},
          {"overruns", counters->overruns},
          {"breaks", counters->breaks},
          {"buffer_overruns", counters->buffer_overruns}};
}

// Counters of the requests of a polled line.
void put_polls(ordered_json& json, const wire::Commands& commands, const drivers::PollCounters& polls) {
  if (!commands.poll) return;
  json["polls"] = {{"requests", polls.requests}, {"missed", polls.missed}, {"skipped", polls.skipped}};
}

ordered_json counters_json(const wire::DecoderCounters& c) {
  return {{"bytes", c.bytes},
          {"frames", c.frames},
          {"bad_check", c.bad_check},
          {"bad_length", c.bad_length},
          {"bad_body", c.bad_body},
          {"refused", c.refused},
          {"skipped_bytes", c.skipped_bytes},
          {"resyncs", c.resyncs},
          {"timeouts", c.timeouts},
          {"unconfirmed", c.unconfirmed},
          {"out_of_range", c.out_of_range}};
}

ordered_json clock_json(const pipeline::Pipeline& pipeline) {
  const drivers::ClockStatus& c = pipeline.clock().status();
  return {{"samples", c.samples},
          {"missing_frames", c.missing_frames},
          {"missing_by_arrival", c.missing_by_arrival},
          {"duplicates", c.duplicates},
          {"rejected_counters", c.rejected_counters},
          {"resets", c.resets},
          {"period_s", known(c.period_s)},
          {"period_is_estimated", c.period_is_estimated},
          {"residual_s", known(c.residual_s)}};
}

ordered_json sensor_lines_answer(const Sources& sources) {
  const pipeline::Device& device = sources.device;
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < device.setup.sensor_lines.size(); ++i) {
    const pipeline::Setup::SensorLine& line = device.setup.sensor_lines[i];
    const pipeline::LineStatus& status = device.lines[i + 1];
    const pipeline::SensorFeed& feed = device.pipeline->sensor_feeds()[i];
    ordered_json& own = json[line.name];
    own = {{"device", line.line.device},  {"state", state_name(status.state)},
           {"detail", status.detail},     {"state_since_s", seconds(status.since_ns)},
           {"frames", line.frames->name}, {"baud", line.line.format.baud},
           {"notes", status.notes}};
    own["age_s"] = feed.last_ns() ? ordered_json(seconds(time_of(sources) - *feed.last_ns())) : ordered_json();
    own["stale_after_s"] = line.stale_after_s;
    own["decoder"] = counters_json(feed.decoder().counters());
    own["hardware"] = hardware_json(status.hardware);
    put_polls(own, line.frames->commands, status.polls);
    if (const pipeline::CaptureSink* capture = device.lines[i + 1].capture.get())
      own["capture_dropped_bytes"] = capture->dropped_bytes();
  }
  return json;
}

ordered_json line_answer(const Sources& sources) {
  const pipeline::Device& device = sources.device;
  const pipeline::Setup& setup = device.setup;
  ordered_json json = {{"device", setup.config.line.device},   {"state", state_name(sources.gyro_line().state)},
                       {"detail", sources.gyro_line().detail}, {"sessions", device.sessions},
                       {"baud", setup.line.format.baud},       {"notes", sources.gyro_line().notes}};
  json["decoder"] = counters_json(device.pipeline->decoder().counters());
  json["timing"] = clock_json(*device.pipeline);
  json["nominal_period_s"] = setup.frames->period_s();
  json["hardware"] = hardware_json(sources.gyro_line().hardware);
  put_polls(json, setup.frames->commands, sources.gyro_line().polls);
  if (const ordered_json lines = sensor_lines_answer(sources); !lines.empty()) json["sensor_lines"] = lines;
  return json;
}

ordered_json sensors_answer(const Sources& sources) {
  const pipeline::Device& device = sources.device;
  const std::vector<SensorName>& sensors = sensors_of_list(device.setup.sensors);
  const std::vector<double> values = device.pipeline->sensors_now(time_of(sources));
  const std::size_t of_device = device.setup.frames->sensors.size();
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const bool there = i >= of_device || sources.gyro_line().delivers();
    json[sensors[i].name] = {{"value", known(there ? values[i] : kUnknown)}, {"unit", sensors[i].unit}};
  }
  return json;
}

ordered_json retention_json(const pipeline::RetentionStatus& status) {
  ordered_json json = {
      {"segments", status.segments},
      {"bytes", status.bytes},
      {"keep_bytes", status.keep_bytes < config::kNoByteLimit ? ordered_json(status.keep_bytes) : ordered_json()},
      {"keep_s", status.keep_s},
      {"deleted_segments", status.deleted_segments},
      {"deleted_rows", status.deleted_rows},
      {"next", nullptr}};
  if (!status.next) return json;
  constexpr std::array kWhy{"bytes", "age", "disk_full"};
  const pipeline::NextDeletion& next = *status.next;
  json["next"] = {{"file", next.file},
                  {"rows", next.rows},
                  {"bytes", next.bytes},
                  {"why", kWhy[static_cast<std::size_t>(next.why)]}};
  const std::int64_t passed_s = uptime_s() - status.uptime_s;
  const std::int64_t in_s = std::max<std::int64_t>(next.in_s - passed_s, 0);
  json["next"]["in_s"] = in_s;
  json["next"]["time_s"] = host_time_ns() / 1'000'000'000 + in_s;
  return json;
}

/// The current values: empty if the line does not deliver or has no frame yet. The quality is that of the current
/// correction, plus `rate_invalid`, `implausible` and `clocks_differ` if the latest sample or second is.
struct Current {
  const compensation::Compensated* sample = nullptr;
  const compensation::CompensatedWindow* window = nullptr;
  compensation::Correction correction{kUnknown, kUnknown, kUnknown, compensation::kNoData};
};

Current current(const Sources& sources, std::size_t axis) {
  const pipeline::AxisRecord& record = sources.device.axes[axis];
  if (!sources.gyro_line().delivers() || !record.last_sample || has_no_frames(sources)) return {};
  Current now{&*record.last_sample, record.last_window ? &*record.last_window : nullptr,
              sources.device.pipeline->axes()[axis].engine.correction()};
  constexpr std::uint32_t kOfValues =
      compensation::kRateInvalid | compensation::kImplausible | compensation::kClocksDiffer;
  now.correction.quality |= now.sample->correction.quality & kOfValues;
  if (now.window) now.correction.quality |= now.window->correction.quality & kOfValues;
  return now;
}

// The row with its axis, as in notifications. Without a row, the same members are null.
template <class Row>
ordered_json row_json(const Row* row, std::uint32_t quality, const std::string& axis) {
  std::string text;
  compensation::append_json(text, row ? *row : Row{});
  ordered_json members = ordered_json::parse(text), json = {{"axis", axis}};
  if (row == nullptr) {
    for (auto& [key, value] : members.items()) value = nullptr;
    members["quality"] = compensation::quality_text(quality);
  }
  json.update(members);
  return json;
}

ordered_json age_json(const Sources& sources) {
  const std::int64_t last_ns = sources.device.pipeline->last_frame_ns();
  return last_ns == 0 ? ordered_json() : ordered_json(seconds(host_time_ns() - last_ns));
}

// Length of the window, history collected so far, and history that a correction needs.
void put_window_length(ordered_json& json, const pipeline::Device& device, std::size_t axis, const Current& now) {
  json["window_s"] = device.setup.axes[axis].features().length_s;
  json["warm_s"] = now.window ? now.window->window.warm_s : 0;
  json["full_s"] = compensation::history_s(device.setup.axes[axis].features());
}

// Meaning of the standard deviation: error in a new run, or, for models of version 0.1, the model's own.
const char* sd_of(const compensation::Model& model) { return model.info().spread ? "run" : "model"; }

ordered_json model_brief(const compensation::ModelPtr& model) {
  if (!model) return nullptr;
  return {{"id", model->info().id}, {"kind", model->info().kind}, {"name", model->info().name}, {"sd", sd_of(*model)}};
}

ordered_json series_json(const compensation::RunningVariance& series) {
  return {{"blocks", series.count()}, {"mean_deg_per_h", known(series.mean())}, {"sd_deg_per_h", known(series.sd())}};
}

void put_models(ordered_json& json, const pipeline::Setup::Axis& axis) {
  json["model"] = model_brief(axis.model);
  json["fallback_model"] = model_brief(axis.fallback);
}

void put_rows(ordered_json& json, const Sources& sources, std::size_t axis, const Current& now) {
  const std::string& name = sources.device.axes[axis].name;
  json["sample"] = row_json(now.sample, now.correction.quality, name);
  json["window"] = row_json(now.window, now.correction.quality, name);
  put_window_length(json, sources.device, axis, now);
}

/// The log of one axis: its retention, if known.
void put_log(ordered_json& json, const pipeline::RowWriter* log) {
  if (log == nullptr) return;
  if (const auto status = log->retention()) json["log"]["retention"] = retention_json(*status);
}

/// Names the sensor lines without data; empty if all deliver.
std::string lines_without_data(const Sources& sources) {
  std::string text;
  for (std::size_t i = 0; i < sources.device.setup.sensor_lines.size(); ++i) {
    const pipeline::LineStatus& line = sources.device.lines[i + 1];
    if (!line.delivers())
      text += fmt::format(", {} {}", sources.device.setup.sensor_lines[i].name, state_name(line.state));
  }
  return text;
}

std::string quality_of(const Sources& sources, std::size_t axis) {
  return compensation::quality_text(current_quality(sources, axis));
}

std::string qualities(const Sources& sources) {
  const pipeline::Device& device = sources.device;
  if (device.axes.size() == 1) return "quality " + quality_of(sources, 0);
  std::string text = "quality";
  for (std::size_t i = 0; i < device.axes.size(); ++i)
    text += fmt::format("{} {} {}", i > 0 ? "," : "", device.axes[i].name, quality_of(sources, i));
  return text;
}

// Of each output: its line, the frames by how they left, and the latency from the read of a frame's last byte to the
// end of the write.
ordered_json outputs_json(const pipeline::Device& device) {
  ordered_json all = ordered_json::array();
  for (std::size_t i = 0; i < device.output_lines.size(); ++i) {
    const pipeline::OutputStatus& line = device.output_lines[i];
    const pipeline::OutputCounters& counters = device.outputs[i].counters();
    ordered_json& output = all.emplace_back();
    output["device"] = device.setup.outputs[i].config.line.device;
    output["state"] = line.delivers() ? "open" : "connecting";
    output["detail"] = line.detail;
    output["state_since_s"] = seconds(line.since_ns);
    output["frames"] = counters.frames;
    for (std::size_t form = 0; form < pipeline::kForms.size(); ++form)
      output[pipeline::kForms[form]] = counters.by_form[form];
    output["unfit"] = counters.unfit;
    output["bytes"] = line.bytes;
    output["lost_bytes"] = line.lost_bytes;
    output["latency_p50_s"] = known(line.latency_s(0.5));
    output["latency_p99_s"] = known(line.latency_s(0.99));
  }
  return all;
}

ordered_json status_answer(const Sources& sources) {
  const pipeline::Device& device = sources.device;
  const pipeline::Setup& setup = device.setup;
  const config::Config& c = setup.config;
  ordered_json json = {{"name", c.name},
                       {"version", kVersion},
                       {"state", state_name(sources.gyro_line().state)},
                       {"detail", sources.gyro_line().detail},
                       {"health", health_json(sources)},
                       {"state_since_s", seconds(sources.gyro_line().since_ns)},
                       {"started_s", seconds(sources.started_ns)},
                       {"device", c.line.device},
                       {"gyro_serial", c.gyro_serial},
                       {"frames", setup.frames->name},
                       {"clock", c.device_clock ? "device" : "host"},
                       {"sessions", device.sessions}};
  json["line"] = counters_json(device.pipeline->decoder().counters());
  json["timing"] = clock_json(*device.pipeline);
  if (!device.output_lines.empty()) json["out"] = outputs_json(device);
  json["no_rate"] = text_or_null(device.problems.find(pipeline::kNoRate).text);
  json["clocks_differ"] = text_or_null(device.problems.find(pipeline::kClocksDiffer).text);
  json["age_s"] = age_json(sources);
  for (std::size_t i = 0; i < device.axes.size(); ++i) {
    ordered_json& axis = json["axes"][device.axes[i].name];
    put_models(axis, setup.axes[i]);
    axis["quality"] = quality_of(sources, i);
    put_rows(axis, sources, i, current(sources, i));
    put_log(axis, device.axes[i].log.get());
  }
  if (const pipeline::LogCounters* log = device.log) {
    json["log"] = {{"directory", c.log ? c.log->directory : ""},
                   {"rows", log->rows.load()},
                   {"dropped", log->dropped.load()},
                   {"segments", log->segments.load()},
                   {"gone", log->gone.load()},
                   {"pending", log->pending.load()},
                   {"unsynced", log->unsynced.load()}};
  }
  if (const ordered_json lines = sensor_lines_answer(sources); !lines.empty()) json["sensor_lines"] = lines;
  if (setup.sensors) json["sensors"] = sensors_answer(sources);
  if (const auto* const capture = sources.gyro_line().capture.get()) {
    json["capture"] = {{"directory", c.capture ? c.capture->directory : ""},
                       {"dropped_bytes", capture->dropped_bytes()}};
    if (const auto status = capture->retention()) json["capture"]["retention"] = retention_json(*status);
  }
  json["clients"] = {{"connected", sources.publisher.clients()}, {"lost_rows", sources.publisher.lost_rows()}};
  return json;
}

// The inputs of the model in use, at the last window.
ordered_json inputs_json(const compensation::ModelPtr& model, const Current& now) {
  ordered_json json = ordered_json::object();
  if (!model) return json;
  const compensation::FeatureDefinition& features = model->info().features;
  for (const std::string& name : model->info().inputs) {
    const double value = now.window ? compensation::input_value(now.window->window, features, name) : kUnknown;
    json[name] = {{"value", known(value)}, {"unit", compensation::unit_of_input(features, name)}};
  }
  return json;
}

ordered_json bias_answer(const Sources& sources, std::size_t axis) {
  const pipeline::Setup::Axis& own = sources.device.setup.axes[axis];
  const Current now = current(sources, axis);
  const auto [sample, window, correction] = now;
  ordered_json json = {{"axis", sources.device.axes[axis].name},
                       {"time_s", sample ? ordered_json(seconds(sample->sample.time_ns)) : ordered_json()},
                       {"rate_deg_per_h", known(sample ? sample->sample.rate_deg_per_h : kUnknown)},
                       {"bias_deg_per_h", known(correction.bias_deg_per_h)},
                       {"sd_deg_per_h", known(correction.sd_deg_per_h)},
                       {"sd_mean_deg_per_h", known(correction.sd_mean_deg_per_h)},
                       {"corrected_deg_per_h", known(sample ? sample->corrected_deg_per_h : kUnknown)}};
  json["second_rate_deg_per_h"] = known(window ? window->window.second_mean.rate_deg_per_h : kUnknown);
  json["second_corrected_deg_per_h"] = known(window ? window->corrected_deg_per_h : kUnknown);
  json["mean_rate_deg_per_h"] = known(window ? window->window.rate_deg_per_h : kUnknown);
  json["corrected_mean_deg_per_h"] = known(window ? window->corrected_mean_deg_per_h : kUnknown);
  json["temperature_degc"] = known(window ? window->window.temperature_degc : kUnknown);
  json["slope_degc_per_s"] = known(window ? window->window.slope_degc_per_s : kUnknown);
  json["uhfo_v"] = known(window ? window->window.uhfo_v : kUnknown);
  put_window_length(json, sources.device, axis, now);
  json["quality"] = compensation::quality_text(correction.quality);
  json["age_s"] = age_json(sources);
  json["model"] = own.model ? ordered_json(own.model->info().id) : ordered_json();
  const auto& by = correction.quality & compensation::kFallback ? own.fallback : own.model;
  json["sd"] = by ? ordered_json(sd_of(*by)) : ordered_json();
  json["inputs"] = inputs_json(by, now);
  return json;
}

// Noise of a mean in the training recording, a lower limit of its standard deviation; null: the model has no estimate.
ordered_json noise_json(const compensation::ModelPtr& model) {
  return model && model->info().spread ? known(model->info().spread->noise_deg_per_h) : ordered_json();
}

ordered_json stability_answer(const Sources& sources, std::size_t axis) {
  const pipeline::Device& device = sources.device;
  const compensation::BlockStability& stability = device.axes[axis].stability;
  const auto improvement = stability.improvement();
  return {{"axis", device.axes[axis].name},
          {"block_s", device.setup.axes[axis].features().length_s},
          {"divisor", "N-1"},
          {"all", series_json(stability.all())},
          {"raw", series_json(stability.raw())},
          {"corrected", series_json(stability.corrected())},
          {"improvement", improvement ? ordered_json(*improvement) : ordered_json()},
          {"noise_deg_per_h", noise_json(device.setup.axes[axis].model)},
          {"model", model_brief(device.setup.axes[axis].model)}};
}

ordered_json model_answer(const Sources& sources, std::size_t axis) {
  const pipeline::Setup& setup = sources.device.setup;
  const compensation::ModelPtr& model = setup.axes[axis].model;
  if (!model) return nullptr;
  const compensation::ModelInfo& info = model->info();
  ordered_json json = model_brief(model);
  json["axis"] = sources.device.axes[axis].name;
  json["file"] = setup.config.axes[axis].model;
  json["loaded_s"] = seconds(setup.loaded_ns);
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

ordered_json version_answer(const Sources&) {
  return {{"name", "prismd"}, {"version", kVersion}, {"protocol", config::kProtocol}};
}

}  // namespace

Answer answer_of(std::string_view method) {
  static const std::map<std::string_view, Answer> kAnswers = {
      {"version", version_answer}, {"status", status_answer}, {"line", line_answer}, {"config", config_answer}};
  const auto found = kAnswers.find(method);
  return found == kAnswers.end() ? nullptr : found->second;
}

AxisAnswer axis_answer_of(std::string_view method) {
  static const std::map<std::string_view, AxisAnswer> kAnswers = {
      {"bias", bias_answer}, {"stability", stability_answer}, {"model", model_answer}};
  const auto found = kAnswers.find(method);
  return found == kAnswers.end() ? nullptr : found->second;
}

bool has_no_frames(const Sources& sources) {
  constexpr double kFrames = 3;  // of a slow device
  const pipeline::Device& device = sources.device;
  const pipeline::Setup& setup = device.setup;
  const pipeline::LineStatus& line = sources.gyro_line();
  const double age_s = seconds(line.last_data_ns - std::max(device.pipeline->last_frame_ns(), line.since_ns));
  return line.delivers() && age_s > std::max(setup.config.line.silence_s, kFrames / setup.frames->rate_hz);
}

std::uint32_t current_quality(const Sources& sources, std::size_t axis) {
  return current(sources, axis).correction.quality;
}

std::int64_t time_of(const Sources& sources) {
  const pipeline::LineState state = sources.gyro_line().state;
  return state == pipeline::LineState::kReplaying || state == pipeline::LineState::kEnded
             ? sources.gyro_line().last_data_ns
             : host_time_ns();
}

std::string summary(const Sources& sources) {
  const pipeline::Device& device = sources.device;
  const std::string& path = device.setup.config.line.device;
  switch (sources.gyro_line().state) {
    case pipeline::LineState::kReceiving:
      return fmt::format("receiving from {}, {} frames, {}{}", path, device.frames(), qualities(sources),
                         lines_without_data(sources));
    case pipeline::LineState::kReplaying:
      return fmt::format("replaying, {} frames", device.frames());
    default:
      return fmt::format("{}: {}", path.empty() ? "no line" : path,
                         sources.gyro_line().detail.empty() ? "waiting" : sources.gyro_line().detail);
  }
}

}  // namespace prism::socket
