// SPDX-License-Identifier: MIT
// Rows as text: the log's CSV in both directions, the socket's JSON, and unknown values.
#include "compensation/compensated_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "compensation/compensated.hpp"
#include "tests/support/blocks.hpp"

namespace prism::compensation {
namespace {

using nlohmann::json;

CompensatedWindow full_row() {
  CompensatedWindow row;
  Window& window = row.window;
  window.state = WindowState::kReady;
  window.second_mean = {1'795'425'059, 200, 3, 8.4652125, 25.0375, 5.251, 0x21};
  window.second_mean.arrival_ns = 1'795'425'060'004'000'000;
  window.rate_deg_per_h = 8.46525;
  window.temperature_degc = 25.01;
  window.slope_degc_per_s = -0.01666667;
  window.uhfo_v = 5.2505;
  row.correction = {-0.011767, 0.0084, 0.0102, kExtrapolating | kSettling};
  row.corrected_deg_per_h = 8.4769795;
  row.corrected_mean_deg_per_h = 8.477017;
  row.sent_deg_per_h = 8.476979;
  row.correction.offset_deg_per_h = 0.0005;
  return row;
}

std::string csv(const CompensatedWindow& row) {
  std::string text;
  append_csv(text, row);
  return text;
}

const std::string kFullLine =
    "2026-11-23T09:11:00Z,1795425060,200,3,8.465213,25.03750,5.251000,33,8.465250,25.01000,-0.01666667,5.250500,"
    "-0.011767,0.008400,8.476980,8.477017,extrapolating+settling,0.010200,1795425060.004,8.476979,0.000500,0";

TEST(Csv, ARowHasTheEndOfItsSecondAsTimeAndAnUnknownQuantityIsAnEmptyField) {
  std::string text = "before\n";
  append_csv(text, full_row());
  EXPECT_EQ(text, "before\n" + kFullLine + "\n");
  CompensatedWindow row;
  row.window.second_mean.second = -1;
  EXPECT_EQ(csv(row), "1970-01-01T00:00:00Z,0,0,0,,,,0,,,,,,,,,no_model,,,,,0\n");
}

TEST(Csv, ReadsARowBackAndAnIncompleteWindowAsNotReady) {
  for (const char* end : {"", "\n", "\r\n"}) {
    const auto row = parse_csv(kFullLine + end, "g.csv:7");
    ASSERT_TRUE(row) << row.error().text();
    EXPECT_EQ(csv(*row), kFullLine + "\n");
    EXPECT_EQ(row->window.state, WindowState::kReady);
  }
  CompensatedWindow no_temperature = full_row();
  no_temperature.window.temperature_degc = kUnknown;
  for (const CompensatedWindow& row : {no_temperature, CompensatedWindow{}})
    EXPECT_EQ(parse_csv(csv(row), "g.csv:7")->window.state, WindowState::kWarming);
}

TEST(Csv, RandomRowsReadBackAsTheSameLine) {
  std::mt19937_64 random(29);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto maybe = [&](double scale) { return random() % 4 == 0 ? kUnknown : scale * unit(random); };
  for (int i = 0; i < 20'000; ++i) {
    CompensatedWindow row;
    row.window.second_mean = {static_cast<std::int64_t>(random() % 4'000'000'000),
                              static_cast<std::uint32_t>(random()),
                              static_cast<std::uint32_t>(random()),
                              maybe(1e6),
                              maybe(100),
                              maybe(10),
                              static_cast<std::uint32_t>(random()),
                              random() % 2 == 0};
    row.window.rate_deg_per_h = maybe(1e6);
    row.window.temperature_degc = maybe(100);
    row.window.slope_degc_per_s = maybe(1);
    row.window.uhfo_v = maybe(10);
    row.correction = {maybe(100), maybe(1), maybe(1), static_cast<std::uint32_t>(random() % 2048)};
    row.corrected_deg_per_h = maybe(1e6);
    row.corrected_mean_deg_per_h = maybe(1e6);
    const std::string line = csv(row);
    const auto read = parse_csv(line, "g.csv:7");
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(csv(*read), line);
  }
}

// kFullLine with the field `index` replaced.
std::string with_field(std::size_t index, const std::string& field, std::string line = kFullLine) {
  std::size_t begin = 0;
  for (; index > 0; --index) begin = line.find(',', begin) + 1;
  return line.replace(begin, std::min(line.find(',', begin), line.size()) - begin, field);
}

TEST(Csv, AnInvalidFieldIsReportedByItsColumn) {
  for (const test::Block& row : test::blocks("compensation/row_errors.txt", 3)) {
    const auto read = parse_csv(with_field(std::stoul(row[0]), row.text(1)), "g.csv:7");
    ASSERT_FALSE(read) << row.where;
    EXPECT_EQ(read.error().text(), row[2]) << row.where;
  }
}

// A row that is read into again and again is as new; fields whose values are not used are checked by the same rule.
TEST(Csv, EveryReaderFindsTheSameValuesAndErrors) {
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  CsvLayout layout, only_means;
  only_means.use_second_means(12);
  CompensatedWindow row, means;
  for (std::size_t field = 0; field < 22; ++field) {
    for (const char* text : {"", "0", "1", "1.5", "-0.016667", "-0.01666667", "12.34567", "nan", "1.2.3", "0.00-100",
                             "1e3", "1e999", " 1", "-", "1795425060.004", "good", "goo", "implausible+clocks_differ"}) {
      for (const std::string& line : {with_field(field, text), csv(CompensatedWindow{})}) {
        const auto all = parse_csv(line, "g.csv:7");
        const auto again = read_csv(line, "g.csv:7", layout, row), brief = read_csv(line, "g.csv:7", only_means, means);
        ASSERT_EQ(again.has_value(), all.has_value()) << line;
        ASSERT_EQ(brief.has_value(), all.has_value()) << line;
        if (!all) {
          EXPECT_EQ(again.error().text(), all.error().text());
          EXPECT_EQ(brief.error().text(), all.error().text());
          break;
        }
        EXPECT_EQ(csv(row), csv(*all));
        EXPECT_EQ(row.window.state, all->window.state);
        const SecondMean &a = row.window.second_mean, &b = all->window.second_mean;
        EXPECT_EQ(a.implausible, b.implausible);
        EXPECT_EQ(a.all_implausible, b.all_implausible);
        EXPECT_EQ(a.clocks_differ, b.clocks_differ);
        EXPECT_TRUE(same(means.window.second_mean.rate_deg_per_h, b.rate_deg_per_h)) << line;
        EXPECT_TRUE(same(*only_means.real(12, means), all->correction.bias_deg_per_h)) << line;
        EXPECT_EQ(only_means.real(1, means), nullptr);
      }
    }
  }
}

CsvLayout layout_of(const std::string& columns) {
  const auto layout = CsvLayout::parse(columns, "g.csv:6");
  EXPECT_TRUE(layout) << layout.error().text();
  return layout.value_or(CsvLayout());
}

// Rows of version 0.1 end with the quality.
TEST(Csv, ALogOfFormat1HasNoPartialSecondsAndNoNoise) {
  const std::string columns(csv_columns().substr(0, csv_columns().rfind(",sd_mean")));
  const auto row = parse_csv(kFullLine.substr(0, kFullLine.rfind(",0.0102")), "g.csv:7", layout_of(columns));
  ASSERT_TRUE(row) << row.error().text();
  EXPECT_EQ(csv(*row), with_field(17, "", with_field(18, "", with_field(19, "", with_field(20, "")))) + "\n");
  EXPECT_EQ(parse_csv(kFullLine, "g.csv:7", layout_of(columns)).error().text(),
            "g.csv:7: found 22 columns, expected 17");
}

TEST(Csv, ReadsColumnsByNameAndSkipsUnknownOnes) {
  std::string line = kFullLine;
  line.back() = '1';
  const auto row = parse_csv("5.5," + line + ",what", "g.csv:7",
                             layout_of("later_degc," + std::string(csv_columns()) + ",even_later"));
  ASSERT_TRUE(row) << row.error().text();
  EXPECT_TRUE(row->window.second_mean.partial);
  EXPECT_EQ(csv(*row), line + "\n");
}

TEST(Csv, RejectsTheColumnsOfAnotherFormat) {
  EXPECT_EQ(CsvLayout::parse("t_s,rate", "g.csv:1").error().text(),
            R"(g.csv:1: not a log of prismd: found no column "time_utc"; prismcal reads any other CSV with --map)");
  EXPECT_EQ(CsvLayout::parse(std::string(csv_columns()) + ",quality", "g.csv:1").error().text(),
            R"(g.csv:1: found column "quality" twice)");
  EXPECT_FALSE(CsvLayout::parse("", "g.csv:1"));
}

TEST(Csv, RejectsEveryTruncatedRow) {
  for (const CompensatedWindow& row : {full_row(), CompensatedWindow{}}) {
    const std::string line = csv(row);
    for (std::size_t length = 0; length + 1 < line.size(); ++length) {
      const auto read = parse_csv(line.substr(0, length), "g.csv:7");
      ASSERT_FALSE(read) << line.substr(0, length);
    }
  }
  EXPECT_EQ(parse_csv("", "g.csv:7").error().text(), "g.csv:7: found 1 columns, expected 22");
}

TEST(Json, AWindowContainsItsValues) {
  std::string text;
  append_json(text, full_row());
  EXPECT_EQ(
      text,
      R"({"time_s":1795425060,"samples":200,"missing":3,"rate_deg_per_h":8.465213,"temperature_degc":25.03750,"uhfo_v":5.251000,)"
      R"("mean_rate_deg_per_h":8.465250,)"
      R"("mean_temperature_degc":25.01000,"slope_degc_per_s":-0.01666667,"mean_uhfo_v":5.250500,)"
      R"("corrected_mean_deg_per_h":8.477017,"bias_deg_per_h":-0.011767,"sd_deg_per_h":0.008400,"sd_mean_deg_per_h":0.010200,)"
      R"("corrected_deg_per_h":8.476980,"quality":"extrapolating+settling","sent_deg_per_h":8.476979,"offset_deg_per_h":0.000500})");
  EXPECT_TRUE(json::accept(text));
}

Compensated sample_row(std::int64_t time_ns) {
  Compensated row;
  row.sample.time_ns = time_ns;
  row.sample.rate_deg_per_h = 8.5;
  row.sample.temperature_degc = 25;
  row.sample.uhfo_v = 5.25;
  row.correction = {0.25, 0.001, 0.0065, kGood};
  row.corrected_deg_per_h = 8.25;
  return row;
}

TEST(Json, ASampleContainsItsValuesAndItsTimeToTheMicrosecond) {
  const std::pair<std::int64_t, std::string> rows[] = {{0, "0.000000"},
                                                       {999, "0.000000"},
                                                       {1'000, "0.000001"},
                                                       {999'999'999, "0.999999"},
                                                       {1'000'000'000, "1.000000"},
                                                       {1'100'000'000, "1.100000"},
                                                       {-1'000, "-0.000001"},
                                                       {-1'500'000'000, "-1.500000"},
                                                       {1'795'425'060'012'345'678, "1795425060.012345"}};
  for (const auto& [time_ns, time] : rows) {
    std::string text;
    append_json(text, sample_row(time_ns));
    EXPECT_EQ(text, R"({"time_s":)" + time +
                        R"(,"rate_deg_per_h":8.500000,"temperature_degc":25.00000,"uhfo_v":5.250000,)"
                        R"("bias_deg_per_h":0.250000,"sd_deg_per_h":0.001000,"sd_mean_deg_per_h":0.006500,)"
                        R"("corrected_deg_per_h":8.250000,"quality":"good"})");
    EXPECT_TRUE(json::accept(text));
  }
}

TEST(Json, UnknownAndInfiniteValuesAreNull) {
  CompensatedWindow window;
  window.window.second_mean.rate_deg_per_h = HUGE_VAL;
  Compensated sample;
  sample.corrected_deg_per_h = -HUGE_VAL;
  std::string texts[2];
  append_json(texts[0], window);
  append_json(texts[1], sample);
  for (const std::string& text : texts) {
    const json read = json::parse(text, nullptr, false);
    ASSERT_FALSE(read.is_discarded()) << text;
    for (const char* key :
         {"rate_deg_per_h", "bias_deg_per_h", "sd_deg_per_h", "sd_mean_deg_per_h", "corrected_deg_per_h"}) {
      EXPECT_TRUE(read.at(key).is_null()) << key << " in " << text;
    }
    EXPECT_EQ(read.at("quality"), "no_model");
  }
}

// formats_doc_test.cpp has the name of each bit.
TEST(Quality, EverySetOfBitsReadsBackAndFitsTheBuffer) {
  for (std::uint32_t quality = 0; quality < 4096; ++quality) EXPECT_EQ(parse_quality(quality_text(quality)), quality);
  EXPECT_LT(quality_text(~0u).size(), static_cast<std::size_t>(kQualityChars));
  EXPECT_EQ(quality_text(kGood), "good");
  EXPECT_EQ(quality_text(kWarming | kFallback), "warming+fallback");
}

TEST(Quality, ReadsCompleteNamesOnly) {
  EXPECT_EQ(parse_quality("warm"), kGood);
  EXPECT_EQ(parse_quality("warming_up+settling"), kSettling);
  EXPECT_EQ(parse_quality("warming+something_newer+fallback"), kWarming | kFallback);
  EXPECT_EQ(parse_quality(""), kGood);
  EXPECT_EQ(parse_quality("+++"), kGood);
}

TEST(CorrectedRate, IsRateMinusBiasAndUnknownIfEitherIsUnknown) {
  EXPECT_DOUBLE_EQ(corrected_rate(8.5, {0.25, kUnknown, kGood}), 8.25);
  EXPECT_TRUE(std::isnan(corrected_rate(8.5, {})));
  EXPECT_TRUE(std::isnan(corrected_rate(kUnknown, {0.25, kUnknown, kGood})));
  EXPECT_EQ(Correction{}.quality, kNoModel);
}

}  // namespace
}  // namespace prism::compensation
