// SPDX-License-Identifier: MIT
// prismd.schema.json (for editors) and the keys of prismd.json(5) are written from the table of the reader.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "compensation/sensors.hpp"
#include "config/config.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/schema_validator.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::config {
namespace {

using Json = test::SchemaValidator::Json;
const std::filesystem::path kSource = PRISM_SOURCE_DIR;

// Every key once.
constexpr const char* kWhole = R"({
  "$schema": "prismd.schema.json", "name": "table",
  "gyro": {"serial": "70-1", "axis": "z", "sign": -1, "scale_factor_arcsec_per_pulse": 0.1},
  "line": {"device": "/dev/ttyS0", "baud": 9600, "data_bits": 8, "parity": "none", "stop_bits": 1, "silence_s": 2.5,
           "retry_min_s": 0.5, "retry_max_s": 5.5, "allow_send": true, "again_when_silent": true,
           "start": [{"send": "A", "expect": "B", "within_ms": 5}, {"send_hex": "41", "expect_hex": "42"}, {"wait_ms": 5}],
           "stop": [{"send": "A"}]},
  "frames": "trplg", "rate_hz": 10, "clock": "host", "accept_clock": true, "model": "m", "fallback_model": "n",
  "correction": {"max_bias_deg_per_h": 5.5, "extrapolation": "clamp", "slew_limit": true, "max_slew_deg_per_h_per_s": 0.5},
  "plausibility": {
    "rate": {"range_deg_per_s": [-400, 400.5], "stuck_s": 10},
    "temperature": {"range_degc": [-40, 70.5], "greatest_slope_degc_per_s": 0.5, "stuck_s": 3600},
    "uhfo": {"range_v": [4, 6.5], "stuck_s": 3600}},
  "site": {"latitude_deg": 34.25, "elevation_deg": 90.0, "azimuth_deg": 0.5},
  "write_log": true,
  "log": {"directory": "d", "segment_mib": 1.5, "segment_hours": 1.5, "keep_mib": 1.5, "keep_days": 1, "when_full": "stop"},
  "capture": {"directory": "c", "segment_mib": 1.5, "segment_hours": 1.5, "keep_mib": 1.5, "keep_days": 1, "when_full": "stop"},
  "socket": {"path": "/run/x", "mode": "0600", "client_buffer_kib": 16, "max_clients": 1},
  "event_level": "info"
})";

// Keys of one axis of several; they replace the top-level keys of a single axis.
constexpr const char* kAxes = R"({
  "gyro": {"serial": "70-1"}, "site": {"latitude_deg": 34.25},
  "axes": {"x": {"model": "m", "fallback_model": "n", "sign": -1, "scale_factor_arcsec_per_pulse": 0.1,
                 "elevation_deg": 0.5, "azimuth_deg": 0.5,
                 "temperature": "chamber.air", "correction": {"max_bias_deg_per_h": 5.5, "extrapolation": "clamp",
                 "slew_limit": true, "max_slew_deg_per_h_per_s": 0.5}}},
  "sensor_lines": {"chamber": {"device": "/dev/ttyS1", "frames": "ascii-columns", "stale_after_s": 5.5,
      "columns": {"air": {"column": 2, "unit": "degC", "min": -50.5, "max": 90.5}}, "separators": ";", "line_end": "lf",
      "decimal_comma": true, "baud": 9600, "data_bits": 8, "parity": "none", "stop_bits": 1, "silence_s": 2.5,
      "retry_min_s": 0.5, "retry_max_s": 5.5}}
})";

// Lines through a network.
constexpr const char* kNetwork = R"({
  "line": {"tcp": {"address": "moxa:4001"}, "poll": {"every_ms": 100, "pause_ms": 5, "within_ms": 5,
           "requests": [{"send": "A", "within_ms": 5}, {"send_hex": "41"}]}},
  "axes": {"x": {}},
  "sensor_lines": {
    "chamber": {"tcp": {"listen": "[::1]:4001"}, "start": [], "stop": [], "poll": {"send_hex": "41"}, "allow_send": true,
                "again_when_silent": false},
    "air": {"udp": {"listen": "0.0.0.0:4002", "from": "192.0.2.7"}}}
})";

Json load(const std::filesystem::path& path) { return Json::parse(test::read_file(path), nullptr, true, true); }
Json schema() { return load(kSource / "config/prismd.schema.json"); }
bool reader_accepts(const Json& config) { return parse_config(config.dump(), "/etc/prism/x.json").has_value(); }

void walk(const Json& json, const Json::json_pointer& at, const std::function<void(const Json::json_pointer&)>& visit) {
  if (!at.empty()) visit(at);
  if (!json.is_object()) return;
  for (const auto& [key, value] : json.items()) walk(value, at / key, visit);
}

TEST(ConfigSchema, AcceptsShippedConfigurations) {
  const test::SchemaValidator validator(schema());
  for (const char* shipped : {"config/prismd.json", "config/examples/gyro1.json", "config/examples/three-axes.json"}) {
    const Json config = load(kSource / shipped);
    EXPECT_TRUE(validator.accepts(config)) << shipped;
    EXPECT_TRUE(reader_accepts(config)) << shipped;
  }
}

// Replaces each value by values of every type. The schema accepts all that the reader accepts; both reject wrong types.
class ConfigForms : public testing::TestWithParam<const char*> {};
constexpr const char* kFormNames[] = {"OneAxis", "Axes", "Network"};
INSTANTIATE_TEST_SUITE_P(Both, ConfigForms, testing::Values(kWhole, kAxes, kNetwork),
                         [](const auto& form) { return kFormNames[form.index]; });

TEST_P(ConfigForms, GetTheSameResultFromSchemaAndReader) {
  const test::SchemaValidator validator(schema());
  const Json whole = Json::parse(GetParam());
  ASSERT_TRUE(validator.accepts(whole));
  ASSERT_TRUE(reader_accepts(whole));
  const Json wrongs =
      Json::array({nullptr, -1, 0, 3, 0.25, 1e12, "", "7", "even", true, Json::array({1}), Json{{"what", 1}}});
  walk(whole, Json::json_pointer(), [&](const Json::json_pointer& at) {
    if (at.to_string() == "/$schema") return;
    for (const Json& wrong : wrongs) {
      Json changed = whole;
      changed[at] = wrong;
      const bool read = reader_accepts(changed), formed = validator.accepts(changed);
      EXPECT_FALSE(read && !formed) << at.to_string() << " = " << wrong.dump() << ": only the schema refuses it";
      const bool same_type = whole.at(at).type_name() == std::string(wrong.type_name());
      EXPECT_FALSE(!same_type && formed) << at.to_string() << " = " << wrong.dump()
                                         << ": the schema takes another type";
      EXPECT_FALSE(!same_type && read) << at.to_string() << " = " << wrong.dump() << ": the reader takes another type";
    }
  });
}

TEST(ConfigSchema, IsWrittenFromTheTable) {
  test::expect_pages_of(config_schema(), "config/prismd.schema.json", "docs/man/prismd.json.5.scd", "# KEYS\n\n",
                        "# EXAMPLES");
}

// The defaults of `keys`, as a configuration that states them.
Json stated_defaults(const Json& keys) {
  Json stated = Json::object();
  for (const auto& [key, schema] : keys.items()) {
    if (schema.contains("default")) stated[key] = schema["default"];
    if (key != "capture" && schema.contains("properties")) stated[key] = stated_defaults(schema["properties"]);
    if (stated.value(key, Json()).empty()) stated.erase(key);
  }
  return stated;
}

TEST(ConfigSchema, HasTheDefaultsOfTheReader) {
  Json stated = stated_defaults(config_schema()["properties"]);
  stated["line"].erase("udp"), stated["line"].erase("poll");
  Config usual = *parse_config("{}", "/etc/prism/x.json");
  usual.axes[0].azimuth_stated = true;
  EXPECT_TRUE(*parse_config(stated.dump(), "/etc/prism/x.json") == usual) << stated;
  for (const char* key : {"clock", "frames", "event_level", "accept_clock"}) EXPECT_TRUE(stated.contains(key)) << key;
  EXPECT_EQ(stated["log"]["when_full"], "stop");
}

// A unit missing in one list would lose a column or be rejected.
TEST(ConfigSchema, HasTheSensorUnitsOfTheTable) {
  const Json expected(kSensorUnitNames);
  int lists = 0;
  const std::function<void(const Json&)> compare = [&](const Json& schema) {
    if (schema.is_object() && schema.contains("enum") && schema["enum"].front() == expected.front()) {
      EXPECT_EQ(schema["enum"], expected);
      ++lists;
    }
    if (!schema.is_structured()) return;
    for (const auto& below : schema) compare(below);
  };
  for (const char* file : {"config/models/model.schema.json", "config/frames/frame.schema.json"}) {
    const int before = lists;
    compare(Json::parse(test::read_file(kSource / file)));
    EXPECT_GT(lists, before) << file;
  }
  std::string names = kSensorUnitNames.front();
  for (std::size_t i = 1; i < kSensorUnitNames.size(); ++i)
    names += (i + 1 < kSensorUnitNames.size() ? ", " : " or ") + std::string(kSensorUnitNames[i]);
  for (const char* page : {"docs/formats.md", "docs/frames.md"})
    EXPECT_NE(test::read_file(kSource / page).find(names), std::string::npos) << page;
}

}  // namespace
}  // namespace prism::config
