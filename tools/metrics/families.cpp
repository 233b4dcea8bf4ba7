// SPDX-License-Identifier: MIT
#include "tools/metrics/families.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "base/host_time.hpp"
#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "base/time_scale.hpp"
#include "compensation/sensors.hpp"
#include "config/socket_path.hpp"

namespace prism::metrics {
namespace {

using nlohmann::json;

constexpr Family kUp{"prism_up", Type::kGauge, "Whether the gyro's prismd responds."};
constexpr Family kInfo{"prism_info", Type::kGauge, "Version, frame description and serial number."};
constexpr Family kStart{"prism_start_time_seconds", Type::kGauge, "Start time of prismd, since 1970."};
constexpr Family kProblems{"prism_problems", Type::kGauge, "Problems that `prismctl status` lists now."};
constexpr Family kReceiving{"prism_line_receiving", Type::kGauge, "Whether the line delivers frames."};
constexpr Family kAge{"prism_last_data_age_seconds", Type::kGauge, "Time since the last bytes of the line."};
constexpr Family kSessions{"prism_line_sessions_total", Type::kCounter, "Number of sessions of the line."};
constexpr Family kBytes{"prism_line_bytes_total", Type::kCounter, "Bytes received."};
constexpr Family kFrames{"prism_line_frames_total", Type::kCounter, "Frames decoded."};
constexpr Family kRefused{"prism_line_refused_total", Type::kCounter, "Frames and bytes rejected, by reason."};
constexpr Family kMissing{"prism_frames_missing_total", Type::kCounter,
                          "Frames that the gyro sent but that were not received."};
constexpr Family kResets{"prism_clock_resets_total", Type::kCounter,
                         "How often the gyro's counter restarted or a clock was set."};
constexpr Family kHardware{"prism_line_hardware_errors_total", Type::kCounter,
                           "Errors that the serial driver counted, by kind."};
constexpr Family kGood{"prism_quality_good", Type::kGauge, "Whether the current correction is good."};
constexpr Family kReason{"prism_quality_reason", Type::kGauge, "Current reasons why the quality is not good."};
constexpr Family kRate{"prism_rate_degrees_per_hour", Type::kGauge, "Mean rate of the last second, as measured."};
constexpr Family kBias{"prism_bias_degrees_per_hour", Type::kGauge, "Current predicted bias."};
constexpr Family kSd{"prism_bias_sd_degrees_per_hour", Type::kGauge,
                     "Standard deviation of true minus predicted bias."};
constexpr Family kCorrected{"prism_corrected_rate_degrees_per_hour", Type::kGauge,
                            "Mean rate of the last second minus the bias."};
constexpr Family kMean{"prism_mean_corrected_rate_degrees_per_hour", Type::kGauge,
                       "Mean rate of the window minus the bias."};
constexpr Family kDifference{"prism_earth_rate_difference_degrees_per_hour", Type::kGauge,
                             "Corrected rate minus the Earth rate, at rest."};
constexpr Family kDifferenceSd{"prism_earth_rate_difference_sd_degrees_per_hour", Type::kGauge,
                               "Standard deviation of that difference that model and mount explain."};
constexpr Family kVerdict{"prism_monitor_verdict", Type::kGauge, "The last verdict of prismcal monitor on the model."};
constexpr Family kVerdictTime{"prism_monitor_timestamp_seconds", Type::kGauge, "Time of that verdict, since 1970."};
constexpr Family kTemperature{"prism_temperature_celsius", Type::kGauge, "Mean temperature of the window."};
constexpr Family kSlope{"prism_temperature_slope_celsius_per_second", Type::kGauge,
                        "Slope of the temperature over the window."};
constexpr Family kUhfo{"prism_uhfo_volts", Type::kGauge,
                       "Mean voltage of the high-frequency oscillator over the window."};
constexpr Family kModel{"prism_model_info", Type::kGauge, "The model in use: type, name, id."};
constexpr Family kStability{"prism_stability_degrees_per_hour", Type::kGauge,
                            "Standard deviation of block means since the start, raw and corrected."};
constexpr Family kRows{"prism_log_rows_total", Type::kCounter, "Rows of the log written."};
constexpr Family kDropped{"prism_log_dropped_rows_total", Type::kCounter, "Rows dropped because of disk errors."};
constexpr Family kPending{"prism_log_pending_rows", Type::kGauge, "Rows waiting for the disk."};
constexpr Family kCapture{"prism_capture_dropped_bytes_total", Type::kCounter,
                          "Bytes of the capture dropped because of disk errors."};
constexpr Family kGone{"prism_log_gone_rows_total", Type::kCounter,
                       "Rows that a reader asked for and that retention had deleted."};
constexpr Family kClients{"prism_clients", Type::kGauge, "Connected clients."};
constexpr Family kClientRows{"prism_client_lost_rows_total", Type::kCounter, "Rows that slow clients lost."};
constexpr Family kSensorLine{"prism_sensor_line_receiving", Type::kGauge,
                             "Whether the line of an instrument delivers values."};
constexpr Family kOutFrames{"prism_out_frames_total", Type::kCounter,
                            "Frames of an output by how they left, or did not."};
constexpr Family kOutLost{"prism_out_lost_bytes_total", Type::kCounter,
                          "Bytes that an output could not write: closed, or its reader too slow."};
constexpr Family kOutLatency{"prism_out_latency_seconds", Type::kGauge,
                             "From the read of a frame's last byte to the end of its write."};
constexpr Family kRelayUp{"prism_relay_up", Type::kGauge,
                          "Whether the relay runs: it wrote its status within the last 10 s."};
constexpr Family kRelayTargetUp{"prism_relay_target_up", Type::kGauge, "1 if the server is connected, else 0."};
constexpr Family kRelayFailures{"prism_relay_failures_total", Type::kCounter,
                                "Failed connections and operations of the server."};
constexpr Family kRelayDropped{"prism_relay_dropped_messages_total", Type::kCounter,
                               "Messages dropped instead of sent."};
constexpr Family kRelayLast{"prism_relay_last_success_timestamp_seconds", Type::kGauge,
                            "Unix time of the last commit or acknowledged message."};
constexpr Family kRelayRows{"prism_relay_rows_total", Type::kCounter, "Rows committed since the relay started."};
constexpr Family kRelayRefused{"prism_relay_refused_rows_total", Type::kCounter, "Invalid lines of the log."};
constexpr Family kRelayMissing{"prism_relay_missing_rows_total", Type::kCounter, "Rows deleted before they were sent."};
constexpr Family kRelayBehind{"prism_relay_behind_seconds", Type::kGauge,
                              "Age of the last committed row if further rows may wait, else 0."};
constexpr Family kRelayLag{"prism_relay_lag_seconds", Type::kGauge,
                           "Time from the arrival of the last row at the host to its commit."};
constexpr Family kMade{"prism_metrics_timestamp_seconds", Type::kGauge,
                       "Time at which these metrics were written, since 1970."};

constexpr const char* kSensorHelp = "A sensor of the device or of an instrument.";

double value_of(const json& value) {
  if (value.is_boolean()) return value.get<bool>() ? 1 : 0;
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

/// Writes samples with the same labels.
class Writer {
 public:
  Writer(Exposition& exposition, Labels labels) : out_(exposition), labels_(std::move(labels)) {}

  void put(const Family& family, const json& value) const { out_.add(family, labels_, value_of(value)); }
  void put(const Family& family, const Labels& more, double value) const { out_.add(family, with(more), value); }
  Writer of(const Labels& more) const { return {out_, with(more)}; }

 private:
  Labels with(const Labels& more) const {
    Labels all = labels_;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Exposition& out_;
  Labels labels_;
};

void add_line(const Writer& gyro, const json& status, const json& line) {
  if (const json& problems = member(member(status, "health"), "problems"); problems.is_array())
    gyro.put(kProblems, {}, static_cast<double>(problems.size()));
  gyro.put(kReceiving, text_member(status, "state") == "receiving");
  gyro.put(kAge, member(status, "age_s"));
  gyro.put(kSessions, member(status, "sessions"));
  const json& counters = member(status, "line");
  gyro.put(kBytes, member(counters, "bytes"));
  gyro.put(kFrames, member(counters, "frames"));
  for (const char* reason :
       {"bad_check", "bad_length", "bad_body", "refused", "skipped_bytes", "timeouts", "unconfirmed", "out_of_range"})
    gyro.put(kRefused, {{"reason", reason}}, value_of(member(counters, reason)));
  const json& timing = member(status, "timing");
  gyro.put(kMissing, member(timing, "missing_frames"));
  gyro.put(kResets, member(timing, "resets"));
  for (const char* kind : {"framing_errors", "parity_errors", "overruns", "breaks", "buffer_overruns"})
    gyro.put(kHardware, {{"kind", kind}}, value_of(member(member(line, "hardware"), kind)));
  for (const auto& [name, own] : member(status, "sensor_lines").items())
    gyro.put(kSensorLine, {{"line", name}}, text_member(own, "state") == "receiving");
  int number = 0;
  for (const json& own : member(status, "out")) {
    const std::pair<std::string, std::string> output{"output", std::to_string(++number)};
    for (const char* form : {"corrected", "fading", "held", "raw", "dropped", "unfit"})
      gyro.put(kOutFrames, {output, {"form", form}}, value_of(member(own, form)));
    gyro.put(kOutLost, {output}, value_of(member(own, "lost_bytes")));
    for (const auto& [quantile, key] : {std::pair("0.5", "latency_p50_s"), std::pair("0.99", "latency_p99_s")})
      gyro.put(kOutLatency, {output, {"quantile", quantile}}, value_of(member(own, key)));
  }
}

void add_quality(const Writer& axis, const std::string& quality) {
  axis.put(kGood, quality == "good");
  for (std::size_t begin = 0; begin < quality.size() && quality != "good";) {
    const std::size_t end = std::min(quality.find('+', begin), quality.size());
    axis.put(kReason, {{"reason", quality.substr(begin, end - begin)}}, 1);
    begin = end + 1;
  }
}

void add_axis(const Writer& axis, const json& own, const json& stability) {
  add_quality(axis, text_member(own, "quality"));
  const json& window = member(own, "window");
  axis.put(kRate, member(window, "rate_deg_per_h"));
  axis.put(kBias, member(window, "bias_deg_per_h"));
  axis.put(kSd, member(window, "sd_deg_per_h"));
  axis.put(kCorrected, member(window, "corrected_deg_per_h"));
  axis.put(kMean, member(window, "corrected_mean_deg_per_h"));
  axis.put(kDifference, member(member(own, "at_rest"), "difference_deg_per_h"));
  axis.put(kDifferenceSd, member(member(own, "at_rest"), "sd_deg_per_h"));
  if (const json& monitor = member(own, "monitor"); monitor.is_object()) {
    axis.put(kVerdict, {{"verdict", text_member(monitor, "verdict")}}, 1);
    axis.put(kVerdictTime, member(monitor, "at_s"));
  }
  axis.put(kTemperature, member(window, "mean_temperature_degc"));
  axis.put(kSlope, member(window, "slope_degc_per_s"));
  axis.put(kUhfo, member(window, "mean_uhfo_v"));
  if (const json& model = member(own, "model"); model.is_object())
    axis.put(kModel,
             {{"kind", text_member(model, "kind")},
              {"name", text_member(model, "name")},
              {"id", text_member(model, "id").substr(0, 16)}},
             1);
  for (const char* of : {"raw", "corrected"})
    axis.put(kStability, {{"of", of}}, value_of(member(member(stability, of), "sd_deg_per_h")));
}

void add_log(const Writer& gyro, const json& status) {
  const json& log = member(status, "log");
  gyro.put(kRows, member(log, "rows"));
  gyro.put(kDropped, member(log, "dropped"));
  gyro.put(kGone, member(log, "gone"));
  gyro.put(kPending, member(log, "pending"));
  gyro.put(kCapture, member(member(status, "capture"), "dropped_bytes"));
  gyro.put(kClients, member(member(status, "clients"), "connected"));
  gyro.put(kClientRows, member(member(status, "clients"), "lost_rows"));
}

void add_sensors(const Writer& gyro, const json& sensors) {
  for (const auto& [name, own] : sensors.items()) {
    const std::string unit = text_member(own, "unit");
    for (const SensorUnit& known : kSensorUnits) {
      if (known.unit == unit)
        gyro.put({known.metric, Type::kGauge, kSensorHelp}, {{"sensor", name}}, value_of(member(own, "value")));
    }
  }
}

}  // namespace

void add_gyro(Exposition& exposition, const std::string& name, const GyroAnswers& answers) {
  const Writer gyro(exposition, {{"gyro", name}});
  const json& status = answers.status;
  gyro.put(kUp, status.is_object());
  if (!status.is_object()) return;
  gyro.put(kInfo,
           {{"version", text_member(status, "version")},
            {"frames", text_member(status, "frames")},
            {"serial", text_member(status, "gyro_serial")}},
           1);
  gyro.put(kStart, member(status, "started_s"));
  add_line(gyro, status, answers.line);
  add_log(gyro, status);
  add_sensors(gyro, member(status, "sensors"));
  const json& axes = member(status, "axes");
  for (const auto& [axis, own] : axes.items()) {
    if (!follows(TextRule::kAxisName, axis)) continue;
    add_axis(gyro.of({{"axis", axis}}), own, member(member(answers.stability, "axes"), axis));
  }
}

void add_relay(Exposition& exposition, const json& status, double now_s) {
  const std::string site = text_member(status, "site");
  const Writer relay(exposition, {{"site", site}});
  const bool is_up =
      std::abs(now_s - number_member(status, "time_s")) <= static_cast<double>(scaled_s(kRelayTimeout_s));
  relay.put(kRelayUp, is_up);
  if (!is_up) return;
  for (const auto& [name, own] : member(status, "targets").items()) {
    const Writer target = relay.of({{"target", name}});
    target.put(kRelayTargetUp, member(own, "up"));
    target.put(kRelayFailures, member(own, "failures"));
    target.put(kRelayDropped, member(own, "dropped_messages"));
    target.put(kRelayLast, member(own, "last_s"));
  }
  for (const json& own : member(status, "logs")) {
    const std::string gyro = text_member(own, "gyro");  // SITE/NAME
    const Writer log = relay.of({{"gyro", gyro.substr(gyro.find('/') + 1)}, {"axis", text_member(own, "axis")}});
    log.put(kRelayRows, member(own, "rows"));
    log.put(kRelayRefused, member(own, "refused_rows"));
    log.put(kRelayMissing, member(own, "missing_rows"));
    log.put(kRelayBehind, member(own, "behind_s"));
    log.put(kRelayLag, member(own, "lag_s"));
  }
}

void add_relays(Exposition& exposition) {
  for (const std::string& path : config::relay_status_files()) {
    const auto text = read_text_file(path);
    const json status = text ? parse_json_line(*text).value_or(json()) : json();
    if (text_member(status, "format") == "prismrelay-status") add_relay(exposition, status, host_time_s());
  }
}

void add_time(Exposition& exposition) { exposition.add(kMade, {}, host_time_s()); }

}  // namespace prism::metrics
