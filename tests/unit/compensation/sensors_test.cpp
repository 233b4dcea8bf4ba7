// SPDX-License-Identifier: MIT
// Sensors by name: the names of inputs, their features in windows, and their columns in a log.
#include "compensation/sensors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "compensation/compensated_text.hpp"
#include "compensation/features.hpp"
#include "compensation/model_text.hpp"
#include "tests/support/models.hpp"

namespace prism::compensation {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

SensorList list_of(std::vector<SensorName> sensors) {
  return std::make_shared<const std::vector<SensorName>>(std::move(sensors));
}

FeatureDefinition with_case() {
  FeatureDefinition features = test::short_features();
  features.sensors = {{"case", "degC"}, {"anode", "V"}};
  return features;
}

TEST(Sensors, TheNamesOfInputsStateSensorAndFeature) {
  const FeatureDefinition features = with_case();
  for (const char* name : {"T", "dTdt", "U", "case", "dcase/dt", "case-T", "T-case", "anode", "anode-U"})
    EXPECT_TRUE(has_input(features, name)) << name;
  for (const char* name : {"", "d/dt", "dT/dt", "lag1", "lag1:case", "case-case", "case-anode", "case-", "-T", "shell",
                           "dshell/dt", "case-T-T", "dcase/dt-T"})
    EXPECT_FALSE(has_input(features, name)) << name;
  EXPECT_THAT(sensors_of({"T", "case-T", "dcase/dt", "anode"}), ElementsAre("case", "anode"));
  EXPECT_EQ(unit_of_input(features, "dcase/dt"), "degC/s");
  EXPECT_EQ(unit_of_input(features, "anode"), "V");
  EXPECT_EQ(unit_of_input(features, "case-T"), "degC");
}

TEST(Sensors, ANameMustNotBeAReservedInput) {
  for (const char* name : {"case", "gyro_temp_x", "chamber.temperature", "t"})
    EXPECT_TRUE(is_sensor_name(name)) << name;
  for (const char* name : {"", "T", "U", "dTdt", "case-T", "a b", "1st", "dcase/dt", "x:y"})
    EXPECT_FALSE(is_sensor_name(name)) << name;
  EXPECT_EQ(sensor_column({"case", "degC"}), "case_degc");
  EXPECT_EQ(sensor_of_column("anode_ma")->unit, "mA");
  EXPECT_EQ(sensor_of_column("gyro_temp_x_degc")->name, "gyro_temp_x");
  EXPECT_FALSE(sensor_of_column("quality"));
}

SecondMean second_mean_at(std::int64_t second, const SensorList& list, std::vector<double> values) {
  SecondMean second_mean;
  second_mean.second = second;
  second_mean.samples = 1;
  second_mean.rate_deg_per_h = 8;
  second_mean.temperature_degc = 25;
  second_mean.sensor_list = list;
  second_mean.sensors = std::move(values);
  return second_mean;
}

// The case warms by 0.1 degC/s while T is constant, and fails; later the stream has its sensors in another order.
TEST(Sensors, AWindowHasTheirMeanSlopeAndDifference) {
  const FeatureDefinition features = with_case();
  FeatureExtractor extractor(features);
  SensorList list = list_of({{"anode", "V"}, {"case", "degC"}});
  Window window;
  const auto value = [&](const char* name) { return input_value(window, features, name); };
  for (int second = 0; second < 100; ++second)
    window = extractor.push(second_mean_at(second, list, {5, 30 + 0.1 * second}));
  EXPECT_NEAR(value("case"), 30 + 0.1 * (99 - 4.5), 1e-9);
  EXPECT_NEAR(value("dcase/dt"), 0.1, 1e-12);
  EXPECT_NEAR(value("case-T"), value("case") - 25, 1e-12);
  EXPECT_NEAR(value("T-case"), 25 - value("case"), 1e-12);
  EXPECT_EQ(value("anode"), 5);
  for (int second = 100; second < 108; ++second) window = extractor.push(second_mean_at(second, list, {5, kUnknown}));
  EXPECT_EQ(window.state, WindowState::kReady) << "T is always known";
  for (const char* name : {"case", "dcase/dt", "case-T"}) EXPECT_TRUE(std::isnan(value(name))) << name;
  EXPECT_EQ(value("T"), 25);
  list = list_of({{"case", "degC"}, {"anode", "V"}});
  for (int second = 108; second < 130; ++second) window = extractor.push(second_mean_at(second, list, {30, 5}));
  EXPECT_EQ(value("case"), 30);
  EXPECT_EQ(value("anode"), 5);
}

TEST(Sensors, ALogHasThemBeforeItsLastColumn) {
  const std::vector<SensorName> sensors = {{"case", "degC"}, {"anode", "V"}};
  const std::string metadata = "# axis: x\n" + sensors_line(sensors) + "# session: …\n", columns = csv_columns(sensors);
  EXPECT_EQ(sensors_in(metadata), sensors);
  EXPECT_THAT(columns,
              HasSubstr(",sd_mean_deg_per_h,arrival_s,sent_deg_per_h,offset_deg_per_h,case_degc,anode_v,partial"));
  CompensatedWindow row;
  row.window.second_mean = second_mean_at(1'700'000'000, list_of(sensors), {21.5, kUnknown});
  std::string line;
  append_csv(line, row);
  EXPECT_THAT(line, HasSubstr(",21.500000,,0\n"));
  const auto layout = CsvLayout::parse(columns, "g.csv:5", list_of(sensors));
  ASSERT_TRUE(layout);
  const auto read = parse_csv(line, "g.csv:6", *layout);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(*read->window.second_mean.sensor_list, sensors);
  EXPECT_EQ(read->window.second_mean.sensors[0], 21.5);
  EXPECT_TRUE(std::isnan(read->window.second_mean.sensors[1]));
  EXPECT_EQ(CsvLayout::parse(csv_columns(), "g.csv:5", list_of(sensors)).error().text(),
            "g.csv:5: found no column \"case_degc\", which the metadata lists");
  EXPECT_EQ(parse_csv("2023-11-14T22:13:21Z,1700000001,1,0,8,25,,0,,,,,,,,,warming,,,,,warm,5,0", "g.csv:7", *layout)
                .error()
                .text(),
            "g.csv:7: sensor: found \"warm\", expected a number");
  EXPECT_EQ(sensors_line({}), "");
}

TEST(Sensors, AModelFileListsThemWithTheirUnits) {
  FeatureDefinition features = with_case();
  Domain domain{{-10, 0}, {10, 9}};
  const auto model = test::linear_model({"case-T", "anode"}, {0.1, 2}, 0, features, domain);
  const std::string text = format_model(*model);
  EXPECT_THAT(text, HasSubstr(R"("sensors": {"case": "degC", "anode": "V"}})"));
  const auto again = parse_model(text, "m.json");
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ((*again)->info().features, features);
  EXPECT_EQ((*again)->info().id, model->info().id);
  std::string lost = text;
  lost.replace(lost.find("\"case\": \"degC\", "), 16, "");
  EXPECT_EQ(parse_model(lost, "m.json").error().text(),
            "m.json:/inputs/0/name: found \"case-T\", expected T, dTdt, U or a sensor's that features define");
}

}  // namespace
}  // namespace prism::compensation
