// SPDX-License-Identifier: MIT
#include "tools/prismcal/verification/folder_contents.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string_view>

#include "base/file.hpp"
#include "tools/prismcal/recordings/bytes_kind.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::verification {
namespace {

namespace fs = std::filesystem;

// Returns true for the first bytes of a log, also if a power failure truncated them, or if one of them is damaged.
bool begins_a_log(const std::string& path) {
  constexpr std::string_view kFirstWords = "# prism ", kFormatMark = " data log, format ";
  auto in = FileReader::open(path);
  std::string first(64, '\0');
  first.resize(in ? in->read(first) : 0);
  const bool begins = kFirstWords.starts_with(first) || first.starts_with(kFirstWords);
  return in && (begins || first.find(kFormatMark) != std::string::npos);
}

// Also by the name, so that a capture with damaged first bytes is a fault, not a file of another type.
bool should_be_capture(const std::string& path) {
  return path.ends_with(".pcap") || path.ends_with(".pcapng") || recordings::is_capture(path);
}

void sort_in(const std::string& path, FolderContents& contents, std::vector<std::string>& tables) {
  if (path.ends_with(".csv")) {
    tables.push_back(path);
  } else if (should_be_capture(path)) {
    contents.captures.push_back(path);
  } else if (path.ends_with(".csv.index")) {
    contents.log = contents.folder;
  } else if (!path.ends_with(".pcap.index")) {
    contents.others.push_back(path);
  }
}

// If one .csv of a folder is a log, the folder is a log and its other .csv files are faults: the log readers read all
// .csv.
FolderContents sorted(const std::string& folder, std::vector<std::string> files) {
  std::sort(files.begin(), files.end());
  FolderContents contents;
  contents.folder = folder;
  std::vector<std::string> tables;
  for (const std::string& file : files) sort_in(file, contents, tables);
  if (std::any_of(tables.begin(), tables.end(), begins_a_log)) contents.log = folder;
  if (contents.log.empty()) contents.others.insert(contents.others.end(), tables.begin(), tables.end());
  return contents;
}

FolderContents of_file(const std::string& path) {
  FolderContents contents;
  contents.folder = fs::path(path).parent_path().string();
  contents.one_file = true;
  if (!FileReader::open(path)) {  // the check of a log has the reason
    contents.log = path;
    return contents;
  }
  std::vector<std::string> tables;
  sort_in(path, contents, tables);
  // An empty or truncated *.csv is a log: prismd was stopped before its first row.
  if (!tables.empty() && begins_a_log(path))
    contents.log = path;
  else
    contents.others.insert(contents.others.end(), tables.begin(), tables.end());
  return contents;
}

}  // namespace

std::vector<FolderContents> contents_of(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {of_file(path)};
  std::map<std::string, std::vector<std::string>> files;
  const auto options = fs::directory_options::skip_permission_denied;
  for (fs::recursive_directory_iterator entry(path, options, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code unknown;
    if (entry->is_regular_file(unknown)) files[entry->path().parent_path().string()].push_back(entry->path().string());
  }
  std::vector<FolderContents> all;
  for (auto& [folder, paths] : files) all.push_back(sorted(folder, std::move(paths)));
  return all;
}

}  // namespace prism::verification
