// SPDX-License-Identifier: MIT
// relay.json: values, errors, and that the schema agrees with the reader.
#include "tools/prismrelay/settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/blocks.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/schema_validator.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismrelay/mqtt.hpp"

namespace prism::prismrelay {
namespace {

using Json = test::SchemaValidator::Json;
using testing::HasSubstr;

// Contains every key.
constexpr const char* kComplete = R"({
  "$schema": "relay.schema.json", "site": "lab1", "instances": ["gyro1", "/run/user/1/prismd/"], "status_file": "s.json",
  "postgresql": {"connection": "host=/run/postgresql dbname=prism", "password_file": "pg", "keep_days": 30,
                 "gather_s": 0.5},
  "mqtt": {"host": "broker", "port": 8884, "user": "u", "password_file": "/etc/prism/mqtt", "client_id": "c", "prefix": "p",
           "tls": {"ca_file": "ca.pem", "cert_file": "c.pem", "key_file": "k.pem"}}
})";

std::string error_of(const std::string& text) {
  const auto settings = parse_settings(text, "/etc/prism/relay.json");
  return settings ? "" : settings.error().text();
}

TEST(RelaySettings, ReadsEveryKey) {
  const auto settings = parse_settings(kComplete, "/etc/prism/relay.json");
  ASSERT_TRUE(settings) << settings.error().text();
  EXPECT_EQ(settings->instances, (std::vector<std::string>{"gyro1", "/run/user/1/prismd/"}));
  EXPECT_EQ(settings->status_file, "/etc/prism/s.json");
  EXPECT_EQ(settings->postgresql->password_file, "/etc/prism/pg");
  EXPECT_EQ(settings->postgresql->keep_days, 30);
  EXPECT_EQ(settings->mqtt->port, 8884);
  EXPECT_EQ(settings->mqtt->tls->ca, "/etc/prism/ca.pem");
}

TEST(RelaySettings, WarnsOfARemovedKey) {
  const auto settings =
      parse_settings(R"({"site": "a", "postgresql": {"connection": "x", "follower": "r"}, "metrics": {}})", "/r.json");
  ASSERT_TRUE(settings) << settings.error().text();
  EXPECT_THAT(settings->warnings, testing::ElementsAre(HasSubstr("/postgresql/follower: removed in prism 0.4"),
                                                       HasSubstr("/metrics: removed in prism 0.4")));
}

TEST(RelaySettings, HasDefaults) {
  const auto settings =
      parse_settings(R"({"site": "a", "mqtt": {"host": "h", "tls": {"ca_file": "c"}}})", "/x/relay.json");
  ASSERT_TRUE(settings) << settings.error().text();
  EXPECT_EQ(settings->instances, std::vector<std::string>{"/run/prismd/"});
  EXPECT_EQ(settings->mqtt->port, 8883);
  EXPECT_EQ(settings->mqtt->client_id, "prismrelay-a");
  EXPECT_FALSE(settings->postgresql);
}

TEST(RelaySettings, ReportsWhereAndWhatIsInvalid) {
  for (const test::Block& row : test::blocks("prismrelay/setting_errors.txt", 2))
    EXPECT_THAT(error_of(row[0]), HasSubstr(row[1])) << row.where;
}

TEST(RelaySettings, ReadsThePasswordFromAPrivateFile) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("password");
  EXPECT_THAT(read_password(path).error().text(), HasSubstr(path));
  std::ofstream(path) << "se cret\nsecond line\n";
  ::chmod(path.c_str(), 0640);
  EXPECT_EQ(read_password(path), "se cret");
  ::chmod(path.c_str(), 0644);
  EXPECT_THAT(read_password(path).error().text(), HasSubstr("readable by all users (mode 0644)"));
  ::chmod(path.c_str(), 0600);
  std::ofstream(path) << "\n";
  EXPECT_THAT(read_password(path).error().text(), HasSubstr("is empty"));
}

TEST(RelaySettings, ReadsACredentialOfSystemd) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("relay_pg")) << "x";
  ::setenv("CREDENTIALS_DIRECTORY", folder.file("").c_str(), 1);
  const auto settings =
      parse_settings(R"({"site": "a", "postgresql": {"connection": "x", "password_file": "pg"}})", "/x/r.json");
  ::unsetenv("CREDENTIALS_DIRECTORY");
  EXPECT_EQ(settings->postgresql->password_file, folder.file("relay_pg"));
}

TEST(RelaySettings, SchemaAndManPageAreWrittenFromTheTable) {
  test::expect_pages_of(settings_schema(), "config/relay.schema.json", "docs/man/prismrelay.8.scd",
                        "Paths are relative to the file's directory.\n\n", "# MQTT TOPICS");
  const test::SchemaValidator validator(settings_schema());
  EXPECT_TRUE(validator.accepts(Json::parse(kComplete)));
  const std::string shipped = test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "config/examples/relay.json");
  EXPECT_TRUE(validator.accepts(Json::parse(shipped, nullptr, true, true)));
  EXPECT_TRUE(parse_settings(shipped, "/etc/prism/relay.json"));
}

// Replaces each value by one of every other type: schema and reader must reject it.
TEST(RelaySettings, SchemaAndReaderRejectAWrongType) {
  const Json complete = Json::parse(kComplete);
  const test::SchemaValidator validator(settings_schema());
  const Json flat = complete.flatten();
  for (const auto& [pointer, value] : flat.items()) {
    if (pointer == "/$schema") continue;
    for (const Json& wrong : Json::array({nullptr, true, 0.25, "word", Json::object()})) {
      if (wrong.type_name() == std::string(value.type_name())) continue;
      Json changed = complete;
      changed[Json::json_pointer(pointer)] = wrong;
      EXPECT_FALSE(parse_settings(changed.dump(), "/x/r.json")) << pointer << " = " << wrong;
      EXPECT_FALSE(validator.accepts(changed)) << pointer << " = " << wrong;
    }
  }
}

TEST(Target, LogsAChangeOnce) {
  Target target{.name = "postgresql"};
  testing::internal::CaptureStderr();
  for (int i = 0; i < 5; ++i) target.down("postgresql: no");
  for (int i = 0; i < 4; ++i) target.down("postgresql: other");
  for (int i = 0; i < 2; ++i) target.up();
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 3) << log;
  EXPECT_THAT(log, HasSubstr("postgresql: no; retrying\n"));
  EXPECT_THAT(log, HasSubstr("postgresql: other; retrying\n"));
  EXPECT_THAT(log, HasSubstr("postgresql: connected\n"));
  EXPECT_EQ(target.failures, 9u);
}

TEST(Mqtt, RejectsInvalidTopicLevels) {
  EXPECT_TRUE(is_topic_part("gyro1"));
  for (const std::string level : {"", "a+b", "#", "a/b", "a\nb", "$SYS", "\x7f", "\xff", "\xc2\x85"})
    EXPECT_FALSE(is_topic_part(level)) << level;
}

}  // namespace
}  // namespace prism::prismrelay
