// SPDX-License-Identifier: MIT
// Files of other programs that are not plain tables, by their first bytes.
#include <array>
#include <string_view>

#include "base/file.hpp"
#include "tools/prismcal/tables/plain_table.hpp"

namespace prism::tables {
namespace {

struct Known {
  std::string_view begin;
  const char* what;
};

using std::string_view_literals::operator""sv;

constexpr std::array<Known, 17> kKnown = {{{"PK\x03\x04"sv, "an Excel or other ZIP file (.xlsx)"},
                                           {"\xD0\xCF\x11\xE0"sv, "an old Excel file (.xls)"},
                                           {"MATLAB 5.0 MAT-file"sv, "a MATLAB file (.mat)"},
                                           {"MATLAB 7.3 MAT-file"sv, "a MATLAB file (.mat)"},
                                           {"\x89HDF\r\n\x1A\n"sv, "a MATLAB or other HDF5 file"},
                                           {"TDSm"sv, "a TDMS file of LabVIEW"},
                                           {"ULog\x01\x12\x35"sv, "a ULog of PX4"},
                                           {"#ROSBAG"sv, "a bag of ROS"},
                                           {"SQLite format 3"sv, "an SQLite file (a bag of ROS 2)"},
                                           {"\x89MCAP0\r\n"sv, "an MCAP file (a bag of ROS 2)"},
                                           {"\x1F\x8B"sv, "compressed by gzip"},
                                           {"\xFD\x37zXZ"sv, "compressed by xz"},
                                           {"PAR1"sv, "a Parquet file"},
                                           {"%PDF"sv, "a PDF document"},
                                           {"LabVIEW Measurement"sv, "a LabVIEW measurement file (.lvm)"},
                                           {"\xFF\xFE"sv, "UTF-16 or UTF-32 text"},
                                           {"\xFE\xFF"sv, "UTF-16 text"}}};

}  // namespace

Result<std::string> foreign_file(const std::string& path) {
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::array<char, 32> bytes{};
  const std::string_view first(bytes.data(), in->read(bytes));
  for (const Known& known : kKnown) {
    if (first.starts_with(known.begin)) return known.what;
  }
  const auto is_letter = [](char c) { return c >= ' ' && c <= '~'; };
  for (const std::size_t zero : {0, 1}) {  // UTF-16 without a mark
    if (first.size() > 3 && first[zero] == 0 && first[zero + 2] == 0 && is_letter(first[1 - zero]) &&
        is_letter(first[3 - zero]))
      return "UTF-16 text";
  }
  return std::string();
}

}  // namespace prism::tables
