// SPDX-License-Identifier: MIT
// The method "config" shows every key of the configuration's schema, as configured or its default.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/support/daemon_parts.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::socket {
namespace {

using nlohmann::json;

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
      missing.push_back(path + "/" + key);
    } else if (shown[key].is_object()) {
      add_missing(root, member, shown[key], path + "/" + key, missing);
    }
  }
  const json each = schema.value("additionalProperties", json());
  if (!each.is_object() || !shown.is_object()) return;
  for (const auto& [name, member] : shown.items()) add_missing(root, each, member, path + "/" + name, missing);
}

class ConfigAnswer : public test::DaemonPartsTest {};

TEST_F(ConfigAnswer, ShowsEveryKeyInForce) {
  const json schema = json::parse(test::read_file(PRISM_SOURCE_DIR "/config/prismd.schema.json"));
  test::DaemonParts parts(
      make_setup(R"(, "axes": {"z": {}}, "sensor_lines": {"room": {"udp": {"listen": "127.0.0.1:4002"},
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
              testing::UnorderedElementsAre(line + "columns/air/min", line + "poll/send", line + "poll/send_hex",
                                            line + "poll/within_ms", "/site/azimuth_deg", "/site/elevation_deg"));
  const json room = shown["sensor_lines"]["room"];
  EXPECT_EQ(room["udp"], (json{{"listen", "127.0.0.1:4002"}}));
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
