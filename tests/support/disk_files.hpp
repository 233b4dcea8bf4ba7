// SPDX-License-Identifier: MIT
// Shared by tests of logs and captures: settings, rows, and files on the disk.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <mutex>
#include <string>
#include <vector>

#include "base/problems.hpp"
#include "compensation/compensated.hpp"
#include "config/config.hpp"
#include "daemon/pipeline/interfaces.hpp"

namespace prism::test {

inline config::LogSegmentSettings segments_in(const std::string& directory) {
  config::LogSegmentSettings settings;
  settings.directory = directory;
  return settings;
}

/// The row whose second ends at `second` (UTC, s since 1970).
inline compensation::CompensatedWindow row_at(std::int64_t second) {
  compensation::CompensatedWindow row;
  row.window.second_mean.second = second - 1;
  row.window.second_mean.samples = 200;
  return row;
}

/// File names in a directory, sorted, without the segment index.
inline std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().extension() != ".index") names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

inline std::string content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_file(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

/// Collects reported lines: events, and the begin and end of problems. Thread-safe.
class Told {
 public:
  std::function<void(const std::string&)> teller() {
    return [this](const std::string& line) {
      const std::lock_guard lock(mutex_);
      lines_.push_back(line);
    };
  }
  pipeline::Tell events() {
    return [tell = teller()](pipeline::Severity severity, const std::string&, const std::string& line) {
      if (severity > pipeline::Severity::kInfo) tell(line);
    };
  }
  std::vector<std::string> lines() const {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  Problems problems{[tell = teller()](bool, const std::string&, const std::string& line) { tell(line); }};

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

}  // namespace prism::test
