// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instances.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "base/outside_text.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismrelay/instance_client.hpp"
#include "tools/prismrelay/mqtt.hpp"
#include "tools/prismrelay/schema.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {
namespace {

TEST(Instances, FindsNamesSocketsAndDirectories) {
  const test::TemporaryFolder folder;
  for (const char* name : {"a.sock", "b.sock", "c.txt"}) std::ofstream(folder.file(name)) << "";
  const auto found = find_instances({"gyro1", "/x/a.sock", folder.file("")});
  EXPECT_EQ(found, (std::map<std::string, std::string>{
                       {"gyro1", "/run/prismd/gyro1.sock"}, {"a", "/x/a.sock"}, {"b", folder.file("b.sock")}}));
  EXPECT_TRUE(find_instances({"/nowhere/at/all/"}).empty());
}

// Regression: a file name that is not UTF-8 ended the relay, because it could not be written as JSON.
TEST(Instances, SkipsAndListsInvalidNames) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> invalid_names = {"\xff.sock", "a\nb.sock", "\033[2J.sock",
                                                  std::string(91, 'n') + ".sock", "\xe2\x80\xae.sock"};
  for (const std::string& name : invalid_names) std::ofstream(folder.file(name)) << "";
  std::ofstream(folder.file("good.sock")) << "";
  std::vector<std::string> invalid;
  const auto found = find_instances({folder.file(""), "/x/\xfe.sock"}, &invalid);
  EXPECT_EQ(found, (std::map<std::string, std::string>{{"good", folder.file("good.sock")}}));
  EXPECT_EQ(invalid.size(), invalid_names.size() + 1);
  for (const std::string& name : invalid) EXPECT_TRUE(is_printable(name)) << name;
  RelayState state;
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) (void)find_instances({folder.file("")}, state);
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), static_cast<std::ptrdiff_t>(invalid_names.size()));
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
