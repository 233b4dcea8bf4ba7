// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "daemon/socket/publisher.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::socket {
namespace {

using nlohmann::json;

class Answers : public test::DaemonPartsTest {
 protected:
  json result(const std::string& method, const json& params = nullptr) { return asker_.result(rpc_, method, params); }
  // Of all members of an object that are numbers, none is left.
  static void expect_no_number(const json& object) {
    for (const auto& [key, value] : object.items()) EXPECT_FALSE(value.is_number()) << key << " " << value;
  }
  // Status and bias say alike that nothing is measured.
  void expect_no_data() {
    const json status = result("status"), bias = result("bias");
    EXPECT_EQ(status["quality"], "no_data");
    EXPECT_EQ(status["sample"]["quality"], "no_data");
    EXPECT_EQ(status["window"]["quality"], "no_data");
    EXPECT_EQ(bias["quality"], "no_data");
    EXPECT_EQ(bias["warm_s"], 0);
    expect_no_number(status["sample"]);
    expect_no_number(status["window"]);
    json numbers = bias;
    for (const char* of_time : {"age_s", "window_s", "warm_s", "full_s"}) numbers.erase(of_time);
    expect_no_number(numbers);
  }

  Rpc rpc_ = parts_->rpc();
  test::Asker asker_;
};

TEST_F(Answers, NothingIsMeasuredBeforeTheFirstFrame) {
  expect_no_data();
  EXPECT_EQ(result("status")["age_s"], nullptr);
  begin_session();
  parts_->feed(std::vector<std::uint8_t>{1, 2, 3}, arrival_ns_);  // the line speaks, but no frame
  expect_no_data();
}

TEST_F(Answers, AMeasurementIsOfNow) {
  begin_session();
  feed(3);
  const json status = result("status"), bias = result("bias");
  EXPECT_EQ(status["quality"], "no_model");
  EXPECT_NEAR(status["window"]["rate_deg_per_h"].get<double>(), 10, 0.2);
  EXPECT_TRUE(bias["rate_deg_per_h"].is_number());
  constexpr double kRounding = 1e-6;  // status has the digits of the log
  EXPECT_NEAR(bias["second_rate_deg_per_h"], status["window"]["rate_deg_per_h"], kRounding);
  EXPECT_EQ(bias["window_s"], 100);
  EXPECT_EQ(bias["full_s"], 110) << "the window, and 10 s of mean before it";
  EXPECT_EQ(bias["warm_s"], status["warm_s"]);
  EXPECT_TRUE(status["age_s"].is_number());
  EXPECT_EQ(status["sessions"], 1);
}

// A cable was pulled; 15 s later status still said "good", with the numbers of before.
TEST_F(Answers, AGyroThatIsGoneIsNotGood) {
  begin_session();
  feed(3);
  parts_->device.finish(pipeline::kGyroLine);
  parts_->set_line(pipeline::LineState::kConnecting, "unplugged (end of file)");
  expect_no_data();
  EXPECT_TRUE(result("status")["age_s"].is_number());
  parts_->set_line(pipeline::LineState::kSilent, "no data for 2 s");
  expect_no_data();
}

TEST_F(Answers, ANewSessionDoesNotShowTheOldOne) {
  begin_session();
  feed(3);
  begin_session();
  expect_no_data();
  feed(1);
  EXPECT_EQ(result("status")["window"]["quality"], "no_model");  // no second is full yet
  expect_no_number(result("status")["window"]);
  EXPECT_TRUE(result("status")["sample"]["rate_deg_per_h"].is_number());
}

// A reload that turned the gyro's sign left the sample of before on show until the next frame.
TEST_F(Answers, AnotherStreamDoesNotShowTheOldOne) {
  begin_session();
  feed(3);
  ASSERT_TRUE(parts_->device.reconfigure(make_setup(R"(, "gyro": {"sign": -1})")));
  expect_no_data();
}

// Implausible values are shown and marked; one event reports them, however long it lasts.
TEST_F(Answers, AnImplausibleSensorIsNotGood) {
  begin_session();
  ASSERT_TRUE(parts_->device.reconfigure(
      make_setup(R"(, "plausibility": {"temperature": {"range_degc": [30, 40], "stuck_s": 900}})")));
  begin_session();
  feed(20);
  const json status = result("status"), bias = result("bias");
  for (const json& quality :
       {status["quality"], status["sample"]["quality"], status["window"]["quality"], bias["quality"]})
    EXPECT_NE(quality.get<std::string>().find("implausible"), std::string::npos) << quality;
  EXPECT_NEAR(status["sample"]["temperature_degc"].get<double>(), 25, 0.01);
  EXPECT_EQ(status["window"]["mean_temperature_degc"], nullptr);
  json told = json::array();
  for (const json& event : result("events")) {
    EXPECT_EQ(event["text"].get<std::string>().find("quality is now implausible"), std::string::npos);
    if (event["kind"] == "implausible") told.push_back(event["text"]);
  }
  EXPECT_EQ(told, json::array({"temperature is implausible: found 25 degC, expected 30 to 40"}));
  const json believed = result("config")["plausibility"];
  EXPECT_EQ(believed["temperature"],
            (json{{"range_degc", {30, 40}}, {"greatest_slope_degc_per_s", 1}, {"stuck_s", 900}}));
  EXPECT_EQ(believed["rate"], (json{{"range_deg_per_s", {-10000, 10000}}, {"stuck_s", nullptr}}));
  EXPECT_EQ(result("config")["max_slew_deg_per_h_per_s"], nullptr) << "no model";
}

TEST_F(Answers, HistoryIsTheLastRowsOldestFirst) {
  EXPECT_EQ(result("history"), json::array());
  begin_session();
  feed(200);
  const json all = result("history", json::parse(R"({"seconds": 3600})"));
  ASSERT_EQ(all.size(), parts_->publisher.history(0).size());
  ASSERT_GE(all.size(), 198u);
  for (std::size_t wanted : {1u, 59u, 60u, 61u, 119u, 120u, 121u, 180u}) {
    const json some = result("history", {{"seconds", wanted}});
    EXPECT_EQ(some, json(all.end() - static_cast<std::ptrdiff_t>(wanted), all.end())) << wanted;
  }
}

TEST_F(Answers, HistoryKeepsAnHour) {
  begin_session();
  feed(3900);
  const json all = result("history", json::parse(R"({"seconds": 3600})"));
  ASSERT_EQ(all.size(), 3600u);
  EXPECT_EQ(all.back()["time_s"], parts_->device.axes[0].last_window->window.second_mean.second + 1);
  EXPECT_EQ(all.back()["time_s"].get<std::int64_t>() - all.front()["time_s"].get<std::int64_t>(), 3599);
}

TEST_F(Answers, EventsAreOldestFirst) {
  parts_->events.teller()(Severity::kInfo, "note", "first");
  parts_->events.teller()(Severity::kError, "disk", "second \"quoted\"");
  const json events = result("events");
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0]["text"], "first");
  EXPECT_EQ(events[1]["text"], "second \"quoted\"");
  EXPECT_EQ(result("events", json::parse(R"({"count": 1})")), json::array({events[1]}));
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

// Version 0.3 said "good": the line delivered bytes.
TEST_F(ConfigAnswer, HealthNamesASensorLineThatCannotBeRead) {
  test::DaemonParts parts(make_setup(R"(, "axes": {"z": {}}, "sensor_lines": {"room": {"device": "/dev/zero",
      "stale_after_s": 20, "columns": {"air": {"column": 2, "unit": "degC"}}}})"));
  const std::int64_t now_ns = host_time_ns();
  const auto problems = [&](double receiving_s) {
    parts.device.lines[1].set(pipeline::LineState::kConnecting, {}, 0);
    parts.device.lines[1].set(pipeline::LineState::kReceiving, {}, now_ns - std::llround(1e9 * receiving_s));
    Rpc rpc = parts.rpc([](auto done) { done({}); });
    return test::Asker().ask(rpc, "status", nullptr)["result"]["health"]["problems"].dump();
  };
  const std::string expected = "room: bytes, but no value that can be used for 25 s";
  EXPECT_THAT(problems(25), testing::Not(testing::HasSubstr("room"))) << "not a byte came";
  const std::string words = "OK\r\nREADY\r\n";
  parts.device.feed(1, {reinterpret_cast<const std::uint8_t*>(words.data()), words.size()}, now_ns);
  EXPECT_THAT(problems(25), testing::HasSubstr(expected));
  EXPECT_THAT(problems(15), testing::Not(testing::HasSubstr("room")));
}

TEST_F(ConfigAnswer, ShowsEveryKeyInForce) {
  const json schema = json::parse(test::read_file(PRISM_SOURCE_DIR "/config/prismd.schema.json"));
  test::DaemonParts parts(make_setup(
      R"(, "axes": {"z": {}}, "sensor_lines": {"room": {"udp": {"listen": "127.0.0.1:4002", "from": "127.0.0.1:4003"},
      "start": [{"send": "A\r", "expect_hex": "01 02"}, {"wait_ms": 5}], "columns": {"air": {"column": 2, "unit": "degC", "max": 90}},
      "poll": {"every_ms": 500, "send": "READ?\n"}}},
      "capture": {"directory": ".", "keep_mib": 100})"));
  Rpc rpc = parts.rpc([](auto done) { done({}); });
  const json shown = test::Asker().ask(rpc, "config", nullptr)["result"];
  std::vector<std::string> missing;
  add_missing(schema, schema, shown, "", missing);
  // not configured; in `requests`; in the axis
  const std::string line = "/sensor_lines/room/";
  EXPECT_THAT(missing, testing::UnorderedElementsAre(
                           "/axes/z/uhfo", "/out", line + "columns/air/min", line + "poll/send", line + "poll/send_hex",
                           line + "poll/within_ms", "/site/azimuth_deg", "/site/elevation_deg"));
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
