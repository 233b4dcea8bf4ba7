// SPDX-License-Identifier: MIT
#include "tools/prismweb/settings.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "tests/support/blocks.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/schema_validator.hpp"

namespace prism::prismweb {
namespace {

std::string error_of(const std::string& text) {
  Settings settings;
  const auto read = parse_web_config(text, "/etc/prism/web.json", settings);
  return read ? "" : read.error().text();
}

TEST(WebConfig, ReadsAllSettings) {
  Settings settings;
  const auto read =
      parse_web_config(R"({"listen": "[::1]:80", "hosts": ["lab.example"], "instances": ["gyro1", "/run/x.sock"],
    "page": "page", "dygraphs": "/d", "state": "/var/lib/prismweb"})",
                       "/etc/prism/web.json", settings);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(settings.address, "::1");
  EXPECT_EQ(settings.port, 80);
  EXPECT_EQ(settings.hosts, std::vector<std::string>{"lab.example"});
  EXPECT_EQ(settings.instances, (std::vector<std::string>{"gyro1", "/run/x.sock"}));
  EXPECT_EQ(settings.page, "/etc/prism/page");
  EXPECT_EQ(settings.dygraphs, "/d");
  EXPECT_EQ(settings.state, "/var/lib/prismweb");
  EXPECT_TRUE(settings.warnings.empty());
}

TEST(WebConfig, AUnixSocketReplacesTheAddress) {
  Settings settings;
  ASSERT_TRUE(parse_web_config(R"({"socket": "/run/prismweb/web.sock"})", "web.json", settings));
  EXPECT_EQ(settings.unix_socket, "/run/prismweb/web.sock");
  EXPECT_EQ(settings.address, "");
}

TEST(WebConfig, ErrorsNameTheKey) {
  for (const test::Block& row : test::blocks("prismweb/config_errors.txt", 2))
    EXPECT_EQ(error_of(row[0]), "/etc/prism/web.json" + row[1]) << row.where;
}

// All keys except "socket", which excludes "listen".
constexpr const char* kComplete =
    R"({"$schema": "web.schema.json", "listen": "127.0.0.1:80", "hosts": ["a"], "instances": "gyro1",
  "page": "p", "dygraphs": "d", "state": "s"})";

TEST(WebConfig, SchemaAndManPageAreWrittenFromTheTable) {
  test::expect_pages_of(web_config_schema(), "config/web.schema.json", "docs/man/prismweb.8.scd",
                        "All keys are optional.\n\n", "Other hosts connect");
}

TEST(WebConfig, TheSchemaAgreesWithTheReader) {
  using Json = test::SchemaValidator::Json;
  const std::filesystem::path source = PRISM_SOURCE_DIR;
  const test::SchemaValidator validator(web_config_schema());
  const Json complete = Json::parse(kComplete);
  EXPECT_TRUE(validator.accepts(complete));
  EXPECT_EQ(error_of(kComplete), "");
  const std::string shipped = test::read_file(source / "config/examples/web.json");
  EXPECT_TRUE(validator.accepts(Json::parse(shipped, nullptr, true, true)));
  EXPECT_EQ(error_of(shipped), "");
  for (const auto& [key, value] : complete.items()) {
    for (const Json& wrong : Json::parse(R"([null, -1, 0.5, true, [], [1], {"what": 1}])")) {
      Json changed = complete;
      changed[key] = wrong;
      if (key == "$schema") continue;
      EXPECT_FALSE(validator.accepts(changed)) << changed.dump();
      EXPECT_NE(error_of(changed.dump()), "") << changed.dump();
    }
  }
}

TEST(WebConfig, WarnsOfRemovedKeys) {
  Settings settings;
  ASSERT_TRUE(parse_web_config(R"({"foxglove": {"origins": 1},
    "plotjuggler": {"send_to": "127.0.0.1:9870"}})",
                               "web.json", settings));
  EXPECT_EQ(settings.warnings,
            (std::vector<std::string>{"web.json:/foxglove: removed in prism 0.4 (line 1); it has no effect; read the "
                                      "gyro with the Python client (clients.md)",
                                      "web.json:/plotjuggler: removed in prism 0.4 (line 2); it has no effect; run "
                                      "clients/python/examples/plotjuggler.py (clients.md)"}));
}

TEST(WebConfig, RejectsInvalidAddresses) {
  for (const char* text : {"127.0.0.1", "127.0.0.1:", ":80", "127.0.0.1:70000", "127.0.0.1:-1", "127.0.0.1:8 ",
                           "::1:80", "[::1:80", "[127.0.0.1]:80", "host:80", "[]:80"}) {
    Settings settings;
    EXPECT_FALSE(parse_listen(text, settings)) << text;
    EXPECT_EQ(settings.port, 8467) << text;
  }
}

}  // namespace
}  // namespace prism::prismweb
