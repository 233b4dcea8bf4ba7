// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/containers.hpp"

#include <array>
#include <string_view>

#include "base/file.hpp"

namespace prism::tables {
namespace {

struct Known {
  std::string_view begin;
  const char* refusal;
};

using std::string_view_literals::operator""sv;

constexpr std::array<Known, 11> kKnown = {{
    {"PK\x03\x04"sv, "is an Excel or other ZIP file (.xlsx); in Excel: save it as \"CSV UTF-8\""},
    {"\xD0\xCF\x11\xE0"sv, "is an old Excel file (.xls); in Excel: save it as \"CSV UTF-8\""},
    {"TDSm"sv,
     "is a TDMS file of LabVIEW; write it with \"Write To Measurement File\" as text, or export it by "
     "python3 -c 'import nptdms,sys; nptdms.TdmsFile(sys.argv[1]).as_dataframe().to_csv(\"out.csv\")' FILE"},
    {"ULog\x01\x12\x35"sv, "is a ULog of PX4; export it by ulog2csv FILE"},
    {"#ROSBAG"sv, "is a bag of ROS; export a topic by rostopic echo -b FILE -p /TOPIC > out.csv"},
    {"SQLite format 3"sv,
     "is an SQLite file (a bag of ROS 2); export a topic by ros2 topic echo --csv /TOPIC > out.csv "
     "while ros2 bag play FILE runs"},
    {"\x89MCAP0\r\n"sv,
     "is an MCAP file (a bag of ROS 2); export a topic by ros2 topic echo --csv /TOPIC > out.csv while "
     "ros2 bag play FILE runs"},
    {"\x1F\x8B"sv, "is compressed by gzip; unpack it by gunzip FILE"},
    {"\xFD"
     "7zXZ"sv,
     "is compressed by xz; unpack it by unxz FILE"},
    {"PAR1"sv,
     "is a Parquet file; export it by python3 -c 'import pandas,sys; "
     "pandas.read_parquet(sys.argv[1]).to_csv(\"out.csv\")' FILE"},
    {"%PDF"sv, "is a PDF document; export the table as CSV"},
}};

}  // namespace

Result<Container> container_of(const std::string& path) {
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::array<char, 512> bytes{};
  const std::string_view first(bytes.data(), in->read(bytes));
  Container container;
  for (const Known& known : kKnown) {
    if (first.starts_with(known.begin)) container.refusal = known.refusal;
  }
  const bool hdf = first.starts_with("\x89HDF\r\n\x1A\n");
  container.is_mat = first.starts_with("MATLAB 5.0 MAT-file") || first.starts_with("MATLAB 7.3 MAT-file") || hdf;
  return container;
}

}  // namespace prism::tables
