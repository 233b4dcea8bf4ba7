// SPDX-License-Identifier: MIT
#include "tools/prismweb/foxglove_protocol.hpp"

#include <gtest/gtest.h>

namespace prism::prismweb {
namespace {

using nlohmann::json;

TEST(FoxgloveProtocol, IsTheFirstSupportedOne) {
  EXPECT_EQ(foxglove_protocol_of("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(foxglove_protocol_of("foxglove.sdk.v1, foxglove.websocket.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(foxglove_protocol_of("x,\t foxglove.websocket.v1 "), "foxglove.websocket.v1");
  for (const char* offered : {"", ",", "foxglove.websocket.v2", "xfoxglove.sdk.v1", "foxglove.sdk"})
    EXPECT_EQ(foxglove_protocol_of(offered), "") << offered;
}

TEST(FoxgloveProtocol, ReadsTheTokenFromTheTarget) {
  EXPECT_TRUE(is_foxglove("/foxglove"));
  EXPECT_TRUE(is_foxglove("/foxglove?token=a"));
  for (const char* target : {"/", "/foxglove/", "/foxgloves", "/ws?/foxglove"})
    EXPECT_FALSE(is_foxglove(target)) << target;
  EXPECT_EQ(foxglove_token_of("/foxglove?token=abc"), "abc");
  for (const char* target : {"/foxglove", "/foxglove?", "/foxglove?token=", "/foxglove?t=abc", "/"})
    EXPECT_EQ(foxglove_token_of(target), "") << target;
}

TEST(FoxgloveTopics, KeepTheirNumbers) {
  FoxgloveTopics topics;
  const auto names = [&] {
    std::map<std::uint32_t, std::string> all;
    for (const auto& [number, topic] : topics.all()) all[number] = topic.name();
    return all;
  };
  topics.update_axes(json::parse(R"([{"name":"g","axes":[]}])"));
  EXPECT_EQ(names(), (std::map<std::uint32_t, std::string>{{1, "/g/event"}}));
  topics.update_axes(json::parse(R"([{"name":"g","axes":["z"]},{"name":"h","axes":["x"]}])"));
  const auto both = names();
  EXPECT_EQ(both.size(), 6U);
  EXPECT_EQ(both.at(1), "/g/event");
  EXPECT_EQ(both.at(2), "/g/z/window");
  EXPECT_EQ(both.at(3), "/g/z/sample");
  topics.update_axes(json::parse(R"([{"name":"h","axes":["x"]}])"));
  EXPECT_EQ(names().size(), 3U);
  topics.update_axes(json::parse(R"([{"name":"g","axes":["z"]},{"name":"h","axes":["x"]}])"));
  EXPECT_EQ(names(), both);
}

// Foxglove's schema parser accepts only an object of simple types; it throws for anything else.
TEST(FoxgloveChannels, HaveSchemasOfPlainTypes) {
  for (const char* stream : {"window", "sample", "event"}) {
    const json channel = foxglove_channel(7, {"g", stream == std::string("event") ? "" : "z", stream});
    EXPECT_EQ(channel["id"], 7);
    EXPECT_EQ(channel["encoding"], "json");
    EXPECT_EQ(channel["schemaEncoding"], "jsonschema");
    const json schema = json::parse(channel["schema"].get<std::string>());
    EXPECT_EQ(schema["type"], "object");
    for (const auto& [name, field] : schema["properties"].items())
      EXPECT_TRUE(field["type"] == "number" || field["type"] == "integer" || field["type"] == "string") << name;
  }
}

TEST(FoxgloveRows, HaveATimeAndOnlyKnownValues) {
  std::uint64_t lost = 0;
  const auto rows = foxglove_rows(
      R"({"instance":"g","batch":[{"jsonrpc":"2.0","method":"window","params":{"axis":"z","time_s":1795425060,"rate_deg_per_h":8.5,"bias_deg_per_h":null}},)"
      R"({"jsonrpc":"2.0","method":"sample","params":{"axis":"z","time_s":1795425060.005001}},)"
      R"({"jsonrpc":"2.0","method":"event","params":{"time_s":11.5,"text":"lost"}},)"
      R"({"jsonrpc":"2.0","method":"window","params":{"axis":"z","time_s":1e300}},)"
      R"({"jsonrpc":"2.0","method":"window","params":{"axis":"z","time_s":null}},)"
      R"({"jsonrpc":"2.0","method":"lost","params":{"rows":3,"rows_total":5}}]})",
      lost);
  EXPECT_EQ(lost, 3U);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].topic, (FoxgloveTopic{"g", "z", "window"}));
  EXPECT_EQ(rows[0].time_ns, 1795425060'000'000'000);
  EXPECT_EQ(json::parse(rows[0].json), json::parse(R"({"axis":"z","time_s":1795425060,"rate_deg_per_h":8.5})"));
  EXPECT_EQ(rows[1].time_ns, 1795425060'005'001'000);
  EXPECT_EQ(rows[2].topic, (FoxgloveTopic{"g", "", "event"}));
  for (const char* other :
       {"", "{}", "[]", R"({"batch":1})", R"({"batch":[]})",
        R"({"instance":1,"batch":[1,{"method":1,"params":1},{"method":[],"params":{"axis":{},"rows":-1}}]})"})
    EXPECT_TRUE(foxglove_rows(other, lost).empty()) << other;
}

// docs/spec.md of foxglove/ws-protocol, "Message Data".
TEST(FoxgloveData, IsLittleEndianAfterItsOpcode) {
  const std::string data = foxglove_data(0x01020304, 0x1112131415161718, "{}");
  EXPECT_EQ(data, std::string("\x01\x04\x03\x02\x01\x18\x17\x16\x15\x14\x13\x12\x11{}"));
}

}  // namespace
}  // namespace prism::prismweb
