// SPDX-License-Identifier: MIT
// Fixture of the verification tests: writes logs and captures with prismd's writers and injects faults.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "daemon/log/row_log.hpp"
#include "drivers/capture_file.hpp"
#include "tests/support/disk_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/verification/verify.hpp"

namespace prism::verification {

inline constexpr std::int64_t kNoon = 1'795'262'400;  // 2026-11-21T12:00:00Z

struct InjectedFaults : testing::Test {
  /// Opens a log writer in the folder log/.
  std::unique_ptr<log::RowLog> writer(const std::string& metadata = "", const std::string& name = "gyro1") {
    return std::make_unique<log::RowLog>(test::segments_in(log), name,
                                         "# prism 0.2.0 data log, format 2\n# instance: gyro1\n" + metadata, counters,
                                         [](const std::string& what) { ADD_FAILURE() << what; });
  }
  /// Appends rows whose seconds end at first, first + 1, …, as a new session.
  static void append(log::RowLog& rows, std::int64_t first, int count) {
    for (int i = 0; i < count; ++i) {
      compensation::CompensatedWindow row = test::row_at(first + i);
      row.window.second_mean.rate_deg_per_h = 8.0 + 0.01 * (i % 7);
      row.window.second_mean.temperature_degc = 25.0 + 0.001 * i;
      rows.append(row, (first - 1) * 1'000'000'000 + 1);
    }
  }
  /// Writes and closes a segment of `count` rows from kNoon + after_s.
  void segment(int after_s, int count, const std::string& metadata = "") {
    append(*writer(metadata), kNoon + after_s, count);
  }
  /// gyro1-20261121T1200SSZ.csv
  static std::string name(int after_s) { return "gyro1-" + utc_file_text(kNoon + after_s) + ".csv"; }
  std::string path(int after_s) const { return log + "/" + name(after_s); }

  static std::vector<std::string> lines_of(const std::string& path) {
    std::vector<std::string> lines;
    std::istringstream in(test::content(path));
    for (std::string line; std::getline(in, line);) lines.push_back(line + "\n");
    return lines;
  }
  static void write(const std::string& path, const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line;
    test::write_file(path, text);
  }
  static void replace(const std::string& path, const std::string& from, const std::string& to) {
    std::string text = test::content(path);
    ASSERT_NE(text.find(from), std::string::npos) << from;
    test::write_file(path, text.replace(text.find(from), from.size(), to));
  }
  static void cut(const std::string& path, std::size_t bytes) {
    std::filesystem::resize_file(path, std::filesystem::file_size(path) - bytes);
  }
  static std::size_t line_of_row(const std::string& path, std::size_t row) {  // from 1
    const auto lines = lines_of(path);
    std::size_t line = 0;
    for (std::size_t rows = 0; rows < row; ++line) rows += lines[line][0] >= '0' && lines[line][0] <= '9';
    return line;
  }

  /// Writes capture/NAME: an opening packet, then one packet of 10 bytes per second; `packets` in all.
  std::string capture(const std::string& name, int packets) {
    std::filesystem::create_directories(folder.file("capture"));
    std::string path = folder.file("capture/" + name);
    auto file = drivers::CaptureWriter::open(path);
    const std::vector<std::uint8_t> bytes(10, 0x24);
    EXPECT_TRUE(file->opened(kNoon * 1'000'000'000));
    for (int i = 1; i < packets; ++i) EXPECT_TRUE(file->data((kNoon + i) * 1'000'000'000, bytes));
    EXPECT_TRUE(file->flush());
    return path;
  }

  /// Returns "FILE: STATE: TEXT" or "FILE:LINE: STATE: TEXT" for each fault, in the order of verify().
  static std::vector<std::string> faults(const std::string& path) {
    std::vector<std::string> found;
    for (const Finding& finding : verify(path).findings) {
      const std::string file = std::filesystem::path(finding.path).filename().string();
      if (is_fault(finding.state))
        found.push_back(file + (finding.line > 0 ? ":" + std::to_string(finding.line) : "") + ": " +
                        kStateNames[static_cast<std::size_t>(finding.state)] + ": " + finding.text);
    }
    return found;
  }

  const test::TemporaryFolder folder;
  const std::string log = folder.file("log");
  pipeline::LogCounters counters;
};

}  // namespace prism::verification
