// SPDX-License-Identifier: MIT
// Requests and their answers, as scripts (requests.txt); the configuration with every key in force.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "base/host_time.hpp"
#include "daemon/socket/publisher.hpp"
#include "daemon/socket/rpc.hpp"
#include "tests/support/daemon_parts.hpp"
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

/// A daemon without a line, and a client. "ask METHOD [PARAMS] [: POINTER…]" prints these values of the result, or all
/// of it; an error is "CODE MESSAGE". The members of an only axis are in the result itself.
class DaemonPlayer : test::DaemonPartsTest {
 public:
  ~DaemonPlayer() override { parts_->publisher.remove(asker_.client().get()); }

  Lines play(const std::string& command, std::istream& words) {
    if (command == "daemon") {  // FRAMES [MORE of the configuration]
      frames_ = next<std::string>(words);
      setup_ = make_setup(test::rest_of(words), frames_);
      encoder_ = wire::FrameEncoder(setup_.frames);
      parts_ = std::make_unique<test::DaemonParts>(setup_);
      rpc_.emplace(parts_->rpc([](auto done) { done(make_error("gyro.json", "no")); }));
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
      parts_->device.feed(line, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                          line == 0 ? arrival_ns_ : host_time_ns());
    } else if (command == "receives") {  // a sensor line, for these seconds
      parts_->device.lines[1].set(pipeline::LineState::kConnecting, {}, 0);
      parts_->device.lines[1].set(pipeline::LineState::kReceiving, {},
                                  host_time_ns() - 1'000'000'000 * next<std::int64_t>(words));
    } else if (command == "event") {
      const auto kind = next<std::string>(words);
      parts_->events.teller()(Severity::kError, kind, test::rest_of(words));
    } else if (command == "device") {  // takes what is sent, but not three bytes
      rpc_->send_by([this](std::size_t line, std::span<const std::uint8_t> bytes) -> Result<void> {
        sent_.push_back(fmt::format("sent to {}: {}", line, std::string(bytes.begin(), bytes.end())));
        if (bytes.size() == 3) return make_error("tty", "no");
        return {};
      });
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
      rpc_->request(asker_.client(), test::rest_of(words));
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

  static std::string shown_answer(const json& answer) {
    const std::string id = answer["id"].dump() + ": ";
    if (!answer.contains("error")) return id + "result";
    return id + fmt::format("{} {}", answer["error"]["code"].get<int>(), answer["error"]["message"].get<std::string>());
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
  std::optional<Rpc> rpc_;
  test::Asker asker_;
  Lines sent_;
};

TEST(Requests, Scripts) { test::expect_scripts<DaemonPlayer>("socket/requests.txt"); }

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
  rpc_.request(asker_.client(), line + "]");
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
    rpc_.request(deaf.client(),
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
  Rpc rpc = parts.rpc([](auto done) { done({}); });
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
