// SPDX-License-Identifier: MIT
#include "daemon/socket/answers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/host_time.hpp"
#include "base/json_table.hpp"
#include "compensation/compensated_text.hpp"
#include "config/config.hpp"
#include "config/socket_protocol.hpp"
#include "config/version.hpp"

namespace prism::socket {
namespace {

using nlohmann::ordered_json;

/// Seconds, truncated to microseconds.
double seconds(std::int64_t time_ns) {
  const std::int64_t whole_us = time_ns / 1000;
  return static_cast<double>(whole_us) / 1e6;
}

const char* state_name(pipeline::LineState state) {
  constexpr const char* kNames[] = {"none", "connecting", "receiving", "silent", "replaying", "ended"};
  return kNames[static_cast<int>(state)];
}

/// The current values of an axis: empty if the line does not deliver or has no frame yet. The quality is that of the
/// current correction, plus `rate_invalid`, `implausible` and `clocks_differ` if the latest sample or second is.
struct Current {
  const compensation::Compensated* sample = nullptr;
  const compensation::CompensatedWindow* window = nullptr;
  compensation::Correction correction{kUnknown, kUnknown, kUnknown, compensation::kNoData};

  std::string quality() const { return compensation::quality_text(correction.quality); }
};

/// The device at one moment. Every answer shows a part of it.
struct State {
  explicit State(const Sources& of)
      : sources(of), now_ns(line.replays() ? line.last_data_ns : host_time_ns()), no_frames(has_no_frames()) {
    for (std::size_t i = 0; i < device.axes.size(); ++i) axes.push_back(current(i));
  }

  const Sources& sources;
  const pipeline::Device& device = sources.device;
  const pipeline::Setup& setup = device.setup;
  const config::Config& config = setup.config;
  const pipeline::LineStatus& line = device.lines[pipeline::kGyroLine];
  const std::int64_t now_ns;  ///< in a replay: of the last bytes
  const bool no_frames;
  std::vector<Current> axes;

 private:
  /// Bytes arrive, but for longer than a line may be silent (silence_s, at least three periods) no frame with gyro data
  /// that can be used: the last values are old.
  bool has_no_frames() const {
    constexpr double kFrames = 3;  // of a slow device
    const double age_s = seconds(line.last_data_ns - std::max(device.pipeline->last_frame_ns(), line.since_ns));
    return line.delivers() && age_s > std::max(config.line.silence_s, kFrames / setup.frames->rate_hz);
  }

  Current current(std::size_t axis) const {
    const pipeline::AxisRecord& record = device.axes[axis];
    if (!line.delivers() || !record.last_sample || no_frames) return {};
    Current now{&*record.last_sample, record.last_window ? &*record.last_window : nullptr,
                device.pipeline->axes()[axis].engine.correction()};
    constexpr std::uint32_t kOfValues =
        compensation::kRateInvalid | compensation::kImplausible | compensation::kClocksDiffer;
    now.correction.quality |= now.sample->correction.quality & kOfValues;
    if (now.window) now.correction.quality |= now.window->correction.quality & kOfValues;
    return now;
  }
};

using Level = Problem::Level;

constexpr std::uint32_t kUnusable = compensation::kRateInvalid | compensation::kInputMissing |
                                    compensation::kOverLimit | compensation::kNoData | compensation::kImplausible |
                                    compensation::kClocksDiffer;

using Findings = std::vector<Problem>;

ordered_json known(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }
ordered_json text_or_null(const std::string& text) { return text.empty() ? ordered_json() : ordered_json(text); }

// An instrument that sends, but nothing that its description or columns can read.
std::string unread_problem(const State& state, std::size_t i) {
  const pipeline::Setup::SensorLine& line = state.setup.sensor_lines[i];
  const pipeline::SensorFeed& feed = state.device.pipeline->sensor_feeds()[i];
  const std::int64_t since_ns = std::max(state.device.lines[i + 1].since_ns, feed.last_ns().value_or(0));
  const double waited_s = seconds(state.now_ns - since_ns);
  if (waited_s <= line.stale_after_s || feed.decoder().counters().bytes == 0) return {};
  return fmt::format("{}: bytes, but no value that can be used for {:.0f} s: wrong description, columns or settings",
                     line.name, waited_s);
}

void add_lines(Findings& found, const State& state) {
  for (std::size_t i = 0; i < state.device.lines.size(); ++i) {
    const pipeline::LineStatus& line = state.device.lines[i];
    const std::string name = i == 0 ? "line" : state.setup.sensor_lines[i - 1].name;
    if (line.delivers()) {
      const std::string unread = i > 0 ? unread_problem(state, i - 1) : "";
      if (!unread.empty()) found.push_back({.kind = "line", .text = unread});
      continue;
    }
    found.push_back({.kind = "line",
                     .level = i == 0 ? Level::kFailed : Level::kCaution,
                     .text = fmt::format("{}: {}{}{}", name, state_name(line.state), line.detail.empty() ? "" : ": ",
                                         line.detail)});
  }
}

void add_axis(Findings& found, const State& state, std::size_t axis) {
  const pipeline::AxisRecord& record = state.device.axes[axis];
  const std::string& model = state.setup.axes[axis].model_problem;
  const auto add = [&](const char* kind, Level level, const std::string& text) {
    found.push_back({.kind = kind, .part = record.name, .level = level, .text = record.prefix + text});
  };
  if (!model.empty()) add("model", Level::kFailed, "model: " + model);
  std::uint32_t quality = state.axes[axis].correction.quality & ~compensation::kNoData;  // the line's problem
  if (quality & compensation::kNoModel) {
    if (model.empty()) add("no_model", Level::kCaution, "no model is configured: rates are uncorrected");
    quality &= ~compensation::kNoModel;
  }
  if (quality == compensation::kGood) return;
  add("quality", quality & kUnusable ? Level::kFailed : Level::kCaution,
      "quality: " + compensation::quality_text(quality));
}

/// {"state": "good", "caution" or "failed", "problems": the failures first}. Good only if data, corrections, model,
/// log, capture and disk are. Failed: something is lost or must not be used.
ordered_json health_json(const State& state) {
  const Problems& problems = state.device.problems;
  Findings found;
  add_lines(found, state);
  if (state.no_frames && !problems.has(pipeline::kNoRate))
    found.push_back({.kind = "line", .level = Level::kFailed, .text = "line: bytes, but no frame that can be used"});
  for (std::size_t i = 0; i < state.axes.size(); ++i) add_axis(found, state, i);
  for (const Problem& problem : problems.list()) {
    if (!problem.kind.starts_with("line_") || problem.kind == "line_peer") found.push_back(problem);
  }
  const auto is_failed = [](const Problem& problem) { return problem.level == Level::kFailed; };
  std::stable_partition(found.begin(), found.end(), is_failed);
  ordered_json list = ordered_json::array();
  for (const Problem& problem : found)
    list.push_back({{"level", is_failed(problem) ? "failed" : "caution"},
                    {"kind", problem.kind},
                    {"axis", text_or_null(problem.part)},
                    {"text", problem.shown()}});
  return {{"state", found.empty() ? ordered_json("good") : list[0]["level"]}, {"problems", list}};
}

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

ordered_json clock_json(const drivers::ClockStatus& c) {
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

ordered_json sensor_lines_json(const State& state) {
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < state.setup.sensor_lines.size(); ++i) {
    const pipeline::Setup::SensorLine& line = state.setup.sensor_lines[i];
    const pipeline::LineStatus& status = state.device.lines[i + 1];
    const pipeline::SensorFeed& feed = state.device.pipeline->sensor_feeds()[i];
    ordered_json& own = json[line.name];
    own = {{"device", line.line.device},  {"state", state_name(status.state)},
           {"detail", status.detail},     {"state_since_s", seconds(status.since_ns)},
           {"frames", line.frames->name}, {"baud", line.line.format.baud},
           {"notes", status.notes}};
    own["age_s"] = feed.last_ns() ? ordered_json(seconds(state.now_ns - *feed.last_ns())) : ordered_json();
    own["stale_after_s"] = line.stale_after_s;
    own["decoder"] = counters_json(feed.decoder().counters());
    own["hardware"] = hardware_json(status.hardware);
    put_polls(own, line.frames->commands, status.polls);
    if (status.capture) own["capture_dropped_bytes"] = status.capture->dropped_bytes();
  }
  return json;
}

ordered_json line_answer(const State& state) {
  const pipeline::LineStatus& line = state.line;
  ordered_json json = {
      {"device", state.config.line.device}, {"state", state_name(line.state)},      {"detail", line.detail},
      {"sessions", state.device.sessions},  {"baud", state.setup.line.format.baud}, {"notes", line.notes}};
  json["decoder"] = counters_json(state.device.pipeline->decoder().counters());
  json["timing"] = clock_json(state.device.pipeline->clock().status());
  json["nominal_period_s"] = state.setup.frames->period_s();
  json["hardware"] = hardware_json(line.hardware);
  put_polls(json, state.setup.frames->commands, line.polls);
  if (!state.setup.sensor_lines.empty()) json["sensor_lines"] = sensor_lines_json(state);
  return json;
}

ordered_json sensors_json(const State& state) {
  const std::vector<SensorName>& sensors = sensors_of_list(state.setup.sensors);
  const std::vector<double> values = state.device.pipeline->sensors_now(state.now_ns);
  const std::size_t of_device = state.setup.frames->sensors().size();
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const bool there = i >= of_device || state.line.delivers();
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

// The row with its axis, as in notifications. Without a row, the same members are null.
template <class Row>
ordered_json row_json(const Row* row, const Current& now, const std::string& axis) {
  std::string text;
  compensation::append_json(text, row ? *row : Row{});
  ordered_json members = ordered_json::parse(text), json = {{"axis", axis}};
  if (row == nullptr) {
    for (auto& [key, value] : members.items()) value = nullptr;
    members["quality"] = now.quality();
  }
  json.update(members);
  return json;
}

ordered_json age_json(const State& state) {
  const std::int64_t last_ns = state.device.pipeline->last_frame_ns();
  return last_ns == 0 ? ordered_json() : ordered_json(seconds(host_time_ns() - last_ns));
}

// Length of the window, history collected so far, and history that a correction needs.
void put_window_length(ordered_json& json, const State& state, std::size_t axis) {
  const compensation::CompensatedWindow* const window = state.axes[axis].window;
  json["window_s"] = state.setup.axes[axis].features().length_s;
  json["warm_s"] = window ? window->window.warm_s : 0;
  json["full_s"] = compensation::history_s(state.setup.axes[axis].features());
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

// The difference of the corrected rate from the Earth rate at rest, or the reason without one.
ordered_json at_rest_json(const compensation::AtRest& at_rest) {
  const auto found = at_rest.difference();
  return {{"earth_rate_deg_per_h", known(at_rest.earth_rate_deg_per_h())},
          {"difference_deg_per_h", known(found ? found->deg_per_h : kUnknown)},
          {"sd_deg_per_h", known(found ? found->sd_deg_per_h : kUnknown)},
          {"seen_s", found ? found->seen_s : 0},
          {"unknown", text_or_null(compensation::kNoDifferenceNames[static_cast<std::size_t>(at_rest.reason())])}};
}

ordered_json verdict_json(const std::optional<pipeline::ModelVerdict>& verdict) {
  if (!verdict) return nullptr;
  return {{"verdict", verdict->verdict}, {"text", verdict->text}, {"at_s", verdict->at_s}};
}

ordered_json axis_json(const State& state, std::size_t axis) {
  const Current& now = state.axes[axis];
  const pipeline::AxisRecord& record = state.device.axes[axis];
  ordered_json json = {{"model", model_brief(state.setup.axes[axis].model)},
                       {"fallback_model", model_brief(state.setup.axes[axis].fallback)},
                       {"quality", now.quality()},
                       {"sample", row_json(now.sample, now, record.name)},
                       {"window", row_json(now.window, now, record.name)},
                       {"at_rest", at_rest_json(record.at_rest)},
                       {"offset", record.offset ? pipeline::offset_keys().print(*record.offset) : ordered_json()},
                       {"monitor", verdict_json(record.verdict)}};
  put_window_length(json, state, axis);
  if (const auto status = record.log ? record.log->retention() : std::nullopt)
    json["log"]["retention"] = retention_json(*status);
  return json;
}

ordered_json status_answer(const State& state) {
  const pipeline::Device& device = state.device;
  const config::Config& c = state.config;
  ordered_json json = {{"name", c.name},
                       {"version", kVersion},
                       {"state", state_name(state.line.state)},
                       {"detail", state.line.detail},
                       {"health", health_json(state)},
                       {"state_since_s", seconds(state.line.since_ns)},
                       {"started_s", seconds(state.sources.started_ns)},
                       {"device", c.line.device},
                       {"gyro_serial", c.gyro_serial},
                       {"frames", state.setup.frames->name},
                       {"clock", c.device_clock ? "device" : "host"},
                       {"sessions", device.sessions}};
  json["line"] = counters_json(state.device.pipeline->decoder().counters());
  json["timing"] = clock_json(state.device.pipeline->clock().status());
  if (!device.output_lines.empty()) json["out"] = outputs_json(device);
  json["no_rate"] = text_or_null(device.problems.find(pipeline::kNoRate).text);
  json["clocks_differ"] = text_or_null(device.problems.find(pipeline::kClocksDiffer).text);
  json["age_s"] = age_json(state);
  for (std::size_t i = 0; i < device.axes.size(); ++i) json["axes"][device.axes[i].name] = axis_json(state, i);
  if (const pipeline::LogCounters* log = device.log) {
    json["log"] = {{"directory", c.log ? c.log->directory : ""},
                   {"rows", log->rows.load()},
                   {"dropped", log->dropped.load()},
                   {"segments", log->segments.load()},
                   {"gone", log->gone.load()},
                   {"pending", log->pending.load()},
                   {"unsynced", log->unsynced.load()}};
  }
  if (!state.setup.sensor_lines.empty()) json["sensor_lines"] = sensor_lines_json(state);
  if (state.setup.sensors) json["sensors"] = sensors_json(state);
  if (const pipeline::CaptureSink* const capture = state.line.capture.get()) {
    json["capture"] = {{"directory", c.capture ? c.capture->directory : ""},
                       {"dropped_bytes", capture->dropped_bytes()}};
    if (const auto status = capture->retention()) json["capture"]["retention"] = retention_json(*status);
  }
  json["clients"] = {{"connected", state.sources.publisher.clients()},
                     {"lost_rows", state.sources.publisher.lost_rows()}};
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

ordered_json bias_answer(const State& state, std::size_t axis) {
  const pipeline::Setup::Axis& own = state.setup.axes[axis];
  const Current& now = state.axes[axis];
  const auto& [sample, window, correction] = now;
  ordered_json json = {{"axis", state.device.axes[axis].name},
                       {"time_s", sample ? ordered_json(seconds(sample->sample.time_ns)) : ordered_json()},
                       {"rate_deg_per_h", known(sample ? sample->sample.rate_deg_per_h : kUnknown)},
                       {"bias_deg_per_h", known(correction.bias_deg_per_h)},
                       {"sd_deg_per_h", known(correction.sd_deg_per_h)},
                       {"sd_mean_deg_per_h", known(correction.sd_mean_deg_per_h)},
                       {"offset_deg_per_h", known(correction.offset_deg_per_h)},
                       {"corrected_deg_per_h", known(sample ? sample->corrected_deg_per_h : kUnknown)}};
  json["second_rate_deg_per_h"] = known(window ? window->window.second_mean.rate_deg_per_h : kUnknown);
  json["second_corrected_deg_per_h"] = known(window ? window->corrected_deg_per_h : kUnknown);
  json["mean_rate_deg_per_h"] = known(window ? window->window.rate_deg_per_h : kUnknown);
  json["corrected_mean_deg_per_h"] = known(window ? window->corrected_mean_deg_per_h : kUnknown);
  json["temperature_degc"] = known(window ? window->window.temperature_degc : kUnknown);
  json["slope_degc_per_s"] = known(window ? window->window.slope_degc_per_s : kUnknown);
  json["uhfo_v"] = known(window ? window->window.uhfo_v : kUnknown);
  put_window_length(json, state, axis);
  json["quality"] = now.quality();
  json["age_s"] = age_json(state);
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

ordered_json stability_answer(const State& state, std::size_t axis) {
  const pipeline::Device& device = state.device;
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

ordered_json model_answer(const State& state, std::size_t axis) {
  const pipeline::Setup& setup = state.setup;
  const compensation::ModelPtr& model = setup.axes[axis].model;
  if (!model) return nullptr;
  const compensation::ModelInfo& info = model->info();
  ordered_json json = model_brief(model);
  json["axis"] = state.device.axes[axis].name;
  json["file"] = setup.config.axes[axis].model;
  json["loaded_s"] = seconds(setup.loaded_ns);
  json["gyro_serial"] = info.gyro_serial;
  json["inputs"] = info.inputs;
  json["window"] = {
      {"length_s", info.features.length_s},
      {"slope", info.features.slope == compensation::SlopeMethod::kDifference ? "difference" : "least_squares"},
      {"end_mean_s", info.features.end_mean_s},
      {"max_gap_s", info.features.max_gap_s}};
  json["domain"] = {{"min", info.domain.min}, {"max", info.domain.max}};
  json["provenance"] = ordered_json::parse(info.provenance_json);
  return json;
}

// Null: not checked.
SensorStatement statement(const compensation::SensorLimits& limits) {
  return {Range{limits.low, limits.high}, limits.greatest_slope_per_s, limits.stuck_s};
}

// Adds the values of the frame description.
void complete_line(const pipeline::Setup& setup, std::size_t number, config::LineConfig& line) {
  const wire::WireFormat& format = setup.line_settings(number).format;
  line.baud = format.baud;
  line.data_bits = format.data_bits;
  line.parity = format.parity;
  line.stop_bits = format.stop_bits;
  line.commands = setup.line_commands(number).with(line.commands);
  if (!line.commands.start) line.commands.start.emplace();
  if (!line.commands.stop) line.commands.stop.emplace();
  line.commands.again_when_silent = line.commands.again_when_silent.value_or(false);
}

// The configuration with every value in force, by axes.
config::Config complete(const pipeline::Setup& setup) {
  config::Config config = setup.config;
  config.by_axes = true;
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    config::AxisConfig& axis = config.axes[i];
    axis.name = setup.frames->axes[i].name;
    axis.engine.slew.max_slew_deg_per_h_per_s.reset();
    if (const auto& model = setup.axes[i].model) {
      const compensation::CompensationSettings& engine = setup.axes[i].engine;
      axis.engine.slew.max_slew_deg_per_h_per_s =
          compensation::greatest_slew_deg_per_h_per_s(*model, engine.slew, engine.max_bias_deg_per_h);
    }
  }
  complete_line(setup, 0, config.line);
  for (std::size_t i = 0; i < config.sensor_lines.size(); ++i) complete_line(setup, i + 1, config.sensor_lines[i].line);
  config.rate_hz = setup.frames->rate_hz;
  const compensation::PlausibilityLimits& limits = setup.axes.front().engine.plausibility;
  config.plausibility = {statement(limits.rate), statement(limits.temperature), statement(limits.uhfo)};
  return config;
}

/// All settings in force, with defaults and overrides.
ordered_json config_answer(const State& state) {
  const pipeline::Setup& setup = state.setup;
  ordered_json json = {{"file", setup.config.path}};
  json.update(config::config_keys().print(complete(setup)));
  for (const auto& [key, files] : {std::pair("log", &setup.config.log), std::pair("capture", &setup.config.capture)}) {
    if (*files && (*files)->keep_bytes >= config::kNoByteLimit) json[key]["keep_mib"] = nullptr;
  }
  for (const auto& axis : setup.frames->axes) {
    ordered_json& shown = json["axes"][axis.name];
    shown["unit_scale"] = axis.scale;
    shown.update(shown["correction"]);
    shown.erase("correction");
  }
  json["frames"] = {{"file", setup.config.frames},
                    {"name", setup.frames->name},
                    {"id", setup.frames->id},
                    {"rate_hz", setup.frames->rate_hz}};
  return json;
}

ordered_json version_answer(const State&) {
  return {{"name", "prismd"}, {"version", kVersion}, {"protocol", config::kProtocol}};
}

}  // namespace

ordered_json answer(const Sources& sources, std::string_view method, const std::vector<std::size_t>& axes) {
  using Answer = ordered_json (*)(const State&);
  using AxisAnswer = ordered_json (*)(const State&, std::size_t axis);
  static const std::map<std::string_view, Answer> kAnswers = {
      {"version", version_answer}, {"status", status_answer}, {"line", line_answer}, {"config", config_answer}};
  static const std::map<std::string_view, AxisAnswer> kAxisAnswers = {
      {"bias", bias_answer}, {"stability", stability_answer}, {"model", model_answer}};
  const State state(sources);
  if (const auto found = kAnswers.find(method); found != kAnswers.end()) return found->second(state);
  ordered_json json;
  for (const std::size_t axis : axes) json["axes"][state.device.axes[axis].name] = kAxisAnswers.at(method)(state, axis);
  return json;
}

std::string summary(const Sources& sources) {
  const State state(sources);
  const pipeline::Device& device = state.device;
  const std::string& path = state.config.line.device;
  if (state.line.state == pipeline::LineState::kReplaying) return fmt::format("replaying, {} frames", device.frames());
  if (state.line.state != pipeline::LineState::kReceiving)
    return fmt::format("{}: {}", path.empty() ? "no line" : path,
                       state.line.detail.empty() ? "waiting" : state.line.detail);
  std::string text = fmt::format("receiving from {}, {} frames, quality", path, device.frames());
  for (std::size_t i = 0; i < device.axes.size(); ++i) {
    text += fmt::format("{} ", i > 0 ? "," : "");
    if (device.axes.size() > 1) text += device.axes[i].name + " ";
    text += state.axes[i].quality();
  }
  for (std::size_t i = 0; i < state.setup.sensor_lines.size(); ++i) {
    const pipeline::LineStatus& line = device.lines[i + 1];
    if (!line.delivers()) text += fmt::format(", {} {}", state.setup.sensor_lines[i].name, state_name(line.state));
  }
  return text;
}

}  // namespace prism::socket
