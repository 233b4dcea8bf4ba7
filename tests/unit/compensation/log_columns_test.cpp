// SPDX-License-Identifier: MIT
// JSON, docs/formats.md and the Python client agree with the table of columns.
#include "compensation/log_columns.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>

#include "compensation/compensated_text.hpp"
#include "compensation/sensors.hpp"
#include "tests/support/document.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::compensation {
namespace {

using Names = std::set<std::string>;

// The members of a JSON object.
Names keys_of(const std::string& text) {
  Names names;
  const nlohmann::json object = nlohmann::json::parse(text);
  for (const auto& [key, value] : object.items()) names.insert(key);
  return names;
}

Names columns_where(bool (*chosen)(const ColumnInfo&)) {
  Names names;
  for (const ColumnInfo& column : kColumnInfo) {
    if (chosen(column)) names.insert(std::string(column.name));
  }
  return names;
}

const Names kInWindow = columns_where([](const ColumnInfo& column) { return column.json > 0; });
const Names kInSample = columns_where([](const ColumnInfo& column) { return column.in_sample != InSample::kNo; });

// The fields of a class of the Python client.
Names python_fields(const std::string& name) {
  const std::string file =
      test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "clients" / "python" / "prism" / "rows.py");
  const std::size_t begin = file.find("class " + name + ":");
  const std::string text = file.substr(begin, file.find("\n\n\n", begin) - begin);
  const std::regex field("\n    ([a-z0-9_]+): [A-Z a-z]");
  Names names;
  for (std::sregex_iterator at(text.begin(), text.end(), field), end; at != end; ++at) names.insert((*at)[1]);
  return names;
}

TEST(LogColumns, NotificationsHaveTheMembersOfTheTable) {
  std::string window, sample;
  append_json(window, CompensatedWindow());
  append_json(sample, Compensated());
  EXPECT_EQ(keys_of(window), kInWindow);
  EXPECT_EQ(keys_of(sample), kInSample);
}

TEST(LogColumns, ThePythonClientHasTheMembersOfNotifications) {
  Names window = kInWindow, sample = kInSample;
  window.insert({"axis", "sensors"});
  sample.insert("axis");
  EXPECT_EQ(python_fields("Window"), window);
  EXPECT_EQ(python_fields("Sample"), sample);
}

TEST(LogColumns, FormatsDocumentListsTheirUnits) {
  const auto rows = test::table(test::document_section("formats.md", "### Columns"), "column");
  ASSERT_EQ(rows.size(), kColumnInfo.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].at(0), kColumnInfo[i].name);
    EXPECT_EQ(rows[i].at(1), kColumnInfo[i].unit) << rows[i].at(0);
  }
}

TEST(LogColumns, FormatsDocumentListsTheUnitsOfSensors) {
  const std::string section = test::document_section("formats.md", "### Columns");
  const std::string line = section.substr(section.find("Sensor columns"));
  for (const SensorUnit& unit : kSensorUnits)
    EXPECT_LT(line.find(std::string("_") + unit.suffix + "`"), line.find('\n')) << unit.suffix;
}

TEST(LogColumns, ColumnsInJsonHaveAMeaning) {
  for (const ColumnInfo& column : kColumnInfo) EXPECT_EQ(column.json > 0, !column.meaning.empty()) << column.name;
}

}  // namespace
}  // namespace prism::compensation
