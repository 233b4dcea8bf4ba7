// SPDX-License-Identifier: MIT
// Reads prismd's log, a file or a folder of segments, as a recording.
#include <filesystem>
#include <set>
#include <string_view>

#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {

std::vector<std::string> axes_of_log(const std::string& path) {
  constexpr std::string_view kMark = "# axis: ";
  std::set<std::string> names;
  std::error_code error;
  const bool folder = std::filesystem::is_directory(path, error);
  for (const std::string& file : folder ? files_of(path, ".csv") : std::vector{path}) {
    auto in = FileReader::open(file);
    for (std::string line; in && in->read_line(line) && line.starts_with('#');) {
      // An invalid name becomes an error when the log itself is read.
      if (line.starts_with(kMark) && follows(TextRule::kAxisName, line.substr(kMark.size())))
        names.insert(line.substr(kMark.size()));
    }
  }
  return {names.begin(), names.end()};
}

Result<Recording> read_log(const std::string& path, const SourceOptions& options, LeaveOut leave_out,
                           SecondConsumer& consumer) {
  auto folder = LogFolder::open(path, options.axis);
  if (!folder) return tl::unexpected<Error>(folder.error());
  Recording recording;
  const std::filesystem::path name(path);
  recording.name = (name.has_stem() ? name.stem() : name.parent_path().stem()).string();
  for (const LogSegment& segment : folder->segments) recording.add_metadata(segment.comments);
  recording.most_seconds = folder->most_rows();
  SecondFeed feed(recording, leave_out, true, consumer);
  tables::ReadMeter meter(options.table.progress, folder->bytes());
  const auto left_out = join_rows(
      *folder, [&](const LogRow& row, bool begins_session) { return feed.push(row.second_mean, begins_session); },
      meter);
  if (!left_out) return tl::unexpected<Error>(left_out.error());
  recording.notes = left_out->lines();
  if (auto done = feed.finish(); !done) return tl::unexpected<Error>(done.error());
  for (const LogSegment& segment : folder->segments)
    recording.files.push_back({segment.path, segment.sha256, segment.rows});
  recording.absent = folder->absent;
  recording.notes.insert(recording.notes.end(), folder->absent.begin(), folder->absent.end());
  return recording;
}

}  // namespace prism::recordings
