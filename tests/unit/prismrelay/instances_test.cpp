// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instances.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismrelay/instance_client.hpp"
#include "tools/prismrelay/mqtt.hpp"
#include "tools/prismrelay/schema.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {
namespace {

TEST(Instances, LogsAnInvalidNameOnce) {
  const test::TemporaryFolder folder;
  for (const char* name : {"a.sock", "\xff.sock", "\033[2J.sock"}) std::ofstream(folder.file(name)) << "";
  RelayState state;
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(find_instances({folder.file(""), "/x/a.sock"}, state),
              (std::map<std::string, std::string>{{"a", folder.file("a.sock")}}));
  }
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 2);
  EXPECT_NE(log.find("\\xff.sock: skipped: expected a name of 1 to 90 bytes"), std::string::npos) << log;
}

TEST(Instances, ListsInvalidAxisNames) {
  const StatusAxes axes = axes_of({{"axes", {{"x", {}}, {"\033[2J", {}}, {"a/b", {}}, {std::string(17, 'y'), {}}}}});
  EXPECT_EQ(axes.names, std::vector<std::string>{"x"});
  EXPECT_EQ(axes.invalid.size(), 3u);
  for (const nlohmann::json& other : {nlohmann::json(), nlohmann::json(3), nlohmann::json({{"axes", 3}, {"axis", 4}})})
    EXPECT_TRUE(axes_of(other).names.empty()) << other;
}

TEST(Mqtt, RejectsInvalidTopicLevels) {
  EXPECT_TRUE(is_topic_part("gyro1"));
  for (const std::string level : {"", "a+b", "#", "a/b", "a\nb", "$SYS", "\x7f", "\xff", "\xc2\x85"})
    EXPECT_FALSE(is_topic_part(level)) << level;
}

TEST(Schema, CreatesPartitionsFromMidnightToMidnight) {
  EXPECT_EQ(partition_name(20780), "rows_20261123");
  EXPECT_EQ(partition_sql(20780),
            "CREATE TABLE IF NOT EXISTS prism.rows_20261123 PARTITION OF prism.rows FOR VALUES FROM "
            "('2026-11-23 00:00:00+00') TO ('2026-11-24 00:00:00+00')");
}

TEST(Schema, HasAReferenceInTheTemporarySchema) {
  const std::string sql = reference_sql();
  EXPECT_NE(sql.find("CREATE TABLE IF NOT EXISTS pg_temp.places ("), std::string::npos) << sql;
  EXPECT_EQ(sql.find(" prism."), std::string::npos);
  for (const char* word : {"CREATE SCHEMA", "COMMIT", "BEGIN;"}) EXPECT_EQ(sql.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace prism::prismrelay
