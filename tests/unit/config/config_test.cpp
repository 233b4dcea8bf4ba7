// SPDX-License-Identifier: MIT
// Configuration: all keys, and the messages of errors.
#include "config/config.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/support/blocks.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::config {
namespace {

using testing::HasSubstr;

Config good(const std::string& text) {
  const Result<Config> config = parse_config(text, "/etc/prism/gyro1.json");
  EXPECT_TRUE(config) << config.error().text();
  return config.value_or(Config{});
}

std::string refusal(const std::string& text) {
  const Result<Config> config = parse_config(text, "/etc/prism/gyro1.json");
  EXPECT_FALSE(config) << "accepted: " << text;
  return config ? "" : config.error().text();
}

TEST(Config, WarnsOfARemovedKey) {
  const Config config = good(R"({"line": {"device": "/dev/null", "serve": {"raw": {"tcp": {"listen": "x"}}}},
    "axes": {"z": {}}, "sensor_lines": {"room": {"device": "/dev/zero", "serve": 1}}, "log": {"keep_for": ["relay"]}})");
  const std::string server = "it has no effect; let ser2net serve the line to several programs (lines.md)",
                    cursor = "it has no effect; a consumer keeps its own cursor (prismctl rows --cursor)",
                    place = "/etc/prism/gyro1.json:/", removed = ": removed in prism 0.4 (line ";
  EXPECT_THAT(config.removed_keys, testing::ElementsAre(place + "line/serve" + removed + "1); " + server,
                                                        place + "sensor_lines/room/serve" + removed + "2); " + server,
                                                        place + "log/keep_for" + removed + "2); " + cursor));
  EXPECT_TRUE(good("{}").removed_keys.empty());
}

TEST(Config, AcceptsAnEmptyObjectForReplay) {
  const Config config = good("{}");
  EXPECT_EQ(config.name, "gyro1");
  EXPECT_EQ(config.line.device, "");
  EXPECT_EQ(config.socket.path, "/run/prismd/gyro1.sock");
  EXPECT_EQ(config.socket.mode, 0660);
  EXPECT_TRUE(config.log);
  EXPECT_FALSE(config.capture);
  EXPECT_FALSE(config.device_clock);
  EXPECT_THAT(config.frames, HasSubstr("trplg.json"));
}

TEST(Config, ReadsPlausibilityAndCorrectionLimits) {
  const Config usual = good("{}");
  EXPECT_FALSE(usual.plausibility.rate.range || usual.plausibility.temperature.range || usual.plausibility.uhfo.range);
  EXPECT_FALSE(usual.plausibility.temperature.stuck_s) << "off unless configured";
  EXPECT_TRUE(usual.axes[0].engine.slew.limited);
  EXPECT_FALSE(usual.axes[0].engine.slew.max_slew_deg_per_h_per_s);
  const Config config = good(R"({"plausibility": {"rate": {"range_deg_per_s": [-10, 20], "stuck_s": 5},
    "temperature": {"range_degc": [-40, 70], "greatest_slope_degc_per_s": 0.1, "stuck_s": 3600}, "uhfo": {"range_v": [4, 6]}},
    "correction": {"max_slew_deg_per_h_per_s": 0.01}})");
  EXPECT_EQ(config.plausibility.rate.range->max, 20 * 3600.0);
  EXPECT_EQ(config.plausibility.rate.stuck_s, 5);
  EXPECT_EQ(config.plausibility.temperature.range->min, -40);
  EXPECT_EQ(config.plausibility.temperature.greatest_slope_per_s, 0.1);
  EXPECT_EQ(config.plausibility.uhfo.range->min, 4);
  EXPECT_EQ(config.axes[0].engine.slew.max_slew_deg_per_h_per_s, 0.01);
  EXPECT_FALSE(good(R"({"correction": {"slew_limit": false}})").axes[0].engine.slew.limited);
}

TEST(Config, ReadsEveryKeyAndAllowsComments) {
  const Config config = good(R"({
    // the gyro on the table
    "name": "table", "gyro": {"serial": "70-123", "axis": "z", "sign": -1, "scale_factor_arcsec_per_pulse": 0.25},
    "line": {"device": "/dev/ttyUSB0", "baud": 614400, "parity": "even", "silence_s": 0.5},
    "clock": "device", "site": {"latitude_deg": 34.25, "elevation_deg": 90},
    "log": {"directory": "logs", "segment_mib": 1, "segment_hours": 1, "when_full": "delete_oldest"},
    "capture": {}, "socket": {"path": "table.sock", "mode": "0600"}, "correction": {"max_bias_deg_per_h": 5, "extrapolation": "blend"}
  })");
  EXPECT_EQ(config.name, "table");
  EXPECT_EQ(config.gyro_serial, "70-123");
  EXPECT_EQ(config.axes[0].sign, -1);
  EXPECT_EQ(config.axes[0].scale_factor_arcsec_per_pulse, 0.25);
  EXPECT_EQ(config.line.baud, 614400);
  EXPECT_EQ(config.line.parity, wire::Parity::kEven);
  EXPECT_TRUE(config.device_clock);
  EXPECT_EQ(config.axes[0].elevation_deg, 90);
  EXPECT_EQ(config.log->directory, "/etc/prism/logs");
  EXPECT_EQ(config.log->max_bytes, 1 << 20);
  EXPECT_EQ(config.log->max_age_s, 3600);
  EXPECT_TRUE(config.log->delete_when_full);
  EXPECT_TRUE(config.capture);
  EXPECT_EQ(config.socket.path, "/etc/prism/table.sock");
  EXPECT_EQ(config.socket.mode, 0600);
  EXPECT_EQ(config.axes[0].engine.max_bias_deg_per_h, 5);
  EXPECT_EQ(config.axes[0].engine.extrapolation, compensation::Extrapolation::kShrink);
  ASSERT_EQ(config.warnings.size(), 1u);
  EXPECT_THAT(config.warnings[0], HasSubstr("/correction/extrapolation: \"blend\""));
}

TEST(Config, ReadsNetworkLines) {
  const Config tcp = good(R"({"line": {"tcp": {"address": "moxa:4001"}, "silence_s": 0.5}})");
  EXPECT_EQ(tcp.line.network, (transport::Network{"tcp", "moxa:4001", false, ""}));
  EXPECT_EQ(tcp.line.device, "tcp moxa:4001");
  const Config listens = good(R"({"line": {"tcp": {"listen": "[::1]:4001"}}})");
  EXPECT_EQ(listens.line.network, (transport::Network{"tcp", "[::1]:4001", true, ""}));
  const Config udp = good(R"({"line": {"udp": {"listen": "0.0.0.0:4002", "from": "192.0.2.7"}},
    "axes": {"z": {}}, "sensor_lines": {"room": {"tcp": {"address": "moxa:4002"}}}})");
  EXPECT_EQ(udp.line.network, (transport::Network{"udp", "0.0.0.0:4002", true, "192.0.2.7"}));
  EXPECT_EQ(udp.sensor_lines[0].line.device, "tcp moxa:4002");
}

TEST(Config, ReportsPositionFoundAndExpected) {
  for (const test::Block& row : test::blocks("config/config_errors.txt", 2))
    EXPECT_EQ(refusal(row[0]), "/etc/prism/gyro1.json" + row[1]) << row.where;
}

TEST(Config, ReportsInvalidJsonWithLineAndColumn) {
  EXPECT_THAT(refusal("{\n  \"line\": {\"baud\": ,}\n}"), HasSubstr("/etc/prism/gyro1.json:2:20: not valid JSON: "));
  EXPECT_THAT(refusal(""), HasSubstr("is empty, expected a JSON object"));
}

TEST(Config, RejectsALongSocketPath) {
  const auto socket = [](std::size_t bytes) {
    return R"({"socket": {"path": "/)" + std::string(bytes - 1, 'x') + R"("}})";
  };
  EXPECT_EQ(good(socket(107)).socket.path.size(), 107u);
  EXPECT_THAT(refusal(socket(108)), HasSubstr("/socket/path: \"/xxx"));
  EXPECT_THAT(refusal(socket(108)), HasSubstr("\" has 108 bytes, expected at most 107"));
}

// Regression: a name of 250 letters was accepted, and prismd aborted (SIGABRT) at its first segment.
TEST(Config, RejectsANameThatMakesAPathTooLong) {
  const auto named = [](std::size_t bytes, const std::string& rest) {
    return R"({"name": ")" + std::string(bytes, 'n') + "\", " + rest + "}";
  };
  const std::string quiet = R"("socket": {"path": ""})";
  EXPECT_EQ(good(named(90, quiet)).name.size(), 90u);
  EXPECT_THAT(refusal(named(91, quiet)), HasSubstr("expected 1 to 90 bytes"));
  EXPECT_EQ(good(named(90, "\"clock\": \"host\"")).socket.path.size(), 107u);
}

TEST(Config, RejectsALongDirectory) {
  const auto folder = [](const std::string& path) { return R"({"log": {"directory": ")" + path + "\"}}"; };
  const std::string part = "/" + std::string(255, 'd');
  std::string deep;
  for (int i = 0; i < 15; ++i) deep += part;  // 3840 bytes
  EXPECT_EQ(good(folder(deep)).log->directory, deep);
  EXPECT_THAT(refusal(folder(part + "d")), HasSubstr("/log/directory: a path of 257 bytes, expected at most 4095"));
  EXPECT_THAT(refusal(folder(deep + "/" + std::string(250, 'd'))), HasSubstr("/log/directory: a path of 4091 bytes"));
}

TEST(Config, ReportsAMissingFileWithItsName) {
  const Result<Config> config = load_config("/nonexistent/gyro.json");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().text(), "/nonexistent/gyro.json: cannot be read: No such file or directory");
  EXPECT_EQ(load_config("/tmp").error().text(), "/tmp: is a directory, expected a regular file");
}

TEST(Config, UsesTheDirectoriesOfSystemd) {
  ::setenv("LOGS_DIRECTORY", "/var/log/prismd/table", 1);
  const Config defaults = good(R"({"capture": {}})");
  const Config relative = good(R"({"log": {"directory": "rows"}, "capture": {"directory": "/data/bytes"}})");
  ::unsetenv("LOGS_DIRECTORY");
  EXPECT_EQ(defaults.log->directory, "/var/log/prismd/table");
  EXPECT_EQ(defaults.capture->directory, "/var/log/prismd/table/capture");
  EXPECT_EQ(relative.log->directory, "/var/log/prismd/table/rows");
  EXPECT_EQ(relative.capture->directory, "/data/bytes");
}

TEST(Config, SearchesBareNamesNextToTheConfigurationFirst) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.file("frames"));
  std::ofstream(folder.file("frames/trplg.json")) << "{}";
  const Result<Config> config =
      parse_config(R"({"frames": "trplg", "model": "tao2019-model2"})", folder.file("g.json"));
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_EQ(config->frames, folder.file("frames/trplg.json"));
  EXPECT_THAT(config->axes[0].model, HasSubstr("config/models/tao2019-model2.json"));
}

TEST(ConfigAzimuth, IsNamedIfItMattersAndIsNotStated) {
  const auto warnings = [](const std::string& site) {
    return parse_config(R"({"frames": "trplg", "site": {"latitude_deg": 52.3, )" + site + "}}", "g.json")
        .value()
        .warnings;
  };
  EXPECT_THAT(warnings(R"("elevation_deg": 90)"), testing::IsEmpty());
  EXPECT_THAT(warnings(R"("elevation_deg": 0, "azimuth_deg": 0)"), testing::IsEmpty());
  EXPECT_THAT(
      warnings(R"("elevation_deg": 0)"),
      testing::ElementsAre(HasSubstr("azimuth_deg is not stated: north (0) is assumed; the Earth rate on this axis "
                                     "depends on it by up to 18.4 deg/h")));
}

}  // namespace
}  // namespace prism::config
