// SPDX-License-Identifier: MIT
// Any plain table that this test writes is read back to the last digit; any other is refused, and a damaged one never
// gives a wrong number, hangs or crashes.
#include "tools/prismcal/plain_table.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/sha256.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::tables {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Random = std::mt19937;
using Columns = std::vector<std::vector<double>>;

std::size_t pick(Random& random, std::size_t count) {
  return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

struct Written {
  std::string text, form;
  Columns columns;  ///< NaN: missing
};

/// A table of 3 to 6 columns with random digits, signs, missing values and form.
Written write_any(Random& random) {
  const std::string separator(1, ",;\t"[pick(random, 3)]), end = pick(random, 2) == 0 ? "\n" : "\r\n";
  const bool comma = separator != "," && pick(random, 2) == 1, units = pick(random, 3) == 0,
             quotes = pick(random, 3) == 0, holes = pick(random, 2) == 0;
  const std::size_t width = 3 + pick(random, 4), rows = 5 + pick(random, 200);
  Written written;
  written.form = fmt::format("separator \"{}\", comma {}, units {}, quotes {}, missing {}, {} x {}", separator, comma,
                             units, quotes, holes, rows, width);
  written.columns.resize(width);
  std::string& text = written.text = pick(random, 4) == 0 ? "\xEF\xBB\xBF" : "";
  if (pick(random, 3) == 0) text += "# a comment" + end;
  const auto row = [&](auto cell) {
    for (std::size_t c = 0; c < width; ++c) {
      const std::string value = cell(c);
      text += (c > 0 ? separator : "") + (quotes ? '"' + value + '"' : value);
    }
    text += end;
  };
  row([&](std::size_t c) { return fmt::format("column{}", static_cast<char>('A' + c)); });
  if (units) row([&](std::size_t c) { return std::string(c == 0 ? "s" : "deg/h"); });
  for (std::size_t i = 0; i < rows; ++i) {
    row([&](std::size_t c) {
      const double value = c == 0 ? 0.01 * static_cast<double>(i)
                                  : (c % 2 == 0 ? -1 : 1) * std::pow(10.0, static_cast<double>(c)) *
                                        std::uniform_real_distribution<>(1.01, 9.9)(random);
      std::string cell = fmt::format("{:.{}f}", value, c == 0 ? 2 : 1 + pick(random, 12));
      if (c > 0 && pick(random, 8) == 0) cell = fmt::format("{:.9e}", value);
      const bool hole = holes && i > 0 && c > 0 && pick(random, 12) == 0;
      written.columns[c].push_back(hole ? NAN : std::strtod(cell.c_str(), nullptr));
      if (hole) return std::string(pick(random, 2) == 0 ? "" : "NaN");
      if (comma) std::replace(cell.begin(), cell.end(), '.', ',');
      return cell;
    });
  }
  return written;
}

class PlainTables : public testing::Test {
 protected:
  std::string written(const std::string& text) {
    std::string path = folder_.file("table.csv");
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  /// All columns of a file, or nullopt if it is refused.
  std::optional<Columns> read(const std::string& text, const TableOptions& options = {}) {
    auto table = PlainTable::open(written(text), options);
    if (!table) return refused(table.error());
    Selection selection;
    for (std::size_t i = 0; i < table->columns().size(); ++i) selection.numbers.push_back(i);
    if (auto good = table->select(selection); !good) return refused(good.error());
    Columns columns(selection.numbers.size());
    Row row;
    while (true) {
      const auto more = table->next(row);
      if (!more) return refused(more.error());
      if (!*more) return columns;
      for (std::size_t c = 0; c < columns.size(); ++c) columns[c].push_back(row.values[c]);
    }
  }
  /// The times of the first column, s.
  std::optional<std::vector<double>> times(const std::string& text, const TableOptions& options = {}) {
    auto table = PlainTable::open(written(text), options);
    if (!table) return refused(table.error()), std::nullopt;
    Selection selection;
    selection.time = TimeSelection{0};
    if (auto good = table->select(selection); !good) return refused(good.error()), std::nullopt;
    std::vector<double> found;
    Row row;
    while (true) {
      const auto more = table->next(row);
      if (!more) return refused(more.error()), std::nullopt;
      if (!*more) return found;
      found.push_back(static_cast<double>(row.time_ns) / 1e9);
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

int number_of(const char* variable, int usual) {
  const char* const wanted = std::getenv(variable);
  return wanted ? std::atoi(wanted) : usual;
}

TEST_F(PlainTables, AreReadToTheLastDigit) {
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    const Written table = write_any(random);
    const auto columns = read(table.text);
    ASSERT_TRUE(columns) << why_ << "\n" << table.form << "\n" << table.text;
    ASSERT_EQ(columns->size(), table.columns.size()) << table.form;
    for (std::size_t c = 0; c < columns->size(); ++c) {
      ASSERT_EQ((*columns)[c].size(), table.columns[c].size()) << table.form;
      for (std::size_t r = 0; r < table.columns[c].size(); ++r) {
        const double found = (*columns)[c][r], truth = table.columns[c][r];
        ASSERT_TRUE(found == truth || (std::isnan(found) && std::isnan(truth)))
            << table.form << ", row " << r << ", column " << c << ": " << found << " instead of " << truth;
      }
    }
  }
}

/// Damage in one place that leaves no other valid number: nothing is changed into or within digits, signs and marks.
std::string damaged(const std::string& text, Random& random) {
  const std::string marks = "#%&:|'/<>@[]_~x*\x80\xFF \t\"\r\n;" + std::string(1, '\0');
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    lines.push_back(text.substr(at, end - at));
    at = end;
  }
  const std::size_t row = pick(random, lines.size()), at = pick(random, text.size());
  const auto joined = [&] {
    std::string all;
    for (const std::string& line : lines) all += line;
    return all;
  };
  switch (pick(random, 6)) {
    case 0:
      return text.substr(0, at);
    case 1:
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(row));
      return joined();
    case 2:
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(row), lines[row]);
      return joined();
    case 3:
      while (lines[row].ends_with('\n') || lines[row].ends_with('\r')) lines[row].pop_back();
      return joined();
    case 4:
      std::reverse(lines.begin() + static_cast<std::ptrdiff_t>(row), lines.end());
      return joined();
    default:
      return text.substr(0, at) + marks[pick(random, marks.size())] + text.substr(at);
  }
}

// 20 000 in the full set.
TEST_F(PlainTables, DamageGivesNoWrongNumber) {
  Random random(2);
  for (int i = 0; i < number_of("PRISM_MUTANTS", 2000); ++i) {
    const Written table = write_any(random);
    const std::string text = damaged(table.text, random);
    const auto columns = read(text);
    if (!columns) continue;
    ASSERT_EQ(columns->size(), table.columns.size()) << table.form << "\n" << text;
    for (std::size_t c = 0; c < columns->size(); ++c) {
      const std::set<double> truth(table.columns[c].begin(), table.columns[c].end());
      for (const double value : (*columns)[c])
        ASSERT_TRUE(std::isnan(value) || truth.contains(value)) << value << "\n" << table.form << "\n" << text;
    }
  }
}

TEST_F(PlainTables, AnyBytesEndWithOneLine) {
  Random random(3);
  for (int i = 0; i < number_of("PRISM_MUTANTS", 2000); ++i) {
    std::string text = write_any(random).text;
    for (std::size_t k = 0; k < 3; ++k) text[pick(random, text.size())] = static_cast<char>(pick(random, 256));
    (void)read(text);
  }
}

TEST_F(PlainTables, AnEmptyFirstLineIsPassedOver) {
  EXPECT_THAT(*read("\na,b\n1,2\n"), ElementsAre(ElementsAre(1), ElementsAre(2)));
  EXPECT_FALSE(read("\n"));
  EXPECT_FALSE(read("\n\n\n"));
}

TEST_F(PlainTables, ANumberHasOneSign) {
  EXPECT_EQ(number_in("+5", '.'), 5);
  EXPECT_EQ(number_in("-1,5", ','), -1.5);
  for (const char* const text :
       {"+-5", "+-1", "-+1", "++1", "--1", "+", "-", "1,5", "1.2.3", "0x10", "inf", "nan", "1_0"})
    EXPECT_FALSE(number_in(text, '.')) << text;
  for (const char* const text : {"1.5", "1,2,3", "1.234,5"}) EXPECT_FALSE(number_in(text, ',')) << text;
  EXPECT_FALSE(read("a,b\n1,2\n+-5,4\n"));
  EXPECT_THAT(why_, HasSubstr("table.csv:3: column a: found \"+-5\", expected a number; prism-import"));
}

TEST_F(PlainTables, DecimalSigns) {
  EXPECT_THAT(*read("a;b\n1,5;2\n"), ElementsAre(ElementsAre(1.5), ElementsAre(2)));
  EXPECT_FALSE(read("a;b\n1,5;2\n2.5;3\n"));
  EXPECT_THAT(why_, HasSubstr("found \"1,5\" and \"2.5\", expected one decimal sign"));
  EXPECT_FALSE(read("a;b\n1,500;2\n2,500;3\n"));
  EXPECT_THAT(why_, HasSubstr("two readings are possible: \"1,500\" is 1.5 or, with grouped digits, 1500"));
  EXPECT_TRUE(read("a;b\n1,500;2,5\n2,500;3,5\n"));
  EXPECT_FALSE(read("a,b\nV,s\n1,2,3\n"));  // no row as wide as the names
  TableOptions comma;
  comma.decimal = ",";
  EXPECT_THAT(*read("a;b\n1,500;2\n2,500;3\n", comma), ElementsAre(ElementsAre(1.5, 2.5), ElementsAre(2, 3)));
  EXPECT_THAT(*read("a\n1,5\n", comma), ElementsAre(ElementsAre(1.5)));
  EXPECT_FALSE(read("a\n1,5\n"));
  EXPECT_FALSE(read("a;b\n743;2\n1.006;3\n"));
  EXPECT_THAT(why_, HasSubstr("\"1.006\" is 1.006 or, with grouped digits, 1006"));
  EXPECT_TRUE(read("a;b\n25;2\n25.001;3\n"));
}

TEST_F(PlainTables, TimesHaveAUnitOrADate) {
  EXPECT_THAT(*times("t_ms,r\n0,1\n500,2\n"), ElementsAre(0, 0.5));
  EXPECT_THAT(*times("t,r\nms,deg/h\n0,1\n500,2\n"), ElementsAre(0, 0.5));
  EXPECT_FALSE(times("time,r\n0,1\n500,2\n"));
  EXPECT_THAT(why_, HasSubstr("column time: found times as \"0\" without a unit"));
  TableOptions days;
  days.time_unit = "d";
  EXPECT_THAT(*times("time,r\n0,1\n2,2\n", days), ElementsAre(0, 172800));
  EXPECT_THAT(*times("time,r\n2024-02-29T12:00:00,1\n2024-02-29 12:00:00.5,2\n"),
              ElementsAre(1709208000, 1709208000.5));
  EXPECT_THAT(*times("time,r\n2024-02-29T12:00:00+02:00,1\n2024-02-29T10:00Z,2\n"),
              ElementsAre(1709200800, 1709200800));
  for (const char* const text :
       {"29.02.2024 12:00:00", "02/29/2024 12:00:00", "2023-02-29 12:00:00", "2024-02-29", "12:00:00",
        "2024-02-29 24:00:00", "2024-02-29 1:00:00", "24-02-29 12:00:00", "2024-02-29T12:00:00 CET"}) {
    EXPECT_FALSE(times(fmt::format("time,r\n{},1\n", text))) << text;
    EXPECT_THAT(why_, HasSubstr("expected a time as 2024-03-01 12:00:05.250 or a number; prism-import"));
  }
  EXPECT_FALSE(times("time,r\n2024-02-29T12:00:00Z,1\n2024-02-29T12:00:00,2\n"));
  EXPECT_THAT(why_, HasSubstr("expected a zone as in the first row"));
  EXPECT_FALSE(times("t_s,r\n1,1\n4.6e9,2\n"));
  EXPECT_FALSE(times("t_s,r\n2,1\n1,2\n"));
  EXPECT_THAT(why_, HasSubstr(":3: found time 1 s after 2 s, expected increasing times"));
}

TEST_F(PlainTables, NamesOfLatin1AndQuotedNames) {
  auto table = PlainTable::open(written("\"Zeit [s]\"; \" Rate [\xB0/h] \";\"a;b\"\n1;2;3\n"), {});
  ASSERT_TRUE(table) << table.error().text();
  EXPECT_EQ(table->names_text(), "Zeit [s], Rate [°/h], a;b");
  EXPECT_EQ(table->columns()[1].unit->name, "deg/h");
  EXPECT_EQ(table->form_text(), "Latin-1, separator semicolon, decimal point, names in line 1");
}

TEST_F(PlainTables, OnlyOtherColumnsHaveAValue) {
  auto table = PlainTable::open(written("t_s,r,T\n0,1,20\n1,,21\n2,,\n3,4,\n"), {});
  ASSERT_TRUE(table);
  Selection selection{{1}, TimeSelection{0}};
  ASSERT_TRUE(table->select(selection));
  std::vector<bool> others;
  Row row;
  while (*table->next(row)) others.push_back(row.only_others);
  EXPECT_THAT(others, ElementsAre(false, true, false, false));
}

// Its second reading ran past the end of what the first had found.
TEST_F(PlainTables, ATableMayGrowWhileItIsRead) {
  std::string text = "t_s,r\n";
  for (int i = 0; i < 500; ++i) text += fmt::format("{},{}\n", i, 2 * i);
  const std::string path = written(text);
  auto table = PlainTable::open(path, {});
  ASSERT_TRUE(table);
  ASSERT_TRUE(table->select({{1}, TimeSelection{0}}));
  Row row;
  int rows = 0;
  for (; *table->next(row); ++rows) {
    EXPECT_EQ(row.values[0], 2 * rows);
    if (rows % 100 != 50 || rows > 900) continue;
    std::string more;
    for (int i = 0; i < 100; ++i) {
      more += fmt::format("{},{}\n", 500 + i + 100 * (rows / 100), 2 * (500 + i + 100 * (rows / 100)));
    }
    std::ofstream(path, std::ios::binary | std::ios::app) << more;
    text += more;
  }
  EXPECT_GE(rows, 500);
  EXPECT_EQ(static_cast<std::size_t>(rows), table->rows());
  if (rows == 1500) {
    EXPECT_EQ(table->sha256(), sha256_hex(text));
  }
}

}  // namespace
}  // namespace prism::tables
