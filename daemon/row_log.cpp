// SPDX-License-Identifier: MIT
#include "daemon/row_log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "compensation/compensated_text.hpp"

namespace prism::daemon {

RowLog::RowLog(config::SegmentSettings settings, std::string name, std::string metadata, LogCounters& counters,
               std::function<void(const std::string&)> tell)
    : settings_(std::move(settings)),
      name_(std::move(name)),
      metadata_(std::move(metadata)),
      counters_(counters),
      tell_(std::move(tell)),
      clock_(settings_) {}

RowLog::~RowLog() { close_segment(); }

void RowLog::append(const compensation::CompensatedWindow& row) {
  const std::int64_t second = row.window.bucket.second + 1;
  line_.clear();
  compensation::append_csv(line_, row);
  const bool new_segment = clock_.begins_new(second, bytes_ + static_cast<std::int64_t>(line_.size()));
  if (new_segment) close_segment();
  if ((file_ >= 0 || open_segment(second)) && write_all(line_)) {
    recovered();
    ++counters_.rows;
    return;
  }
  ++counters_.dropped;
  ++dropped_in_fault_;
}

void RowLog::sync() {
  if (file_ >= 0 && ::fdatasync(file_) != 0) fault(std::string("cannot be synced: ") + std::strerror(errno));
}

void RowLog::set_metadata(std::string metadata) {
  if (metadata == metadata_) return;
  metadata_ = std::move(metadata);
  close_segment();
}

bool RowLog::open_segment(std::int64_t second) {
  if (auto made = make_segment_folder(settings_); !made) {
    fault(made.error().text());
    return false;
  }
  path_ = segment_path(settings_, name_, ".csv", second);
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0) {
    fault(fmt::format("{}: cannot be created: {}", path_, std::strerror(errno)));
    return false;
  }
  bytes_ = 0;
  if (!write_all(metadata_ + std::string(compensation::csv_columns()) + "\n")) {
    ::unlink(path_.c_str());
    close_segment();
    return false;
  }
  ++counters_.segments;
  delete_old_segments(settings_, name_, ".csv", path_, second);
  return true;
}

void RowLog::close_segment() {
  if (file_ < 0) return;
  sync();
  ::close(file_);
  file_ = -1;
  bytes_ = 0;
}

bool RowLog::write_all(const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t written = ::write(file_, text.data() + done, text.size() - done);
    if (written > 0) {
      done += static_cast<std::size_t>(written);
      continue;
    }
    if (written < 0 && errno == EINTR) continue;
    const int error = errno;
    const bool full = error == ENOSPC || error == EDQUOT;
    if (full && settings_.delete_when_full && delete_oldest_segment(settings_, name_, ".csv", path_)) continue;
    if (done > 0 && ::ftruncate(file_, bytes_) != 0) close_segment();  // a torn row would stay: end the segment there
    fault(fmt::format("{}: cannot be written: {}", path_, std::strerror(error)));
    return false;
  }
  bytes_ += static_cast<std::int64_t>(text.size());
  return true;
}

void RowLog::fault(const std::string& what) {
  if (faulty_) return;
  faulty_ = true;
  dropped_in_fault_ = 0;
  tell_("log: " + what + "; rows are dropped and counted until it works again");
}

void RowLog::recovered() {
  if (!faulty_) return;
  faulty_ = false;
  tell_(fmt::format("log: writing again after {} rows were dropped", dropped_in_fault_));
}

}  // namespace prism::daemon
