// SPDX-License-Identifier: MIT
// A device as scripts: its rows, events, captures and sent frames, what a reload changes, and what a set-up contains.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "compensation/model_text.hpp"
#include "compensation/polynomial_model.hpp"
#include "config/version.hpp"
#include "daemon/pipeline/device.hpp"
#include "tests/support/models.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

using test::next;
using test::rest_of;
using Lines = std::vector<std::string>;

/// Configurations of text lines with 10 frames a second: counter, rates of x and z, T, and the sensor "case".
class ConfigFolder {
 public:
  ConfigFolder() { describe("rate"); }

  /// `meaning`: of the numbers of x and z, or "tagged": rates with a counter of tenths of a second; `more`: of the
  /// gyro.
  void describe(std::string meaning, const std::string& more = "") {
    const bool is_tagged = meaning == "tagged";
    if (is_tagged) meaning = "rate";
    const char* const unit = meaning == "rate" ? "deg/h" : "arcsec";
    const std::string number = fmt::format(R"("type": "decimal", "unit": "{}")", unit);
    write("lines.json",
          fmt::format(
              R"({{"format": "prism-frames", "version": 1, "name": "lines", "line": {{"baud": 9600}}, "rate_hz": 10,
        "kinds": [{{"name": "data", "length": {{"terminator": "0D 0A", "min": 6, "max": 60}}, "text": {{"separators": " ",
        "columns": 5, "write": "{{n:d}} {{x:.3f}} {{z:.3f}} {{t:.2f}} {{case:.2f}}"}}, "fields": {{"n": {{"column": 0, "type": "decimal"}},
        "x": {{"column": 1, {}}}, "z": {{"column": 2, {}}}, "t": {{"column": 3, "type": "decimal", "unit": "degC"}},
        "case": {{"column": 4, "type": "decimal", "unit": "degC"}}}}}}],
        "gyro": {{"meaning": "{}", "unit": "{}", "axes": {{"x": "x", "z": "z"}}{}}},
        "counter": {{"field": "n", "modulus": 1000{}}}, "temperature": {{"field": "t"}}, "sensors": {{"case": {{"field": "case", "unit": "degC"}}}}}})",
              number, number, meaning, unit, more, is_tagged ? R"(, "ticks_per_s": 10)" : ""));
  }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_.file(name)) << text; }
  /// Writes a model of T with a window of 5 s: NAME, then "serial S", "axis A", "gap SECONDS", "noise
  /// DEG_PER_H" of its seconds, "input NAME", "sensor NAME UNIT".
  void write_model(std::istream& words) {
    const auto name = next<std::string>(words);
    compensation::FeatureDefinition features;
    features.length_s = 5, features.end_mean_s = 2, features.max_gap_s = 2;
    std::vector<std::string> inputs;
    std::string serial, axis;
    std::optional<compensation::RateNoise> noise;
    for (std::string word; words >> word;) {
      const auto value = next<std::string>(words);
      if (word == "serial") serial = value;
      if (word == "axis") axis = value;
      if (word == "gap") features.max_gap_s = std::stoi(value);
      if (word == "noise") noise = {0.001, 0.001, std::stod(value)};
      if (word == "input") inputs.push_back(value);
      if (word == "sensor") features.sensors.push_back({value, next<std::string>(words)});
    }
    if (inputs.empty()) inputs = {"T"};
    compensation::ModelInfo info =
        test::linear_model(inputs, std::vector<double>(inputs.size(), 0.01), 0, features)->info();
    info.gyro_serial = serial, info.gyro_axis = axis;
    std::vector<compensation::Term> terms = {{std::vector<int>(inputs.size(), 0), 0.25}};
    write(name, compensation::format_model(compensation::PolynomialModel(info, terms, 0.001), "{}", noise));
  }
  /// Loads MEMBERS of a configuration, in which @ is this folder, and MODEL a model of T of 5 s.
  Result<Setup> load(const std::string& members, const Overrides& overrides = {}) {
    auto json =
        nlohmann::ordered_json::parse(R"({"name": "gyro", "frames": "@lines.json", "line": {"device": "/dev/null"},
        "clock": "device", "socket": {"path": "@socket"}})");
    json.update(nlohmann::ordered_json::parse("{" + members + "}"));
    std::string text = json.dump();
    text = std::regex_replace(text, std::regex("MODEL"), "SOURCE/tests/replay/frames/models/T.json");
    text = std::regex_replace(text, std::regex("SOURCE"), PRISM_SOURCE_DIR);
    write("gyro.json", std::regex_replace(text, std::regex("@"), folder_.file("")));
    return load_setup(folder_.file("gyro.json"), overrides);
  }
  std::string file(const std::string& name) const { return folder_.file(name); }
  /// Without what depends on this run: @ for the folder, SOURCE for the source, and the number of digits of an id.
  std::string plain(std::string text) const {
    for (const auto& [found, shown] : {std::pair(folder_.file(""), "@"),
                                       {std::string(PRISM_SOURCE_DIR), "SOURCE"},
                                       {std::string(kVersion), "VERSION"}}) {
      for (auto at = text.find(found); at != std::string::npos; at = text.find(found, at))
        text.replace(at, found.size(), shown);
    }
    static const std::regex id("[0-9a-f]{12,}");
    std::string shown;
    auto rest = text.cbegin();
    for (std::sregex_iterator found(text.begin(), text.end(), id), end; found != end; ++found) {
      shown.append(rest, text.cbegin() + found->position()).append(fmt::format("ID{}", found->length()));
      rest = text.cbegin() + found->position() + found->length();
    }
    return shown.append(rest, text.cend());
  }

 private:
  test::TemporaryFolder folder_;
};

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
double after_start(std::int64_t time_ns) { return static_cast<double>(time_ns - kStart_ns) / 1e9; }

/// Lines of equal text of one source are one line: "0.1 to 2 out 1: 8 9".
class Transcript {
 public:
  void add(const std::string& source, double time_s, const std::string& text) {
    const auto last =
        std::find_if(lines_.rbegin(), lines_.rend(), [&](const Line& line) { return line.source == source; });
    if (last != lines_.rend() && last->text == text) {
      last->end_s = time_s;
    } else {
      lines_.push_back({source, text, time_s, time_s});
    }
  }
  Lines taken() {
    Lines given;
    for (const Line& line : std::exchange(lines_, {})) {
      const std::string end = line.end_s == line.begin_s ? "" : fmt::format(" to {:g}", line.end_s);
      given.push_back(fmt::format("{:g}{} {}: {}", line.begin_s, end, line.source, line.text));
    }
    return given;
  }

 private:
  struct Line {
    std::string source, text;
    double begin_s, end_s;
  };
  std::vector<Line> lines_;
};

std::string shown(const char* name, double value) {
  return std::isnan(value) ? "" : fmt::format(", {} {:.6g}", name, value);
}

/// The log of an axis: prints its rows.
class ShownLog : public RowWriter {
 public:
  ShownLog(Transcript& transcript, std::string name) : transcript_(transcript), name_(std::move(name)) {}
  void append(const compensation::CompensatedWindow& row, std::int64_t session_ns) override {
    const compensation::SecondMean& mean = row.window.second_mean;
    std::string text = fmt::format("{} samples", mean.samples);
    if (mean.missing_frames > 0) text += fmt::format(", {} missing", mean.missing_frames);
    text += shown("rate", mean.rate_deg_per_h) + shown("T", mean.temperature_degc) + shown("U", mean.uhfo_v);
    for (const double value : mean.sensors) text += fmt::format(", sensor {:.6g}", value);
    text += ", " + compensation::quality_text(row.correction.quality) + shown("bias", row.correction.bias_deg_per_h) +
            shown("offset", row.correction.offset_deg_per_h) + shown("corrected", row.corrected_deg_per_h) +
            shown("sent", row.sent_deg_per_h) + (mean.partial ? ", partial" : "");
    const std::int64_t end = mean.second + 1 - kStart_ns / 1'000'000'000;
    const auto end_s = static_cast<double>(end);
    text +=
        fmt::format(", arrived {:+.4g}, session {:g}", after_start(mean.arrival_ns) - end_s, after_start(session_ns));
    transcript_.add("log " + name_, end_s, text);
  }
  void sync() override { transcript_.add("log " + name_, 0, "sync"); }
  void set_metadata(const std::string& metadata) override {
    transcript_.add("log " + name_, 0, "metadata " + metadata.substr(metadata.find("# model"), 13));
  }
  void read(const RowQuery&, Pages) override {}
  void close() override { transcript_.add("log " + name_, 0, "closed"); }
  const LogCounters& counters() const override { return counters_; }

 private:
  Transcript& transcript_;
  const std::string name_;
  LogCounters counters_;
};

/// The capture of a line.
class ShownCapture : public CaptureSink {
 public:
  ShownCapture(Transcript& transcript, std::size_t line)
      : transcript_(transcript), name_(fmt::format("capture {}", line)) {}
  void record(drivers::CaptureEvent event, std::span<const std::uint8_t> bytes, std::int64_t time_ns) override {
    const bool is_mark = event == drivers::CaptureEvent::kOpened;
    transcript_.add(name_, after_start(time_ns), is_mark ? "opened" : fmt::format("{} bytes", bytes.size()));
  }
  void flush() override { transcript_.add(name_, 0, "flushed"); }
  std::uint64_t dropped_bytes() const override { return 0; }

 private:
  Transcript& transcript_;
  const std::string name_;
};

class DevicePlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "described") {  // rate | increment | accumulated [MORE of the gyro]
      const auto meaning = next<std::string>(words);
      folder_.describe(meaning, rest_of(words));
    } else if (command == "file") {  // NAME TEXT
      const auto name = next<std::string>(words);
      folder_.write(name, rest_of(words));
    } else if (command == "model") {
      folder_.write_model(words);
    } else if (command == "config") {  // MEMBERS
      return make(rest_of(words));
    } else if (command == "reload") {  // MEMBERS
      return reload(rest_of(words));
    } else if (command == "wait") {  // SECONDS
      now_ns_ += std::llround(1e9 * next<double>(words));
    } else if (command == "lose") {  // FRAMES
      number_ += next<int>(words);
    } else if (command == "begin") {  // [LINE]
      device_->begin_session(next<std::size_t>(words), now_ns_);
    } else if (command == "finish") {  // [LINE]
      device_->finish(next<std::size_t>(words));
    } else if (command == "expire") {  // [LINE]
      device_->expire(next<std::size_t>(words), now_ns_);
    } else if (command == "sync") {
      device_->sync();
    } else if (command == "close") {
      device_->close();
    } else if (command == "clock") {  // +SECONDS
      const std::int64_t before_ns = std::exchange(now_ns_, now_ns_ + std::llround(1e9 * next<double>(words)));
      device_->clock_set(before_ns, now_ns_);
    } else if (command == "sensors") {  // LINE TEXT
      const auto line = next<std::size_t>(words);
      feed(line, rest_of(words) + "\r\n");
    } else if (command == "bytes") {  // TEXT, without an end of line
      feed(kGyroLine, rest_of(words));
    } else if (command == "offset") {  // AXIS [DEG_PER_H MODEL EXPIRES_S]
      return offset(words);
    } else if (command == "offsets") {  // NOW_S UPTIME_S
      const auto now_s = next<std::int64_t>(words);
      device_->end_offsets(now_s, next<std::int64_t>(words));
    } else if (command == "state") {
      return state();
    } else {  // N x TEXT: lines of the gyro, ten a second; # is the counter; x2: which counts by 2
      const auto times = next<std::string>(words);
      const std::string text = rest_of(words) + "\r\n";
      for (int i = 0; i < std::stoi(command); ++i) {
        std::string line = text;
        if (const auto at = line.find('#'); at != std::string::npos)
          line.replace(at, 1, std::to_string(number_ % 1000));
        number_ += times == "x2" ? 2 : 1;
        now_ns_ += 100'000'000;
        feed(kGyroLine, line);
      }
    }
    return transcript_.taken();
  }

 private:
  Lines make(const std::string& members) {
    auto setup = folder_.load(members);
    if (!setup) return {folder_.plain(setup.error().text())};
    std::vector<std::unique_ptr<RowWriter>> logs;
    for (std::size_t i = 0; setup->config.log && i < setup->axes.size(); ++i)
      logs.push_back(std::make_unique<ShownLog>(transcript_, log_name(*setup, i)));
    std::vector<std::unique_ptr<CaptureSink>> captures;
    for (std::size_t line = 0; setup->config.capture && line <= setup->sensor_lines.size(); ++line)
      captures.push_back(std::make_unique<ShownCapture>(transcript_, line));
    device_.emplace(
        *setup, std::move(logs), std::move(captures), [](const Rows&) {},
        [this](Severity severity, const std::string& kind, const std::string& text) {
          constexpr std::array kNames = {"debug", "info", "warning", "error"};
          transcript_.add(kNames.at(static_cast<std::size_t>(severity)), after_start(now_ns_),
                          kind + ": " + folder_.plain(text));
        },
        problems_);
    device_->send_by([this](std::size_t output, std::span<const std::uint8_t> bytes) {
      for (const std::string& text : sent_texts(bytes))
        transcript_.add(fmt::format("out {}", output), after_start(now_ns_), text);
    });
    device_->call_at_end_of_offsets([this](std::size_t axis, const Offset& ended) {
      transcript_.add("offset", after_start(now_ns_), fmt::format("ended on {}: {:g}", axis, ended.deg_per_h));
    });
    return {};
  }
  Lines reload(const std::string& members) {
    auto setup = folder_.load(members);
    if (!setup) return {folder_.plain(setup.error().text())};
    const Pipeline* const before = device_->pipeline.get();
    const std::uint64_t frames = device_->outputs.empty() ? 0 : device_->outputs[0].counters().frames;
    const auto reopen = device_->reconfigure(std::move(*setup));
    Lines given = transcript_.taken();
    if (!reopen) {
      given.push_back(folder_.plain(reopen.error().text()));
      return given;
    }
    std::string done = *reopen ? "lines reopened" : "";
    if (device_->pipeline.get() != before) done += (done.empty() ? "" : ", ") + std::string("new pipeline");
    if (frames > 0 && (device_->outputs.empty() || device_->outputs[0].counters().frames < frames))
      done += (done.empty() ? "" : ", ") + std::string("new outputs");
    given.push_back(done.empty() ? "in use" : done);
    return given;
  }
  Lines offset(std::istream& words) {
    const auto axis = next<std::size_t>(words);
    std::optional<Offset> wanted;
    if (double deg_per_h = 0; words >> deg_per_h) {
      wanted.emplace();
      wanted->deg_per_h = deg_per_h;
      wanted->reason = "test";
      const compensation::ModelPtr& model = device_->setup.axes[axis].model;
      wanted->model = next<std::string>(words) == "own" && model ? model->info().id : "another";
      wanted->set_s = kStart_ns / 1'000'000'000;
      wanted->expires_s = next<std::int64_t>(words);
      if (wanted->expires_s > 0) wanted->expires_s += wanted->set_s;
    }
    device_->use_offset(axis, wanted, wanted ? "set" : "cleared");
    return transcript_.taken();
  }
  Lines state() {
    Lines given = {fmt::format("{} frames, {} sessions, last data {:g}, last frame {:g}", device_->frames(),
                               device_->sessions, after_start(device_->lines[0].last_data_ns),
                               after_start(device_->pipeline->last_frame_ns()))};
    for (const AxisRecord& axis : device_->axes)
      given.push_back(fmt::format(
          "{}: {} seconds, {} windows, {} corrected{}{}", axis.name, axis.seconds, axis.windows, axis.corrected,
          axis.last_sample ? fmt::format(", sample {:g}", axis.last_sample->sample.rate_deg_per_h) : "",
          axis.last_window ? fmt::format(", window {:g}", axis.last_window->window.second_mean.rate_deg_per_h) : ""));
    for (const CorrectedFrames& output : device_->outputs) {
      std::string forms;
      for (std::size_t i = 0; i < kForms.size(); ++i)
        forms += fmt::format(", {} {}", output.counters().by_form[i], kForms[i]);
      given.push_back(
          fmt::format("out: {} frames{}, {} unfit", output.counters().frames, forms, output.counters().unfit));
    }
    std::string sensors = "sensors";
    for (const double value : device_->pipeline->sensors_now(now_ns_)) sensors += fmt::format(" {:g}", value);
    given.push_back(sensors);
    for (const Problem& problem : problems_.list()) given.push_back("problem: " + problem.text);
    return given;
  }
  void feed(std::size_t line, const std::string& text) {
    device_->feed(line, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, now_ns_);
  }
  /// Lines without their counter, and prism's own messages.
  static Lines sent_texts(std::span<const std::uint8_t> bytes) {
    Lines texts;
    const std::string all(bytes.begin(), bytes.end());
    for (std::size_t at = 0; at < all.size();) {
      if (all.compare(at, 2, "PR") == 0 && all.size() >= at + 44) {
        const auto number = [&]<class T>(std::size_t offset, T value) {
          std::memcpy(&value, all.data() + at + offset, sizeof value);
          return value;
        };
        texts.push_back(fmt::format("prism axis {} rate {:g} correction {:g} quality {:x}",
                                    int{number(3, std::uint8_t{})}, number(16, 0.0), number(24, 0.0),
                                    number(36, std::uint32_t{})));
        at += 44;
        continue;
      }
      const std::size_t end = std::min(all.find("\r\n", at), all.size());
      const std::string line = all.substr(at, end - at);
      texts.push_back(end < all.size() ? line.substr(line.find(' ') + 1) : "bytes " + line);
      at = end + 2;
    }
    return texts;
  }

  ConfigFolder folder_;
  Transcript transcript_;
  std::int64_t now_ns_ = kStart_ns;
  int number_ = 0;
  Problems problems_{[this](bool begins, const std::string& kind, const std::string& text) {
    transcript_.add(begins ? "begin" : "end", after_start(now_ns_), kind + ": " + text);
  }};
  std::optional<Device> device_;
};

TEST(Device, Scripts) { test::expect_scripts<DevicePlayer>("pipeline/device.txt"); }

/// Loaded set-ups. "load MEMBERS", and before it "option NAME VALUE" of the command line.
class LoadPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "described") {
      const auto meaning = next<std::string>(words);
      folder_.describe(meaning, rest_of(words));
    } else if (command == "file") {
      const auto name = next<std::string>(words);
      folder_.write(name, std::regex_replace(rest_of(words), std::regex("@"), folder_.file("")));
    } else if (command == "model") {
      folder_.write_model(words);
    } else if (command == "option") {
      const auto name = next<std::string>(words);
      const std::string value = std::regex_replace(rest_of(words), std::regex("@"), folder_.file(""));
      if (name == "model") overrides_.model = value;
      if (name == "device") overrides_.device = value;
      if (name == "socket") overrides_.socket = value;
      if (name == "out") overrides_.replay_log = value;
      if (name == "accept_clock") overrides_.accept_clock = true;
      if (name == "tolerate") overrides_.tolerate_models = true;
      if (name == "without_models") overrides_.without_models = true;
    } else if (command == "load") {
      auto loaded = folder_.load(rest_of(words), overrides_);
      if (!loaded) return {folder_.plain(loaded.error().text())};
      setup_ = std::move(*loaded);
      Lines notes;
      for (const std::string& note : setup_.notes) notes.push_back("note " + folder_.plain(note));
      return notes;
    } else if (setup_.axes.empty()) {
      return {"nothing is loaded"};
    } else if (command == "axes") {
      return axes();
    } else if (command == "lines") {
      return lines();
    } else if (command == "clock") {
      return {fmt::format("{} clock, {}rates to {:g} deg/h, differences to {:g} s",
                          setup_.clock.source == drivers::ClockSource::kDevice ? "device" : "host",
                          setup_.clock.check_frame_rate ? "checked, " : "", setup_.clock.max_rate_deg_per_h,
                          setup_.clock.max_difference_s)};
    } else if (command == "texts") {
      std::string metadata = folder_.plain(log_metadata(setup_, next<std::size_t>(words)));
      std::istringstream in(metadata);
      Lines given;
      for (std::string line; std::getline(in, line);) given.push_back(line);
      given.push_back(fmt::format("models {}", folder_.plain(models_text(setup_))));
      return given;
    }
    return {};
  }

 private:
  Lines axes() const {
    Lines given;
    for (std::size_t i = 0; i < setup_.axes.size(); ++i) {
      const Setup::Axis& axis = setup_.axes[i];
      const auto limits = [](const compensation::SensorLimits& sensor) {
        return fmt::format("{:g} to {:g}", sensor.low, sensor.high) +
               (std::isfinite(sensor.greatest_slope_per_s) ? fmt::format(" by {:g}", sensor.greatest_slope_per_s) : "");
      };
      const compensation::PlausibilityLimits& all = axis.engine.plausibility;
      given.push_back(fmt::format("{} as {}: model {}, fallback {}, thermometer {}, uhfo {}; rate {}, T {}, U {}",
                                  setup_.frames->axes[i].name, log_name(setup_, i),
                                  axis.model ? axis.model->info().name : "none",
                                  axis.fallback ? axis.fallback->info().name : "none", axis.thermometer, axis.uhfo,
                                  limits(all.rate), limits(all.temperature), limits(all.uhfo)));
      if (!axis.model_problem.empty()) given.push_back("problem " + folder_.plain(axis.model_problem));
    }
    return given;
  }
  Lines lines() const {
    const auto format = [](const transport::Settings& line) {
      return fmt::format("{} {} {}{}{}", transport::describe(line), line.format.baud, line.format.data_bits,
                         "NEO"[static_cast<std::size_t>(line.format.parity)], line.format.stop_bits);
    };
    Lines given;
    for (std::size_t i = 0; i <= setup_.sensor_lines.size(); ++i) {
      const wire::Commands& commands = setup_.line_commands(i);
      given.push_back(
          folder_.plain(fmt::format("line {}: {}{}{}, silent after {:g} s", i, format(setup_.line_settings(i)),
                                    commands.start ? fmt::format(", {} start", commands.start->size()) : "",
                                    commands.poll ? ", polls" : "", setup_.line_config(i).silence_s)));
    }
    for (const Setup::Output& output : setup_.outputs)
      given.push_back(folder_.plain(
          fmt::format("out {}: {}{}", output.config.frames, format(output.line), output.frames ? ", encoded" : "")));
    for (const SensorName& sensor : sensors_of_list(setup_.sensors))
      given.push_back(fmt::format("sensor {} {}", sensor.name, sensor.unit));
    const auto& config = setup_.config;
    given.push_back(folder_.plain(fmt::format("unit {}, socket {}, log {}, capture {}", unit_name(setup_),
                                              config.socket.path, config.log ? config.log->directory : "none",
                                              config.capture ? config.capture->directory : "none")));
    return given;
  }

  ConfigFolder folder_;
  Overrides overrides_;
  Setup setup_;
};

TEST(Setup, Scripts) { test::expect_scripts<LoadPlayer>("pipeline/loaded_setups.txt"); }

}  // namespace
}  // namespace prism::pipeline
