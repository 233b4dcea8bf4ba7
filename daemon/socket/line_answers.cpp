// SPDX-License-Identifier: MIT
#include "daemon/socket/line_answers.hpp"

#include "base/host_time.hpp"
#include "daemon/socket/answer_json.hpp"

namespace prism::socket {
namespace {

using nlohmann::ordered_json;

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

}  // namespace

std::int64_t time_of(const Sources& sources) {
  const pipeline::LineState state = sources.gyro_line().state;
  return state == pipeline::LineState::kReplaying || state == pipeline::LineState::kEnded
             ? sources.gyro_line().last_data_ns
             : host_time_ns();
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
          {"rejected_counters", pipeline.rejected_counters()},
          {"resets", c.resets},
          {"period_s", known(c.period_s)},
          {"period_is_estimated", c.period_is_estimated},
          {"residual_s", known(c.residual_s)}};
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

}  // namespace prism::socket
