// SPDX-License-Identifier: MIT
#include "tools/prismcal/verification/index_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/plain_text.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"

namespace prism::verification {
namespace {

namespace fs = std::filesystem;

std::string rows_text(std::uint64_t rows) { return rows > 0 ? ", with " + counted(rows, "row") : ""; }

std::vector<std::string> names_of(const std::string& folder) {
  std::vector<std::string> names;
  for (const std::string& path : recordings::files_of(folder, "")) names.push_back(fs::path(path).filename().string());
  return names;
}

}  // namespace

Indexes::Indexes(const std::string& folder, const std::string& extension) : folder_(folder) {
  for (const std::string& file : recordings::files_of(folder, extension + ".index")) {
    pipeline::SegmentIndex index(file);
    if (!index.read()) {
      damaged_.push_back(file);
      continue;
    }
    if (std::string text = recordings::deletion_text(file); !text.empty())
      deletions_.push_back({file, FileState::kDeleted, std::move(text)});
    index.settle(names_of(folder));
    if (file_.empty()) file_ = fs::path(file).filename().string();
    read_.push_back(std::move(index));
  }
}

std::uint64_t Indexes::number(const std::string& file) const {
  std::uint64_t number = 0;
  for (const auto& index : read_) number = std::max(number, index.number(file));
  return number;
}

void Indexes::check(const std::map<std::string, std::uint64_t>& rows, std::vector<Finding>& findings) const {
  for (const std::string& file : damaged_)
    findings.push_back({file, FileState::kDamaged, "not a valid index; segments are ordered by session and name"});
  findings.insert(findings.end(), deletions_.begin(), deletions_.end());
  for (const auto& index : read_) {
    for (const std::string& file : index.files()) {
      const std::string path = (fs::path(folder_) / file).string();
      const std::uint64_t expected = index.rows(file);
      const auto found = rows.find(file);
      std::error_code error;
      if (!fs::exists(path, error)) {
        findings.push_back({path, FileState::kMissing, "listed in the index" + rows_text(expected)});
      } else if (found != rows.end() && found->second < expected) {
        findings.push_back(
            {path, FileState::kMissing,
             fmt::format("{} of {} listed in the index", expected - found->second, counted(expected, "row"))});
      }
    }
  }
}

}  // namespace prism::verification
