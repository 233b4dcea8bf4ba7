// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instances.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismrelay/instance_follower.hpp"
#include "tools/prismrelay/mqtt.hpp"
#include "tools/prismrelay/schema.hpp"

namespace prism::prismrelay {
namespace {

TEST(Instances, NamesSocketsAndFolders) {
  const test::TemporaryFolder folder;
  for (const char* name : {"a.sock", "b.sock", "c.txt"}) std::ofstream(folder.file(name)) << "";
  const auto found = find_instances({"gyro1", "/x/a.sock", folder.file("")});
  EXPECT_EQ(found, (std::map<std::string, std::string>{
                       {"gyro1", "/run/prismd/gyro1.sock"}, {"a", "/x/a.sock"}, {"b", folder.file("b.sock")}}));
  EXPECT_TRUE(find_instances({"/nowhere/at/all/"}).empty());
}

TEST(Instances, AxesOfAStatus) {
  EXPECT_EQ(axes_of({{"axis", "z"}}).names, std::vector<std::string>{"z"});
  EXPECT_FALSE(axes_of({{"axis", "z"}}).several);
  const StatusAxes several = axes_of({{"axes", {{"x", {}}, {"y", {}}}}});
  EXPECT_EQ(several.names, (std::vector<std::string>{"x", "y"}));
  EXPECT_TRUE(several.several);
}

TEST(Mqtt, WildcardsAreNoPartOfATopic) {
  EXPECT_TRUE(is_topic_part("gyro1"));
  for (const std::string wrong : {"", "a+b", "#", "a/b", "a\nb"}) EXPECT_FALSE(is_topic_part(wrong)) << wrong;
}

TEST(Schema, PartitionsGoFromMidnightToMidnight) {
  EXPECT_EQ(partition_name(20780), "rows_20261123");
  EXPECT_EQ(partition_sql(20780),
            "CREATE TABLE IF NOT EXISTS prism.rows_20261123 PARTITION OF prism.rows FOR VALUES FROM "
            "('2026-11-23 00:00:00+00') TO ('2026-11-24 00:00:00+00')");
}

}  // namespace
}  // namespace prism::prismrelay
