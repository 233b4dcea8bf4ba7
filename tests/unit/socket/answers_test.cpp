// SPDX-License-Identifier: MIT
// Requests and their answers, as scripts (requests.txt, answers.txt); the configuration with every key in force.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "base/host_time.hpp"
#include "config/version.hpp"
#include "daemon/socket/publisher.hpp"
#include "daemon/socket/rpc.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/models.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::socket {
namespace {

using nlohmann::json;
using test::next;
using Lines = std::vector<std::string>;

/// A number with four digits; other values as they are.
std::string shown_value(const json& value) {
  return value.is_number_float() ? fmt::format("{:.4g}", value.get<double>()) : value.dump();
}

pipeline::RetentionStatus retention(std::optional<pipeline::NextDeletion> next) {
  return {3, 1000, 2000, 86'400, 4, 50, std::move(next), uptime_s() - 450};
}

/// A log whose state is stated: its pages are those that a script gives.
struct StatedLog : pipeline::RowWriter {
  explicit StatedLog(Lines& told) : told_(told) {}
  void append(const compensation::CompensatedWindow&, std::int64_t) override {}
  void sync() override {}
  void set_metadata(const std::string&) override {}
  void close() override {}
  void read(const pipeline::RowQuery& query, Pages done) override {
    told_.push_back(
        fmt::format("read {} from \"{}\"{}", query.limit, query.after, query.header ? " with headers" : ""));
    done(pages.front());
    if (pages.size() > 1) pages.erase(pages.begin());
  }
  std::optional<pipeline::RetentionStatus> retention() const override { return status; }
  const pipeline::LogCounters& counters() const override { return counted; }

  pipeline::LogCounters counted;
  std::optional<pipeline::RetentionStatus> status;
  std::vector<pipeline::RowResult> pages;  ///< the last one again and again

 private:
  Lines& told_;
};

struct StatedCapture : pipeline::CaptureSink {
  void record(drivers::CaptureEvent, std::span<const std::uint8_t>, std::int64_t) override {}
  void flush() override {}
  std::uint64_t dropped_bytes() const override { return 77; }
  std::optional<pipeline::RetentionStatus> retention() const override { return status; }

  std::optional<pipeline::RetentionStatus> status;
};

/// A daemon without a line, and a client. "ask METHOD [PARAMS] [: POINTER…]" prints these values of the result, or all
/// of it; an error is "CODE MESSAGE". The members of an only axis are in the result itself. "show METHOD [POINTER]"
/// prints all values, with times of this host as NOW.
class DaemonPlayer : test::DaemonPartsTest {
 public:
  ~DaemonPlayer() override { parts_->publisher.remove(asker_.client().get()); }

  Lines play(const std::string& command, std::istream& words) {
    if (command == "daemon") {  // FRAMES [MORE of the configuration]
      frames_ = next<std::string>(words);
      setup_ = make_setup(with_sources(test::rest_of(words)), frames_);
      encoder_ = wire::FrameEncoder(setup_.frames);
      start({});
    } else if (command == "logged") {  // the same, with a log of each axis
      std::vector<std::unique_ptr<pipeline::RowWriter>> logs;
      for (std::size_t i = 0; i < setup_.axes.size(); ++i) {
        auto log = std::make_unique<StatedLog>(sent_);
        log_ = log.get();
        log->counted.rows = 1, log->counted.dropped = 2, log->counted.segments = 3;
        log->counted.gone = 4, log->counted.unsynced = 5;
        logs.push_back(std::move(log));
      }
      start(std::move(logs));
    } else if (command == "stored") {  // [WHY SECONDS]: the next deletion of the last log, and of a capture
      const auto next = next_deletion(words);
      auto capture = std::make_unique<StatedCapture>();
      log_->status = capture->status = retention(next);
      parts_->device.lines.back().capture = std::move(capture);
    } else if (command == "pages") {  // that the log returns next
      log_->pages.clear();
      while (words >> std::ws && !words.eof()) page(words);
    } else if (command == "synced") {
      rpc_->synced();
      return received_lines();
    } else if (command == "waited") {  // for an answer
      Lines lines;
      while (lines.empty()) sent_.clear(), lines = received_lines();
      return lines;
    } else if (command == "state") {  // of a line: its state, its counters and settings that it did not accept
      const auto number = next<std::size_t>(words);
      const auto state = static_cast<pipeline::LineState>(next<int>(words));
      set_state(parts_->device.lines[number], state, test::rest_of(words));
    } else if (command == "out") {  // state and counters of the first output
      output(next<int>(words));
    } else if (command == "fallback") {  // of the first axis: 0.5 deg/h and 0.01 deg/h per degC
      setup_.axes[0].fallback = test::linear_model({"T"}, {0.01}, 0.5);
      start({});
    } else if (command == "verdict") {
      parts_->device.axes[0].verdict = pipeline::ModelVerdict{"drifted", test::rest_of(words), "id", 1'700'000'000};
    } else if (command == "offset") {
      const auto& model = parts_->device.setup.axes[0].model;
      parts_->device.use_offset(0, pipeline::Offset{next<double>(words), "turned on", model->info().id, 5, 0}, "set");
    } else if (command == "offsets") {  // are taken, but not that of 9 deg/h
      actions_.set_offset = [this](std::size_t axis, std::optional<pipeline::Offset> offset, const Rpc::Done& done) {
        sent_.push_back(offset
                            ? fmt::format("axis {}: {} deg/h for {} s: {}", axis, offset->deg_per_h,
                                          offset->expires_s > 0 ? offset->expires_s - offset->set_s : 0, offset->reason)
                            : fmt::format("axis {}: none", axis));
        if (offset && offset->deg_per_h == 9) return done(make_error("offset", "too large"));
        done(std::string("in use"));
      };
      rpc_.emplace(parts_->rpc(actions_));
    } else if (command == "reloads") {
      actions_.reload = [](auto done) { done(std::string("gyro.json in use")); };
      rpc_.emplace(parts_->rpc(actions_));
    } else if (command == "summary") {
      return {summary({parts_->device, parts_->events, parts_->publisher, parts_->started_ns})};
    } else if (command == "show") {
      return show(words);
    } else if (command == "unanswered") {  // a request whose answer is later
      test::request(*rpc_, asker_.client(), test::rest_of(words));
      return received_lines();
    } else if (command == "reload") {  // MORE of the configuration
      const auto done = parts_->device.reconfigure(make_setup(test::rest_of(words), frames_));
      return done ? Lines() : Lines{done.error().text()};
    } else if (command == "session") {
      begin_session();
    } else if (command == "seconds") {
      feed(next<int>(words));
    } else if (command == "line") {  // lost or silent, and why
      const bool is_lost = next<std::string>(words) == "lost";
      if (is_lost) parts_->device.finish(pipeline::kGyroLine);
      parts_->set_line(is_lost ? pipeline::LineState::kConnecting : pipeline::LineState::kSilent, test::rest_of(words));
    } else if (command == "bytes") {  // of a line, now
      const auto line = next<std::size_t>(words);
      const std::string text = test::rest_of(words);
      const bool is_now = line > 0 && !parts_->device.lines[0].replays();
      parts_->device.feed(line, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                          is_now ? host_time_ns() : arrival_ns_);
    } else if (command == "pass") {  // seconds
      arrival_ns_ += std::llround(1e9 * next<double>(words));
    } else if (command == "problem") {  // KIND PART TEXT: a failure if the text ends with "!"
      const auto kind = next<std::string>(words), part = next<std::string>(words), text = test::rest_of(words);
      parts_->problems.set(kind, {.kind = kind,
                                  .part = part == "-" ? "" : part,
                                  .level = text.ends_with('!') ? Problem::Level::kFailed : Problem::Level::kCaution,
                                  .text = text});
    } else if (command == "receives") {  // a sensor line, for these seconds
      parts_->device.lines[1].set(pipeline::LineState::kConnecting, {}, 0);
      parts_->device.lines[1].set(pipeline::LineState::kReceiving, {},
                                  host_time_ns() - 1'000'000'000 * next<std::int64_t>(words));
    } else if (command == "event") {
      const auto kind = next<std::string>(words);
      parts_->events.teller()(Severity::kError, kind, test::rest_of(words));
    } else if (command == "device") {  // takes what is sent, but not three bytes
      actions_.send = [this](std::size_t line, std::span<const std::uint8_t> bytes) -> Result<void> {
        sent_.push_back(fmt::format("sent to {}: {}", line, std::string(bytes.begin(), bytes.end())));
        if (bytes.size() == 3) return make_error("tty", "no");
        return {};
      };
      rpc_.emplace(parts_->rpc(actions_));
    } else if (command == "client") {
      parts_->publisher.add(asker_.client());
    } else if (command == "received") {
      std::map<std::string, int> received;
      std::istringstream in(asker_.read());
      for (std::string line; std::getline(in, line);) ++received[json::parse(line)["method"]];
      return {json(received).dump()};
    } else if (command == "no_data") {
      return no_data();
    } else if (command == "ask") {
      return ask(words);
    } else if (command == "raw") {
      test::request(*rpc_, asker_.client(), test::rest_of(words));
      std::istringstream in(asker_.read());
      Lines lines;
      for (std::string line; std::getline(in, line);) lines.push_back(shown_answer(json::parse(line)));
      return lines;
    } else {
      return {"unknown command"};
    }
    return {};
  }

 private:
  void TestBody() override {}

  void start(std::vector<std::unique_ptr<pipeline::RowWriter>> logs) {
    parts_ = std::make_unique<test::DaemonParts>(setup_, std::move(logs));
    actions_ = {[](auto done) { done(make_error("gyro.json", "no")); }};
    rpc_.emplace(parts_->rpc(actions_));
  }

  // BYTES or AGE or DISK_FULL, and in how many seconds; nothing: none.
  static std::optional<pipeline::NextDeletion> next_deletion(std::istream& words) {
    using Why = pipeline::NextDeletion::Why;
    const auto why = next<std::string>(words);
    if (why.empty()) return std::nullopt;
    return pipeline::NextDeletion{"gyro-1.csv", 10, 300,
                                  why == "age"     ? Why::kAge
                                  : why == "bytes" ? Why::kBytes
                                                   : Why::kDiskFull,
                                  next<std::int64_t>(words)};
  }

  // ROWS MISSING, or a refusal: WHY.
  void page(std::istream& words) {
    const std::map<std::string, config::SocketError> refusals = {{"bad", config::kInvalidParams},
                                                                 {"foreign", config::kUnknownCursor},
                                                                 {"unreadable", config::kFailed},
                                                                 {"gone", config::kRowsGone}};
    const auto word = next<std::string>(words);
    if (const auto code = refusals.find(word); code != refusals.end()) {
      const pipeline::RowCursor after{std::string(32, 'a'), 0, 0, code->second == config::kRowsGone ? 20U : 0U};
      log_->pages.emplace_back(tl::unexpected(
          pipeline::RowRefusal{code->second, "rows: " + word, after, code->second == config::kRowsGone ? 7U : 0U}));
    } else {
      pipeline::RowPage page{
          fmt::format(R"({{"page":{})", log_->pages.size()), {}, std::stoul(word), next<std::uint64_t>(words)};
      log_->pages.emplace_back(std::move(page));
    }
  }

  void set_state(pipeline::LineStatus& line, pipeline::LineState state, const std::string& detail) const {
    line.set(state, detail, arrival_ns_);
    line.hardware = transport::LineCounters{1, 2, 3, 4, 5, 6};
    line.polls = {7, 8, 9};
    line.notes = {"a note"};
  }

  void output(int state) {
    parts_->device.output_lines.resize(parts_->device.outputs.size());
    pipeline::OutputStatus& line = parts_->device.output_lines.front();
    line.set(static_cast<pipeline::LineState>(state), "detail", host_time_ns());
    line.bytes = 11, line.lost_bytes = 12;
    for (int i = 0; i <= 100; ++i) line.latencies_s.push_back(0.25F * static_cast<float>(100 - i));
  }

  Lines received_lines() {
    std::istringstream in(asker_.read());
    Lines lines = std::exchange(sent_, {});
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

  static std::string with_sources(std::string text) {
    for (std::size_t at; (at = text.find("SOURCE")) != std::string::npos;) text.replace(at, 6, PRISM_SOURCE_DIR);
    return text;
  }

  /// All values of a result, without the version. Of this host: seconds since 1970 as NOW if they are of this test,
  /// else with their difference in hundreds; ages and waits in hundreds.
  Lines show(std::istream& words) {
    const auto method = next<std::string>(words), part = next<std::string>(words);
    Lines lines;
    add_values(lines, part, asker_.ask(*rpc_, method, nullptr).at("result").at(json::json_pointer(part)));
    return lines;
  }
  void add_values(Lines& lines, const std::string& name, const json& value) const {
    std::string text = shown_now(name, value).dump();
    for (const std::string& path : {folder_.file(""), std::string(PRISM_SOURCE_DIR "/")})
      for (std::size_t at; (at = text.find(path)) != std::string::npos;) text.erase(at, path.size());
    if (!value.is_object() || text.size() <= 240) return lines.push_back(name + " " + text);
    for (const auto& [key, member] : value.items()) add_values(lines, fmt::format("{}/{}", name, key), member);
  }
  json shown_now(const std::string& name, json value) const {
    const auto in_hundreds = [](double seconds) { return 100 * static_cast<std::int64_t>(std::floor(seconds / 100)); };
    if (value == kVersion) return "VERSION";
    if (value.is_structured())
      for (auto& [key, member] : value.items()) member = shown_now(key, member);
    if (!value.is_number()) return value;
    const double number = value, now_s = host_time_s(), since_now_s = number - now_s;
    const std::int64_t started_us = parts_->started_ns / 1000;
    if (number >= static_cast<double>(started_us) / 1e6 && since_now_s <= 0) return "NOW";
    if (std::abs(since_now_s) < 1e5) return fmt::format("NOW {:+}", in_hundreds(since_now_s));
    if (name.ends_with("age_s") && number > 1e6) return fmt::format("NOW - {}", in_hundreds(-since_now_s));
    if (name == "in_s" || name.ends_with("/in_s")) return in_hundreds(number);
    if (!value.is_number_float()) return value;
    if (std::abs(number) < 1e-9) return 0;  // rounding
    return json::parse(number < 1e6 ? fmt::format("{:.5g}", number) : fmt::format("{:.3f}", number));
  }

  static std::string shown_answer(const json& answer) {
    const std::string id = answer["id"].dump() + ": ";
    if (!answer.contains("error")) return id + "result";
    const json& error = answer["error"];
    return id + fmt::format("{} {}{}", error["code"].get<int>(), error["message"].get<std::string>(),
                            error.contains("data") ? " " + error["data"].dump() : "");
  }

  Lines ask(std::istream& words) {
    const auto method = next<std::string>(words);
    const std::string rest = " " + test::rest_of(words);
    const std::size_t mark = rest.find(" : ");
    const json params = json::parse(rest.substr(0, mark), nullptr, false);
    const json answer = asker_.ask(*rpc_, method, params.is_discarded() ? json() : params);
    Lines lines = std::exchange(sent_, {});
    if (answer.contains("error")) {
      lines.push_back(shown_answer(answer).substr(3));
      return lines;
    }
    const json result = test::Asker::own(answer["result"]);
    if (mark == std::string::npos) lines.push_back(result.dump());
    if (mark == std::string::npos) return lines;
    std::istringstream pointers(rest.substr(mark + 3));
    for (std::string pointer; pointers >> pointer;) {
      const json::json_pointer at(pointer);
      lines.push_back(fmt::format("{} {}", pointer, result.contains(at) ? shown_value(result[at]) : "absent"));
    }
    return lines;
  }

  /// Status and bias say alike that nothing is measured: prints what says otherwise.
  Lines no_data() {
    const json status = asker_.result(*rpc_, "status"), bias = asker_.result(*rpc_, "bias");
    Lines lines;
    for (const json& part : {status["sample"], status["window"], bias}) {
      if (part["quality"] != "no_data") lines.push_back("quality " + part["quality"].dump());
      for (const auto& [key, value] : part.items()) {
        const bool is_of_time =
            key == "age_s" || key == "window_s" || key == "full_s" || (key == "warm_s" && value == 0);
        if (value.is_number() && !is_of_time) lines.push_back(key + " " + value.dump());
      }
    }
    return lines;
  }

  std::string frames_;
  StatedLog* log_ = nullptr;  ///< of the last axis
  Rpc::Actions actions_;
  std::optional<Rpc> rpc_;
  test::Asker asker_;
  Lines sent_;
};

TEST(Requests, Scripts) { test::expect_scripts<DaemonPlayer>("socket/requests.txt"); }
TEST(Answers, Scripts) { test::expect_scripts<DaemonPlayer>("socket/answers.txt"); }

class RpcTest : public test::DaemonPartsTest {
 protected:
  Rpc rpc_ = parts_->rpc();
  test::Asker asker_;
};

// A client of 0.2 would look for the members of the axis in the result itself.
TEST_F(RpcTest, EveryMethodAnswersItsIdAndAnOlderClientGetsOneSentence) {
  for (const config::SocketMethod& method : config::kSocketMethods) {
    json request = {{"jsonrpc", "2.0"}, {"protocol", 2}, {"id", method.name}, {"method", method.name}};
    if (method.name != "reload") {  // answered later
      EXPECT_EQ(asker_.ask(rpc_, request.dump())["id"], method.name);
    }
    for (const bool is_stated : {false, true}) {
      request["protocol"] = 1;
      if (!is_stated) request.erase("protocol");
      if (!method.of_axes) continue;
      EXPECT_EQ(asker_.ask(rpc_, request.dump())["error"],
                (json{{"code", kInvalidRequest},
                      {"message",
                       "expected \"protocol\": 2 in the request: this client is older than prism 0.3; upgrade it"}}));
    }
  }
}

// Parsing 65 kB would delay the line by milliseconds.
TEST_F(RpcTest, ALineOfVeryManyValuesIsRefusedBeforeItIsKept) {
  const std::string deep = std::string(3000, '[') + std::string(3000, ']');
  std::string flat = "[1";
  for (int i = 0; i < 30'000; ++i) flat += ",1";
  for (const std::string& line : {deep, flat + "]", flat + ", and no JSON"}) {
    const json answer = asker_.ask(rpc_, line);
    EXPECT_EQ(answer["error"]["code"], kInvalidRequest);
    EXPECT_EQ(answer["error"]["message"], "found more than 2000 values in a line, expected at most 100 requests");
  }
}

TEST_F(RpcTest, AFullBatchOfTheRichestRequestIsAnswered) {
  std::string line;
  for (int i = 0; i < 100; ++i) {
    line += std::string(i == 0 ? "[" : ", ") + R"({"jsonrpc": "2.0", "id": 1, "method": "subscribe", "params":
        {"streams": ["sample", "window", "event"], "every": 2}})";
  }
  test::request(rpc_, asker_.client(), line + "]");
  const std::string text = asker_.read();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 100);
  EXPECT_EQ(text.find("error"), std::string::npos);
}

TEST_F(RpcTest, HistoryIsTheLastHourOldestFirst) {
  begin_session();
  feed(3900);
  const json all = asker_.result(rpc_, "history", {{"seconds", 3600}});
  ASSERT_EQ(all.size(), 3600u);
  EXPECT_EQ(all.back()["time_s"], parts_->device.axes[0].last_window->window.second_mean.second + 1);
  EXPECT_EQ(all.back()["time_s"].get<std::int64_t>() - all.front()["time_s"].get<std::int64_t>(), 3599);
  for (const std::size_t wanted : {1u, 59u, 60u, 61u, 3599u})
    EXPECT_EQ(asker_.result(rpc_, "history", {{"seconds", wanted}}),
              json(all.end() - static_cast<std::ptrdiff_t>(wanted), all.end()))
        << wanted;
  test::Asker deaf(1 << 16);  // sends requests without reading
  for (int i = 0; i < 50 && deaf.client()->open(); ++i)
    test::request(rpc_, deaf.client(),
                  R"({"jsonrpc":"2.0","id":1,"protocol":2,"method":"history","params":{"seconds":3600}})");
  EXPECT_FALSE(deaf.client()->open()) << "responses do not fill the memory";
}

// Shown in another form: the keys of an axis in "axes", the scale as "unit_scale", a correction's keys in the axis
// itself, a line's address in the one of its keys that it has, and requests of a poll as a list.
const std::set<std::string> kElsewhere = {"$schema",    "axis",  "sign",           "scale_factor_arcsec_per_pulse",
                                          "correction", "model", "fallback_model", "write_log",
                                          "tcp",        "udp",   "temperature"};

/// Adds the paths of keys that `schema` has and `shown` lacks.
void add_missing(const json& root, json schema, const json& shown, const std::string& path,
                 std::vector<std::string>& missing) {
  if (schema.contains("$ref")) schema = root.at(json::json_pointer(schema["$ref"].get<std::string>().substr(1)));
  const json keys = schema.value("properties", json::object());
  for (const auto& [key, member] : keys.items()) {
    if (kElsewhere.count(key) != 0) continue;
    if (!shown.is_object() || !shown.contains(key)) {
      missing.push_back(fmt::format("{}/{}", path, key));
    } else if (shown[key].is_object()) {
      add_missing(root, member, shown[key], fmt::format("{}/{}", path, key), missing);
    }
  }
  const json each = schema.value("additionalProperties", json());
  if (!each.is_object() || !shown.is_object()) return;
  for (const auto& [name, member] : shown.items())
    add_missing(root, each, member, fmt::format("{}/{}", path, name), missing);
}

class ConfigAnswer : public test::DaemonPartsTest {};

TEST_F(ConfigAnswer, ShowsEveryKeyInForce) {
  const json schema = json::parse(test::read_file(PRISM_SOURCE_DIR "/config/prismd.schema.json"));
  test::DaemonParts parts(make_setup(
      R"(, "axes": {"z": {}}, "sensor_lines": {"room": {"udp": {"listen": "127.0.0.1:4002", "from": "127.0.0.1:4003"},
      "start": [{"send": "A\r", "expect_hex": "01 02"}, {"wait_ms": 5}], "columns": {"air": {"column": 2, "unit": "degC", "max": 90}},
      "poll": {"every_ms": 500, "send": "READ?\n"}}},
      "capture": {"directory": ".", "keep_mib": 100})"));
  Rpc rpc = parts.rpc();
  const json shown = test::Asker().ask(rpc, "config", nullptr)["result"];
  std::vector<std::string> missing;
  add_missing(schema, schema, shown, "", missing);
  // not configured; in `requests`; in the axis
  const std::string line = "/sensor_lines/room/";
  EXPECT_THAT(missing,
              testing::UnorderedElementsAre("/axes/z/uhfo", "/out", line + "columns/air/min", line + "poll/send",
                                            line + "poll/send_hex", line + "poll/within_ms", "/site/azimuth_deg",
                                            "/site/direction_mrad", "/site/elevation_deg"));
  const json room = shown["sensor_lines"]["room"];
  EXPECT_EQ(room["udp"], (json{{"listen", "127.0.0.1:4002"}, {"from", "127.0.0.1:4003"}}));
  EXPECT_EQ(room["start"],
            json::parse(R"([{"send": "A\r", "expect_hex": "01 02", "within_ms": 1000}, {"wait_ms": 5}])"));
  EXPECT_EQ(room["poll"],
            json::parse(R"({"every_ms": 500, "pause_ms": 20, "requests": [{"send": "READ?\n", "within_ms": 300}]})"));
  EXPECT_EQ(room["columns"], json::parse(R"({"air": {"column": 2, "unit": "degC", "max": 90.0}})"));
  EXPECT_EQ(shown["line"]["parity"], "none");
  EXPECT_EQ(shown["line"]["start"], json::array());
  EXPECT_EQ(shown["axes"]["z"]["extrapolation"], "preset");
}

}  // namespace
}  // namespace prism::socket
