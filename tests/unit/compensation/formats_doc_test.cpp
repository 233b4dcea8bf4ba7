// SPDX-License-Identifier: MIT
// docs/formats.md agrees with the code: the columns of the log, the names of the qualities, both worked examples.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "base/sha256.hpp"
#include "compensation/compensated_text.hpp"
#include "compensation/model_text.hpp"
#include "compensation/sensors.hpp"
#include "tests/support/document.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::compensation {
namespace {

const std::string kDocument = "formats.md";

std::string example(const char* chapter, const char* kind) {
  return test::fenced_block(test::document_section(kDocument, chapter), kind);
}

TEST(FormatsDocument, ListsTheColumnsOfTheLogTheirUnitsAndDecimals) {
  CompensatedWindow row;
  const double value = 1.23456789;
  row.window.second_mean = {0, 1, 1, value, value, value, 1};
  row.window.second_mean.arrival_ns = 1'234'567'891;
  row.window.rate_deg_per_h = row.window.temperature_degc = row.window.slope_degc_per_s = row.window.uhfo_v = value;
  row.correction = {value, value, kGood};
  row.corrected_deg_per_h = row.corrected_mean_deg_per_h = row.sent_deg_per_h = row.correction.offset_deg_per_h = value;
  std::string text, columns;
  append_csv(text, row);
  std::istringstream fields(text);
  const auto rows = test::table(test::document_section(kDocument, "### Columns"), "column");
  ASSERT_EQ(rows.size(), log_columns().size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    columns += (columns.empty() ? "" : ",") + rows[i].at(0);
    EXPECT_EQ(rows[i].at(0), log_columns()[i].name);
    EXPECT_EQ(rows[i].at(1), log_columns()[i].unit) << rows[i].at(0);
    std::string field;
    ASSERT_TRUE(std::getline(fields, field, ','));
    const std::size_t point = field.find('.');
    const std::string decimals = std::to_string(point == std::string::npos ? 0 : field.size() - point - 1);
    EXPECT_EQ(rows[i].at(2), rows[i].at(0) == "time_utc" || rows[i].at(0) == "quality" ? "" : decimals)
        << rows[i].at(0);
  }
  EXPECT_EQ(columns, csv_columns());
}

TEST(FormatsDocument, ListsTheQualities) {
  const auto rows = test::table(test::document_section(kDocument, "### Columns"), "quality");
  ASSERT_EQ(rows.size(), 12u);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].at(0), quality_text(1u << i));
    EXPECT_EQ(rows[i].at(1), std::to_string(1u << i));
  }
}

TEST(FormatsDocument, ContainsAValidModel) {
  const std::string text = example("## The model file", "json");
  const auto model = parse_model(text, kDocument);
  ASSERT_TRUE(model) << model.error().text();
  EXPECT_EQ(format_model(**model), text);
  EXPECT_NEAR((*model)->predict(std::vector<double>{25.0125}).bias_deg_per_h, -0.000125, 1e-15);
}

TEST(FormatsDocument, ContainsAShellCommandForTheModelId) {
  const std::string command = example("## The model file", "sh");
  const std::size_t begin = command.find('\'') + 1;
  std::string text = command.substr(begin, command.rfind('\'') - begin);
  for (std::size_t at; (at = text.find("\\n")) != std::string::npos;) text.replace(at, 2, "\n");
  EXPECT_EQ(sha256_hex(text), (*parse_model(example("## The model file", "json"), kDocument))->info().id);
}

TEST(FormatsDocument, ContainsAValidLog) {
  const auto model = parse_model(example("## The model file", "json"), kDocument);
  ASSERT_TRUE(model) << model.error().text();
  std::istringstream lines(example("## The data log", "csv"));
  int rows = 0;
  bool columns = false, names_the_model = false;
  std::string before;  // the input of the end line's checksum
  bool ends = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# end: ")) {
      ends = line == "# end: rows " + std::to_string(rows) + ", sha256 " + sha256_hex(before);
      continue;
    }
    before += line + "\n";
    if (line.rfind("# ", 0) == 0) {
      names_the_model = names_the_model || line.find((*model)->info().id) != std::string::npos;
      EXPECT_FALSE(columns) << "metadata after the columns";
      continue;
    }
    if (line == csv_columns()) {
      columns = true;
      continue;
    }
    const auto row = parse_csv(line, kDocument);
    ASSERT_TRUE(row) << row.error().text();
    std::string again;
    append_csv(again, *row);
    EXPECT_EQ(again, line + "\n");
    if (row->correction.quality == kGood) {
      const std::vector<double> inputs = gather_inputs(**model, row->window);
      EXPECT_NEAR(row->correction.bias_deg_per_h, (*model)->predict(inputs).bias_deg_per_h, 5e-7);
      EXPECT_NEAR(row->corrected_deg_per_h, corrected_rate(row->window.second_mean.rate_deg_per_h, row->correction),
                  5e-7);
    }
    ++rows;
  }
  EXPECT_TRUE(columns);
  EXPECT_TRUE(names_the_model);
  EXPECT_TRUE(ends) << "its last line is not the checksum of the lines before it, sha256 " << sha256_hex(before);
  EXPECT_EQ(rows, 2);
}

using Names = std::set<std::string>;

// The members of a JSON object.
Names keys_of(const std::string& text) {
  Names names;
  const nlohmann::json object = nlohmann::json::parse(text);
  for (const auto& [key, value] : object.items()) names.insert(key);
  return names;
}

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

TEST(LogColumns, ThePythonClientHasTheMembersOfNotifications) {
  std::string window, sample;
  append_json(window, CompensatedWindow());
  append_json(sample, Compensated());
  Names of_window = keys_of(window), of_sample = keys_of(sample);
  of_window.insert({"axis", "sensors"});
  of_sample.insert("axis");
  EXPECT_EQ(python_fields("Window"), of_window);
  EXPECT_EQ(python_fields("Sample"), of_sample);
}

TEST(LogColumns, FormatsDocumentListsTheUnitsOfSensors) {
  const std::string section = test::document_section("formats.md", "### Columns");
  const std::string line = section.substr(section.find("Sensor columns"));
  for (const SensorUnit& unit : kSensorUnits)
    EXPECT_LT(line.find(std::string("_") + unit.suffix + "`"), line.find('\n')) << unit.suffix;
}

}  // namespace
}  // namespace prism::compensation
