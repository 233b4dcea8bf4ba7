// SPDX-License-Identifier: MIT
// The configuration: what is read, what is refused, and in which words.
#include "config/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

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

TEST(Config, AnEmptyObjectIsAWorkingConfigurationButForTheDevice) {
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

TEST(Config, CommentsAreAllowedAndEverythingIsTakenOver) {
  const Config config = good(R"({
    // the gyro on the table
    "name": "table", "gyro": {"serial": "70-123", "axis": "z", "sign": -1, "scale_factor_arcsec_per_pulse": 0.25},
    "line": {"device": "/dev/ttyUSB0", "baud": 614400, "parity": "even", "silence_s": 0.5},
    "clock": "device", "site": {"latitude_deg": 34.25, "elevation_deg": 90},
    "log": {"directory": "logs", "segment_mib": 1, "segment_hours": 1, "when_full": "delete_oldest"},
    "capture": {}, "socket": {"path": "table.sock", "mode": "0600"}, "correction": {"max_bias_deg_per_h": 5, "extrapolation": "blend"}
  })");
  EXPECT_EQ(config.name, "table");
  EXPECT_EQ(config.gyro.serial, "70-123");
  EXPECT_EQ(config.gyro.sign, -1);
  EXPECT_EQ(config.gyro.scale_factor_arcsec_per_pulse, 0.25);
  EXPECT_EQ(config.line.baud, 614400);
  EXPECT_EQ(config.line.parity, "even");
  EXPECT_TRUE(config.device_clock);
  EXPECT_EQ(config.site.elevation_deg, 90);
  EXPECT_EQ(config.log->directory, "/etc/prism/logs");
  EXPECT_EQ(config.log->max_bytes, 1 << 20);
  EXPECT_EQ(config.log->max_age_s, 3600);
  EXPECT_TRUE(config.log->delete_when_full);
  EXPECT_TRUE(config.capture);
  EXPECT_EQ(config.socket.path, "/etc/prism/table.sock");
  EXPECT_EQ(config.socket.mode, 0600);
  EXPECT_EQ(config.engine.max_bias_deg_per_h, 5);
  EXPECT_EQ(config.engine.extrapolation, compensation::Extrapolation::kBlend);
}

struct Refused {
  const char* text;
  const char* message;
};

TEST(Config, EveryRefusalSaysWhereWhatWasFoundAndWhatWasExpected) {
  const Refused table[] = {
      {R"({"lime": {}})", "/etc/prism/gyro1.json:/lime: unknown key"},
      {R"({"line": {"bauds": 1}})", "/etc/prism/gyro1.json:/line/bauds: unknown key"},
      {R"({"line": {"baud": "fast"}})",
       "/etc/prism/gyro1.json:/line/baud: found \"fast\", expected a whole number within 50 to 20000000"},
      {R"({"line": {"baud": 7}})", "/etc/prism/gyro1.json:/line/baud: 7 is not within 50 to 20000000"},
      {R"({"line": {"silence_s": 0}})", "/etc/prism/gyro1.json:/line/silence_s: 0 is not within 0.1 to 3600"},
      {R"({"line": {"retry_min_s": 3, "retry_max_s": 1}})",
       "/etc/prism/gyro1.json:/line/retry_max_s: 1 is not within 3 to 600"},
      {R"({"line": {"parity": "mark"}})",
       "/etc/prism/gyro1.json:/line/parity: found \"mark\", expected \"none\" or \"even\" or \"odd\""},
      {R"({"line": 5})", "/etc/prism/gyro1.json:/line: found 5, expected an object {...}"},
      {R"({"gyro": {"sign": 0}})", "/etc/prism/gyro1.json:/gyro/sign: found 0, expected 1 or -1"},
      {R"({"name": "a/b"})", "/etc/prism/gyro1.json:/name: found \"a/b\", expected a name without '/'"},
      {R"({"socket": {"mode": "rw"}})",
       "/etc/prism/gyro1.json:/socket/mode: found \"rw\", expected an octal mode such as \"0660\""},
      {R"({"write_log": false, "log": {}})", "/etc/prism/gyro1.json:/log: given although \"write_log\" is false"},
      {R"({"clock": "host", "clock": "device"})", "/etc/prism/gyro1.json: the key \"clock\" is given twice"},
      {R"([])", "/etc/prism/gyro1.json: found [], expected a JSON object"},
  };
  for (const Refused& row : table) EXPECT_EQ(refusal(row.text), row.message);
}

TEST(Config, BrokenJsonIsRefusedWithLineAndColumn) {
  EXPECT_THAT(refusal("{\n  \"line\": {\"baud\": ,}\n}"), HasSubstr("/etc/prism/gyro1.json:2:20: not valid JSON: "));
  EXPECT_THAT(refusal(""), HasSubstr("not valid JSON"));
}

TEST(Config, ASocketPathTooLongForAUnixSocketIsRefused) {
  const std::string path(120, 'x');
  EXPECT_THAT(refusal(R"({"socket": {"path": "/)" + path + R"("}})"),
              HasSubstr("has 121 characters, expected at most 107"));
}

TEST(Config, AMissingFileIsRefusedByItsName) {
  const Result<Config> config = load_config("/nonexistent/gyro.json");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().text(), "/nonexistent/gyro.json: cannot be read: No such file or directory");
  EXPECT_EQ(load_config("/tmp").error().text(), "/tmp: is a folder, expected a file");
}

TEST(Config, UnderSystemdLogAndCaptureAreInTheFolderThatItMade) {
  ::setenv("LOGS_DIRECTORY", "/var/log/prismd/table", 1);
  const Config preset = good(R"({"capture": {}})");
  const Config relative = good(R"({"log": {"directory": "rows"}, "capture": {"directory": "/data/bytes"}})");
  ::unsetenv("LOGS_DIRECTORY");
  EXPECT_EQ(preset.log->directory, "/var/log/prismd/table");
  EXPECT_EQ(preset.capture->directory, "/var/log/prismd/table/capture");
  EXPECT_EQ(relative.log->directory, "/var/log/prismd/table/rows");
  EXPECT_EQ(relative.capture->directory, "/data/bytes");
}

TEST(Config, BareNamesAreFoundBesideTheConfigurationFirst) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.file("frames"));
  std::ofstream(folder.file("frames/trplg.json")) << "{}";
  const Result<Config> config =
      parse_config(R"({"frames": "trplg", "model": "tao2019-model2"})", folder.file("g.json"));
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_EQ(config->frames, folder.file("frames/trplg.json"));
  EXPECT_THAT(config->model, HasSubstr("config/models/tao2019-model2.json"));
}

}  // namespace
}  // namespace prism::config
