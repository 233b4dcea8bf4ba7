// SPDX-License-Identifier: MIT
// Any table that this test writes in any dialect is read back to the last digit or refused; a damaged one never swaps
// columns and never crashes.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/tables/table_source.hpp"
#include "tools/prismcal/tables/time_format.hpp"

namespace prism::tables {
namespace {

using Random = std::mt19937;

struct Written {
  std::string text, dialect;
  std::vector<std::vector<double>> columns;  ///< NaN: a hole
};

std::size_t pick(Random& random, std::size_t count) {
  return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

std::string utf16(const std::string& ascii) {
  std::string text("\xFF\xFE", 2);
  for (const char c : ascii) text += {c, '\0'};
  return text;
}

/// A table of 3 to 6 columns whose values are in disjoint ranges, with random digits, signs, holes and dialect.
Written write_any(Random& random) {
  constexpr const char* kSeparators[] = {",", ";", "\t", "|", "  "};
  constexpr const char* kEnds[] = {"\n", "\r\n", "\r"};
  constexpr const char* kHoles[] = {"", "NaN", "N/A", "-", "#NUM!", "inf", "null"};
  const std::string separator = kSeparators[pick(random, 5)], end = kEnds[pick(random, 3)];
  const bool comma = pick(random, 2) == 1, names = pick(random, 4) > 0, units = names && pick(random, 3) == 0;
  const bool quotes = pick(random, 3) == 0 || (comma && separator == ","), bom = pick(random, 4) == 0,
             wide = pick(random, 5) == 0;
  const std::size_t width = 3 + pick(random, 4), rows = 5 + pick(random, 60);
  const bool holes = separator != "  " && pick(random, 2) == 0;
  Written written;
  written.dialect = fmt::format("separator \"{}\", comma {}, names {}, units {}, quotes {}, holes {}, {} x {}",
                                separator, comma, names, units, quotes, holes, rows, width);
  written.columns.resize(width);
  std::string text;
  if (pick(random, 3) == 0) text += "# a comment" + end;
  const auto row = [&](auto cell) {
    for (std::size_t c = 0; c < width; ++c) {
      const std::string value = cell(c);
      text += (c > 0 ? separator : "") + (quotes ? '"' + value + '"' : value);
    }
    text += end;
  };
  if (names) row([&](std::size_t c) { return fmt::format("column{}", static_cast<char>('A' + c)); });
  if (units) row([&](std::size_t c) { return std::string(c == 0 ? "s" : "deg/h"); });
  for (std::size_t i = 0; i < rows; ++i) {
    row([&](std::size_t c) {
      const bool hole = holes && i > 0 && c > 0 && pick(random, 12) == 0;
      const double value = c == 0 ? 0.01 * static_cast<double>(i)
                                  : (c % 2 == 0 ? -1 : 1) * std::pow(10.0, static_cast<double>(c)) *
                                        std::uniform_real_distribution<>(1.01, 9.9)(random);
      std::string cell = fmt::format("{:.{}f}", value, c == 0 ? 2 : 1 + pick(random, 12));
      if (c > 0 && pick(random, 8) == 0) cell = fmt::format("{:.9e}", value);
      written.columns[c].push_back(hole ? NAN : std::strtod(cell.c_str(), nullptr));
      if (hole) return std::string(kHoles[pick(random, 7)]);
      if (comma) std::replace(cell.begin(), cell.end(), '.', ',');
      return cell;
    });
  }
  written.text = wide ? utf16(text) : (bom ? "\xEF\xBB\xBF" : "") + text;
  return written;
}

class TableDialects : public testing::Test {
 protected:
  /// The columns of a file, or nullopt if it is refused.
  std::optional<std::vector<std::vector<double>>> read(const std::string& text) {
    const std::string path = folder_.file("table");
    std::ofstream(path, std::ios::binary) << text;
    auto table = tables::open_table(path, {});
    if (!table) return refused(table.error());
    tables::Selection selection;
    for (std::size_t i = 0; i < (*table)->columns().size(); ++i) selection.numbers.push_back(i);
    if (auto good = (*table)->select(selection); !good) return refused(good.error());
    std::vector<std::vector<double>> columns(selection.numbers.size());
    tables::Block block;
    while (true) {
      const auto more = (*table)->next(block);
      if (!more) return refused(more.error());
      if (!*more) return columns;
      for (std::size_t c = 0; c < columns.size(); ++c)
        columns[c].insert(columns[c].end(), block.columns[c].begin(), block.columns[c].end());
    }
  }
  std::string why_;

 private:
  std::nullopt_t refused(const Error& error) {
    why_ = error.text();
    EXPECT_EQ(why_.find('\n'), std::string::npos) << why_;
    EXPECT_LT(why_.size(), 1000u);
    return std::nullopt;
  }
  const test::TemporaryFolder folder_;
};

TEST_F(TableDialects, EachIsReadToTheLastDigitOrRefused) {
  const char* const wanted = std::getenv("PRISM_DIALECTS");
  const int tables = wanted ? std::atoi(wanted) : 1000;
  Random random(1);
  int refusals = 0;
  for (int i = 0; i < tables; ++i) {
    const Written written = write_any(random);
    const auto columns = read(written.text);
    if (!columns) {
      ASSERT_NE(why_.find("two readings are possible"), std::string::npos) << why_ << "\n"
                                                                           << written.dialect << "\n"
                                                                           << written.text;
      ++refusals;
      continue;
    }
    ASSERT_EQ(columns->size(), written.columns.size()) << written.dialect << "\n" << written.text;
    for (std::size_t c = 0; c < columns->size(); ++c) {
      ASSERT_EQ((*columns)[c].size(), written.columns[c].size()) << written.dialect << "\n" << written.text;
      for (std::size_t r = 0; r < written.columns[c].size(); ++r) {
        const double found = (*columns)[c][r], truth = written.columns[c][r];
        ASSERT_TRUE(found == truth || (std::isnan(found) && std::isnan(truth)))
            << written.dialect << ", row " << r << ", column " << c << ": " << found << " instead of " << truth;
      }
    }
  }
  EXPECT_LT(refusals, tables / 50);
}

TEST_F(TableDialects, DamageNeverSwapsColumns) {
  const char* const wanted = std::getenv("PRISM_MUTANTS");  // 20000 in tests/fuzz/run.sh's sanitized build
  const int mutants = wanted ? std::atoi(wanted) : 1500;
  Random random(2);
  for (int i = 0; i < mutants; ++i) {
    const Written written = write_any(random);
    std::string text = written.text;
    // One place: two in one row can cancel each other, which no reader can notice.
    const std::size_t at = pick(random, text.size());
    switch (pick(random, 5)) {
      case 0:
        text.erase(at, 1 + pick(random, 8));
        break;
      case 1:
        text.insert(at, 1, ",;\t\"\n\r .-#0a\0"[pick(random, 13)]);
        break;
      case 2:
        text[at] = static_cast<char>(pick(random, 256));
        break;
      case 3:
        text.insert(at, text.substr(pick(random, text.size()), 1 + pick(random, 20)));
        break;
      default:
        text.resize(at);
        break;
    }
    const auto columns = read(text);
    if (!columns || columns->size() != written.columns.size()) continue;
    // The ranges of the columns are disjoint: a value in another column would be one of that column's own values.
    for (std::size_t c = 1; c < columns->size(); ++c) {
      for (const double value : (*columns)[c]) {
        for (std::size_t other = 1; other < columns->size(); ++other) {
          if (other == c) continue;
          ASSERT_EQ(std::count(written.columns[other].begin(), written.columns[other].end(), value), 0)
              << written.dialect << "\n"
              << text;
        }
      }
    }
  }
}

TEST(TimeFormat, RejectsTimesBeyond285Years) {
  TimeFormat format;
  format.kind = TimeKind::kGps;
  format.second = 1;
  EXPECT_EQ(format.parse("2307", "5.5"), 1711238405'500'000'000);
  for (const auto& [week, second] : {std::pair{"23550", "0"}, {"-99999", "0"}, {"2307", "1e10"}, {"1e300", "-1e300"}})
    EXPECT_FALSE(format.parse(week, second)) << week << " " << second;
  format.second.reset();
  for (const TimeKind kind :
       {TimeKind::kNumber, TimeKind::kUnix, TimeKind::kExcel, TimeKind::kDatenum, TimeKind::kLabview}) {
    format.kind = kind;
    EXPECT_FALSE(format.from_number(1e17, 0));
    EXPECT_FALSE(format.from_number(std::numeric_limits<double>::quiet_NaN(), 0));
  }
}

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::size_t kMatRows = 10;

std::vector<double> mat_numbers(double first, double step) {
  std::vector<double> values;
  for (std::size_t i = 0; i < kMatRows; ++i) values.push_back(first + step * static_cast<double>(i));
  return values;
}

/// A struct s with the vectors time and rate, a matrix m of two columns, a scalar and a text.
void write_mat(const std::string& path, mat_ft version, matio_compression compression) {
  mat_t* const file = Mat_CreateVer(path.c_str(), nullptr, version);
  ASSERT_NE(file, nullptr);
  std::array<std::size_t, 2> column = {kMatRows, 1}, two = {kMatRows, 2}, one = {1, 1}, word = {1, 4};
  std::vector<double> time = mat_numbers(0, 0.5), rate = mat_numbers(8.4, 0.01), matrix = mat_numbers(1, 1);
  const std::vector<double> second = mat_numbers(-1, -1);
  matrix.insert(matrix.end(), second.begin(), second.end());
  double scalar = 7;
  char text[] = "gyro";
  const char* fields[] = {"time", "rate"};
  matvar_t* const s = Mat_VarCreateStruct("s", 2, one.data(), fields, 2);
  Mat_VarSetStructFieldByName(s, "time", 0,
                              Mat_VarCreate("time", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, column.data(), time.data(), 0));
  Mat_VarSetStructFieldByName(s, "rate", 0,
                              Mat_VarCreate("rate", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, column.data(), rate.data(), 0));
  matvar_t* const m = Mat_VarCreate("m", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, two.data(), matrix.data(), 0);
  matvar_t* const n = Mat_VarCreate("n", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, one.data(), &scalar, 0);
  matvar_t* const t = Mat_VarCreate("name", MAT_C_CHAR, MAT_T_UTF8, 2, word.data(), text, 0);
  for (matvar_t* variable : {s, m, n, t}) {
    ASSERT_EQ(Mat_VarWrite(file, variable, compression), 0);
    Mat_VarFree(variable);
  }
  Mat_Close(file);
}

std::vector<std::vector<double>> read_mat(tables::TableSource& table, const std::vector<std::string>& names) {
  tables::Selection selection;
  for (const std::string& name : names) selection.numbers.push_back(table.find(name).value());
  selection.time = tables::TimeSelection{table.find("s.time").value(), "", 1, 0};
  EXPECT_TRUE(table.select(selection));
  std::vector<std::vector<double>> columns(names.size());
  tables::Block block;
  while (table.next(block).value()) {
    for (std::size_t i = 0; i < columns.size(); ++i)
      columns[i].insert(columns[i].end(), block.columns[i].begin(), block.columns[i].end());
    EXPECT_EQ(block.time_ns.back(), 4'500'000'000);
  }
  return columns;
}

TEST(MatTable, ReadsStructsAndMatricesOfEachVersion) {
  const test::TemporaryFolder folder;
  for (const auto& [version, compression] : {std::pair{MAT_FT_MAT5, MAT_COMPRESSION_NONE},
                                             {MAT_FT_MAT5, MAT_COMPRESSION_ZLIB},
                                             {MAT_FT_MAT73, MAT_COMPRESSION_NONE}}) {
    const std::string path = folder.file("x.mat");
    std::filesystem::remove(path);
    write_mat(path, version, compression);
    auto table = tables::open_table(path, {});
    ASSERT_TRUE(table) << table.error().text();
    EXPECT_EQ((*table)->columns().size(), 4u) << (*table)->names_text();  // version 7.3 sorts them by name
    const auto columns = read_mat(**table, {"s.rate", "m(2)"});
    EXPECT_EQ(columns[0], mat_numbers(8.4, 0.01));
    EXPECT_EQ(columns[1], mat_numbers(-1, -1));
  }
}

TEST(MatTable, ReadsFilesOfOctave) {
  for (const char* name : {"octave-v6.mat", "octave-v7.mat"}) {
    const std::string path = std::string(PRISM_SOURCE_DIR) + "/tests/files/octave/" + name;
    auto table = tables::open_table(path, {});
    ASSERT_TRUE(table) << table.error().text();
    const auto columns = read_mat(**table, {"s.rate", "m(2)", "row"});
    EXPECT_THAT(columns[0], ElementsAre(8.5, 8.25, 8.125, 8.5, 8.25, 8.125, 8.5, 8.25, 8.125, 8.5)) << name;
    EXPECT_THAT(columns[1], ElementsAre(11, 12, 13, 14, 15, 16, 17, 18, 19, 20)) << name;
    EXPECT_THAT(columns[2], ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 10)) << name;
  }
}

TEST(MatTable, RefusesDamageAndFilesWithoutNumbers) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("x.mat");
  write_mat(path, MAT_FT_MAT5, MAT_COMPRESSION_ZLIB);
  std::filesystem::resize_file(path, 150);
  const auto table = tables::open_table(path, {});
  ASSERT_FALSE(table);
  EXPECT_THAT(table.error().text(), HasSubstr("x.mat: "));
}

}  // namespace
}  // namespace prism::tables
