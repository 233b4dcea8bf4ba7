// SPDX-License-Identifier: MIT
// MATLAB's .mat files, written by libmatio in each version, and by GNU Octave (tests/files/octave).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/tables/table_source.hpp"

namespace prism::prismcal {
namespace {

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
}  // namespace prism::prismcal
