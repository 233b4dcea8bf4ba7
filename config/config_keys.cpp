// SPDX-License-Identifier: MIT
// The keys of prismd.json.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>

#include "base/json_table.hpp"
#include "config/config.hpp"

namespace prism::config {
namespace {

constexpr std::array kLineEnds = {"lf", "cr"};
constexpr std::array kClocks = {"host", "device"};
constexpr std::array kFullPolicies = {"stop", "delete_oldest"};
constexpr std::array kAfterHold = {"raw", "drop"};
constexpr std::array kLevels = {"debug", "info", "warning", "error"};
constexpr double kMostColumns = 64;  // of a line of text
constexpr double kMiB = 1 << 20, kHour = 3600;

// Of any line: its place and format, and when it is opened again.
JsonTable<LineConfig> place_keys() {
  return JsonTable<LineConfig>()
      .text("device", &LineConfig::device, "The serial device. A live run requires it, tcp or udp.")
      .group(transport::network_keys(), &LineConfig::network)
      .integer("baud", {50, 20e6}, &LineConfig::baud, "")
      .integer("data_bits", {5, 8}, &LineConfig::data_bits, "")
      .choice("parity", wire::kParities, &LineConfig::parity, "")
      .integer("stop_bits", {1, 2}, &LineConfig::stop_bits, "Speed and format; default: the description's.")
      .number("retry_min_s", {0.01, 60}, &LineConfig::retry_min_s, "")
      .number(
          "retry_max_s", {0.01, 600}, &LineConfig::retry_max_s,
          "First and longest pause before an existing line that fails or is silent is reopened. An absent device is "
          "tried each retry_min_s.")
      .read_by([](const Section& section, LineConfig& line) {
        line.retry_max_s =
            section.number("retry_max_s", {line.retry_min_s, 600}, std::max(line.retry_max_s, line.retry_min_s));
      });
}

JsonTable<LineConfig> line_keys() {
  return place_keys()
      .number("silence_s", {0.1, 3600}, &LineConfig::silence_s,
              "Receive timeout: without a byte for this time, the line is silent and is reopened.")
      .group(wire::command_keys(), &LineConfig::commands)
      .boolean("allow_send", &LineConfig::allow_send,
               "Root and the user that prismd runs as may send bytes with prismctl send.");
}

JsonTable<TextColumn> column_keys() {
  const auto unit = [](auto& column) -> auto& { return column.sensor.unit; };
  return JsonTable<TextColumn>()
      .value(
          "column", {{"type", "integer"}, {"minimum", 1}, {"maximum", kMostColumns}}, &TextColumn::column,
          {kRequired, "The first is 1."},
          [](const Section& section, const std::string& key) {
            return section.integer(key, {1, kMostColumns}) - 1;
          },
          [](int stored) { return Json(stored + 1); })
      .choice("unit", kSensorUnitNames, unit, {kRequired, "The sensor's unit."})
      .number("min", kAnyNumber, &TextColumn::min, "")
      .print_if([](const TextColumn& column) { return column.min > kAnyNumber.min; })
      .number("max", kAnyNumber, &TextColumn::max, "A value outside is unknown.")
      .print_if([](const TextColumn& column) { return column.max < kAnyNumber.max; })
      .then([](const Section& section, TextColumn& column) {
        if (column.min > column.max) section.fail("max", fmt::format("{} is below min {}", column.max, column.min));
      });
}

JsonTable<SensorLineConfig> sensor_line_keys() {
  using L = SensorLineConfig;
  const auto is_text = [](const L& line) { return !line.text.columns.empty(); };
  const auto of_text = [](auto member) {
    return [member](auto& line) -> auto& { return std::invoke(member, line.text); };
  };
  const auto name = [](auto& column) -> auto& { return column.sensor.name; };
  return JsonTable<L>()
      .group(line_keys(), &L::line)
      .text("frames", &L::frames, "Frame description without a gyro: name or path.")
      .number("stale_after_s", {0.1, 3600}, &L::stale_after_s,
              "A value is used for this time after its arrival, then it is unknown. Also the default of silence_s.")
      .then([](const Section& section, L& line) {
        if (!section.has("silence_s")) line.line.silence_s = line.stale_after_s;
      })
      .named("columns", "SENSOR", TextRule::kSensorName, column_keys(), of_text(&TextColumns::columns), name,
             "The sensors of an instrument that prints lines of numbers.")
      .value(
          "separators", {{"type", "string"}, {"minLength", 1}}, of_text(&TextColumns::separators),
          "Characters between columns; blanks alone: a run of them counts as one.",
          [](const Section& section, const std::string& key) { return section.raw_text(key); },
          [](const std::string& stored) { return Json(stored); })
      .print_if(is_text)
      .choice("line_end", kLineEnds, of_text(&TextColumns::ends_with_cr), "End of a line: LF or CR LF, or CR alone.")
      .print_if(is_text)
      .boolean("decimal_comma", of_text(&TextColumns::decimal_comma), "23,5 instead of 23.5.")
      .print_if(is_text)
      .then([is_text](const Section& section, L& line) {
        if (const std::string problem = separators_problem(line.text.separators); !problem.empty())
          section.fail("separators", problem);
        for (const char* key : {"separators", "line_end", "decimal_comma"}) {
          if (section.has(key) && !is_text(line)) section.fail(key, "given without \"columns\"");
        }
      });
}

JsonTable<AxisConfig> mounting_keys() {
  return JsonTable<AxisConfig>()
      .value(
          "sign", {{"type", "integer"}, {"enum", {1, -1}}}, &AxisConfig::sign, "Sense of the input axis.",
          [](const Section& section, const std::string& key) {
            const std::int64_t sign = section.integer(key, {-1, 1});
            if (sign == 0) section.fail(key, "found 0, expected 1 or -1");
            return sign;
          },
          [](double sign) { return Json(sign); })
      .number("scale_factor_arcsec_per_pulse", {1e-9, 1e6}, &AxisConfig::scale_factor_arcsec_per_pulse,
              "Scale factor of this gyro; default: the description's.")
      .print_if([](const AxisConfig&) { return false; });
}

JsonTable<AxisConfig> direction_keys() {
  return JsonTable<AxisConfig>()
      .number("elevation_deg", {-90, 90}, &AxisConfig::elevation_deg, "")
      .number(
          "azimuth_deg", {-360, 360}, &AxisConfig::azimuth_deg,
          "The input axis above the horizon and from north through east, for the Earth rate; stored in the log. prismd "
          "and prismcal name an axis that is not vertical and has no azimuth.")
      .number("direction_mrad", {0, 1000}, &AxisConfig::direction_mrad,
              "Uncertainty (1 sigma) of that direction; the difference from the Earth rate at rest includes it.")
      .then([](const Section& section, AxisConfig& axis) { axis.azimuth_stated = section.has("azimuth_deg"); });
}

JsonTable<AxisConfig> model_keys() {
  return JsonTable<AxisConfig>()
      .text("model", &AxisConfig::model, "")
      .text("fallback_model", &AxisConfig::fallback_model,
            "The bias model, and one with inputs T and U only, used until the window is full: names or paths.");
}

JsonTable<AxisConfig> correction_keys() {
  using E = compensation::CompensationSettings;
  // "blend" of version 0.1 is the last.
  std::vector<const char*> names(compensation::kExtrapolationNames.begin(), compensation::kExtrapolationNames.end());
  names.push_back("blend");
  const auto limited = [](auto& engine) -> auto& { return engine.slew.limited; };
  const auto most = [](auto& engine) -> auto& { return engine.slew.max_slew_deg_per_h_per_s; };
  return JsonTable<AxisConfig>().group(
      JsonTable<E>()
          .number("max_bias_deg_per_h", {1e-6, 1e6}, &E::max_bias_deg_per_h,
                  "A predicted bias outside plus or minus this is rejected.")
          .choice(
              "extrapolation", names, &E::extrapolation,
              "How predictions are used. shrink: shrunk towards the training mean by the model's uncertainty, "
              "everywhere. flag: unchanged. clamp: outside the training range, the prediction at its nearest point. "
              "preset means shrink for composite kernels, flag for other types. Inputs outside the training range "
              "are always marked extrapolating. blend (version 0.1) means shrink, with a warning, since it made real "
              "gyros worse.")
          .boolean("slew_limit", limited,
                   "The published bias changes no faster than max_slew_deg_per_h_per_s allows, and is marked "
                   "slew_limited while it is limited. The first bias after a time without one, or of another model, is "
                   "not limited. False: no limit.")
          .number("max_slew_deg_per_h_per_s", {1e-9, 1e6}, most,
                  "Maximum change of the bias. Default: four times the span of the model's bias over its training box, "
                  "in one window.")
          .then([](const Section& section, E& engine) {
            if (!engine.slew.limited && section.has("max_slew_deg_per_h_per_s"))
              section.fail("max_slew_deg_per_h_per_s", "given although \"slew_limit\" is false");
          }),
      &AxisConfig::engine);
}

JsonTable<AxisConfig> axis_keys() {
  const char* const help =
      "The sensor used as T or U of this axis, of the device or of a sensor line "
      "(chamber.temperature); default: the description's.";
  const auto is_given = [](std::string AxisConfig::*member) {
    return [member](const AxisConfig& axis) { return !(axis.*member).empty(); };
  };
  return JsonTable<AxisConfig>()
      .group(mounting_keys())
      .text("temperature", &AxisConfig::thermometer, "", TextRule::kSensorName)
      .print_if(is_given(&AxisConfig::thermometer))
      .text("uhfo", &AxisConfig::uhfo, help, TextRule::kSensorName)
      .print_if(is_given(&AxisConfig::uhfo))
      .group(direction_keys())
      .group(model_keys())
      .object("correction", correction_keys(), std::identity(), "");
}

// Keys of the only axis. With "axes" they are errors.
JsonTable<Config> only_axis(const JsonTable<AxisConfig>& keys) {
  const auto first = [](auto& config) -> auto& { return config.axes.front(); };
  JsonTable<Config> all, table;
  all.group(keys, first);
  for (auto row : all.rows()) {
    row.read = [key = row.key, read = row.read](const Section& section, Config& config) {
      if (!config.by_axes) return read(section, config);
      if (!key.empty() && section.has(key))
        section.fail(key, "given together with \"axes\"; expected it in each axis of \"axes\"");
    };
    if (row.print) {
      row.print = [print = row.print](const Config& config, Json& json) {
        if (!config.by_axes) print(config, json);
      };
    }
    table.row(row);
  }
  return table;
}

// A range, [low, high], and stuck_s, which has the same meaning for each sensor; `unit`: of the statement.
JsonTable<SensorStatement> limit_keys(const char* range, Range allowed, double unit, const char* slope,
                                      const char* help) {
  JsonTable<SensorStatement> keys;
  keys.custom(
      range,
      {{"type", "array"},
       {"minItems", 2},
       {"maxItems", 2},
       {"items", {{"type", "number"}, {"minimum", allowed.min}, {"maximum", allowed.max}}}},
      help,
      [=](const Section& section, SensorStatement& statement) {
        if (section.has(range)) statement.range = read_range(section, range, allowed, unit);
      },
      [=](const SensorStatement& statement, Json& json) {
        const auto known = [&](double end) { return std::isfinite(end) ? Json(end / unit) : Json(); };
        if (statement.range) json[range] = {known(statement.range->min), known(statement.range->max)};
      });
  if (slope != nullptr) {
    keys.number(slope, {1e-6, 1e6}, &SensorStatement::greatest_slope_per_s,
                "The same for a temperature that changes faster, with 2 degC allowed for noise and quantisation. It is "
                "accepted again once the thermometer could have reached it. Default: the description's, else 1.");
  }
  return keys.number("stuck_s", {1, 1e7}, &SensorStatement::stuck_s,
                     "The same for a value that is constant for longer than this. Not checked by default: a quantised "
                     "thermometer is constant at a soak, too.");
}

JsonTable<SensorStatements> plausibility_keys() {
  using S = SensorStatements;
  return JsonTable<S>()
      .object(
          "rate",
          limit_keys("range_deg_per_s", kRateRanges, kDegPerSInDegPerH, nullptr,
                     "Measuring range. Values outside are implausible: logged as measured, not used for corrections, "
                     "never good. One event reports the start, one the end. Default: the description's, else -10000 "
                     "to 10000."),
          &S::rate, "")
      .object("temperature",
              limit_keys("range_degc", kChannelRanges, 1, "greatest_slope_degc_per_s",
                         "The same. Default: the description's, else -90 to 200."),
              &S::temperature, "")
      .object("uhfo",
              limit_keys("range_v", kChannelRanges, 1, nullptr,
                         "The same. Default: the description's, else -1000 to 1000."),
              &S::uhfo, "");
}

JsonTable<LogSegmentSettings> segment_keys() {
  using S = LogSegmentSettings;
  return JsonTable<S>()
      .text("directory", &S::directory,
            "Directory of the segments; a relative one is in $LOGS_DIRECTORY if that is set. Default: $LOGS_DIRECTORY, "
            "or "
            "/var/log/prismd/NAME; of a capture, capture in it.")
      .number("segment_mib", {0.01, 1e6}, &S::max_bytes, "", kMiB)
      .number("segment_hours", {0.01, 8784}, &S::max_age_s,
              "A segment ends before it would exceed the size, and at multiples of the hours (of data time, UTC).",
              kHour)
      .number("keep_mib", {1, 1e9}, &S::keep_bytes, "", kMiB)
      .integer(
          "keep_days", {1, 36500}, &S::keep_days,
          "The oldest segments above either limit are deleted; if only keep_days is given, the size is not limited. "
          "prismd --check states the growth a day. The days are those that prismd ran since it closed the segment, "
          "not the date of its rows. The logs of several axes share keep_mib evenly. A replay deletes nothing.")
      .then([](const Section& section, S& segments) {
        if (section.has("keep_days") && !section.has("keep_mib")) segments.keep_bytes = kNoByteLimit;
      })
      .choice("when_full", kFullPolicies, &S::delete_when_full,
              "Disk full: drop and count rows until there is space, or delete the oldest segments.");
}

JsonTable<OutputConfig> output_keys() {
  using O = OutputConfig;
  const auto holds = [](const O& output) { return output.when_unknown == WhenUnknown::kHold; };
  return JsonTable<O>()
      .object("line", place_keys(), &O::line,
              "Where the frames leave: device, tcp (address or listen) or udp (address). Format as of the gyro's line.")
      .text(
          "frames", &O::frames,
          {kRequired,
           "same: every byte of the device goes out again, with the rates of the served axes corrected and the checks "
           "computed again. prism: prism's own message (docs/wire.md). Else a frame description, which is encoded."})
      .choice("when_unknown", kUnknownPolicies, &O::when_unknown,
              {kRequired,
               "Without a correction: raw passes frames as received, hold applies the last correction for hold_s, drop "
               "sends nothing."})
      .number("hold_s", {0.1, 86400}, &O::hold_s, "")
      .print_if(holds)
      .choice("then", kAfterHold, &O::then_drop, "Duration of hold, and what follows.")
      .print_if(holds)
      .boolean("unmarked", &O::unmarked,
               "True accepts frames of which nothing tells whether they are corrected: raw frames leave, and the "
               "description has no bit \"corrected\".")
      .number("fade_deg_per_h_per_s", {1e-9, 1e9}, &O::fade_deg_per_h_per_s,
              "A correction that begins, ends or comes from another model is faded by this much a second, so that a "
              "filter behind the gyro sees no step.")
      .boolean("capture", &O::capture, "Records the sent bytes in capture/out-N/; requires capture.")
      .then([holds](const Section& section, O& output) {
        if (holds(output)) return;
        for (const char* key : {"hold_s", "then"}) {
          if (section.has(key)) section.fail(key, "given without \"when_unknown\": \"hold\"");
        }
        output.hold_s = 0;
        output.then_drop = output.when_unknown == WhenUnknown::kDrop;
      });
}

JsonTable<SocketSettings> socket_keys() {
  using S = SocketSettings;
  return JsonTable<S>()
      .text("path", &S::path,
            "Default: /run/prismd/NAME.sock for root and for services of systemd, $XDG_RUNTIME_DIR/prismd/NAME.sock "
            "(/run/user/UID/prismd if not set) for other users; prismctl searches both. Empty: no socket. Under socket "
            "activation systemd's socket is used instead.")
      .value(
          "mode", {{"type", "string"}, {"pattern", "^0*[0-7]{1,3}$"}}, &S::mode, "Octal mode of the socket.",
          [](const Section& section, const std::string& key) {
            const std::string text = section.text(key);
            char* end = nullptr;
            const long mode = std::strtol(text.c_str(), &end, 8);
            if (text.empty() || *end != '\0' || mode < 0 || mode > 0777)
              section.fail(key, fmt::format("found \"{}\", expected an octal mode such as \"0660\"", text));
            return mode;
          },
          [](int mode) { return Json(fmt::format("{:04o}", mode)); })
      .integer("client_buffer_kib", {16, 1 << 20}, &S::client_buffer_bytes, "", 1024)
      .integer("max_clients", {1, 10000}, &S::max_clients,
               "Queue per client before it loses rows; maximum number of clients.");
}

}  // namespace

const JsonTable<Config>& config_keys() {
  using C = Config;
  static const JsonTable<C> keys =
      JsonTable<C>()
          .custom(
              "$schema", {{"description", "for editors"}}, "",
              [](const Section& section, C&) { section.any("$schema"); }, nullptr)
          .text("name", &C::name,
                "Name of the instance, its socket and its log segments: 1 to 90 bytes without /, no . first. Default: "
                "the file's name.",
                TextRule::kName)
          .object("gyro",
                  JsonTable<C>()
                      .text("serial", &C::gyro_serial,
                            "Serial number of the gyro, in one line. A model bound to another one is rejected.",
                            TextRule::kText)
                      .group(only_axis(JsonTable<AxisConfig>().text(
                          "axis", &AxisConfig::name,
                          "Axis of a multi-axis device, as named in its frame description; default: the first. "
                          "Only this one is served; axes serves several.",
                          TextRule::kAxisName)))
                      .group(only_axis(mounting_keys())),
                  std::identity(), "")
          .object("line", line_keys(), &C::line, "")
          .text("frames", &C::frames, "The frame description: name or path.")
          .number("rate_hz", {0.01, 100'000}, &C::rate_hz,
                  "Frames per second, if this gyro is set up for another rate than described.")
          .choice("clock", kClocks, &C::device_clock,
                  "Time source: arrival at this machine, or the frame's counter and the nominal frame rate.")
          .boolean(
              "accept_clock", &C::accept_clock,
              "No alarm if frames arrive at another rate than the description says; for a simulated gyro that runs "
              "faster.")
          .group(only_axis(model_keys()))
          .object("correction", only_axis(correction_keys()), std::identity(), "")
          .print_if([](const C& config) { return !config.by_axes; })
          .object("site",
                  JsonTable<C>()
                      .number("latitude_deg", {-90, 90}, &C::latitude_deg, "For the Earth rate; stored in the log.")
                      .group(only_axis(direction_keys())),
                  std::identity(), "")
          .named(
              "axes", "AXIS", TextRule::kAxisName, axis_keys(), &C::axes, &AxisConfig::name,
              "Axes to serve of a device with several, by their names in the frame description, instead of one axis by "
              "the keys of gyro, model, correction and site; do not use both. All share line, clock, capture and "
              "socket; each axis has its own log, NAME-AXIS-…csv. An axis that the device marks invalid is unknown; "
              "the others continue.")
          .named(
              "sensor_lines", "LINE", TextRule::kSensorName, sensor_line_keys(), &C::sensor_lines,
              &SensorLineConfig::name,
              "Lines of other instruments, by name; requires axes. Their sensors are called LINE.SENSOR: log columns, "
              "model inputs, or an axis's T. The line reconnects on its own and, with capture, has its own capture in "
              "CAPTURE/LINE/. Required of its keys: device, tcp or udp.")
          .object("plausibility", plausibility_keys(), &C::plausibility, "")
          .object("log", segment_keys(), &C::log, "")
          .custom(
              "write_log", {{"type", "boolean"}, {"default", true}}, "False: no log.",
              [](const Section& section, C& config) {
                if (section.boolean("write_log", true)) return;
                if (section.has("log")) section.fail("log", "given although \"write_log\" is false");
                config.log.reset();
              },
              nullptr)
          .object("capture", segment_keys(), &C::capture,
                  "Records every byte of the line in pcap segments. Absent: no capture.")
          .list("out", output_keys(), &C::outputs, "Lines on which corrected frames leave (docs/out.md).")
          .print_if([](const C& config) { return !config.outputs.empty(); })
          .object("socket", socket_keys(), &C::socket, "")
          .choice("event_level", kLevels, &C::event_level,
                  "Minimum severity of the events written to stderr or the journal.");
  return keys;
}

Json config_schema() {
  Config usual;
  usual.axes.emplace_back();
  return schema_of_file("prismd", "config/config_keys.cpp", config_keys().schema(usual));
}

}  // namespace prism::config
