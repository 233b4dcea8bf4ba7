// SPDX-License-Identifier: MIT
#include "daemon/log/row_log.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "base/text_number.hpp"
#include "compensation/compensated_text.hpp"

namespace prism::log {

RowLog::RowLog(config::LogSegmentSettings settings, std::string name, std::string metadata, LogCounters& counters,
               Problems& problems, const SegmentPolicy& policy)
    : metadata_(std::move(metadata)),
      counters_(counters),
      fault_("log", name, "rows", counters.dropped, problems),
      segments_(std::move(settings), std::move(name), ".csv", policy) {}

RowLog::~RowLog() { close(); }

void RowLog::close() {
  if (distrusted_) write_again();
  close_segment();
  if (!distrusted_) return;
  fault_.drop(unsynced_.size());
  unsynced_.clear();
  count_unsynced();
}

void RowLog::append(const compensation::CompensatedWindow& row, std::int64_t session_ns) {
  Row next{row.window.second_mean.second + 1, session_ns, {}};
  compensation::append_csv(next.line, row);
  if (!distrusted_) return write_row(std::move(next));
  if (unsynced_.size() >= kMostUnsynced) return fault_.drop(1);
  unsynced_.push_back(std::move(next));
  count_unsynced();
}

// Updates the sum over all axes' logs.
void RowLog::count_unsynced() {
  counters_.unsynced += unsynced_.size() - std::exchange(counted_unsynced_, unsynced_.size());
}

void RowLog::write_row(Row row) {
  if (row.session_ns != std::exchange(session_ns_, row.session_ns)) close_segment();
  if (segments_.begins_new(row.second, bytes_ + static_cast<std::int64_t>(row.line.size()))) close_segment();
  if (distrusted_) {  // the sync of the previous segment failed
    unsynced_.push_back(std::move(row));
  } else if ((file_ >= 0 || open_segment(row.second)) && write_all(row.line)) {
    ++counters_.rows;
    ++rows_;
    unsynced_.push_back(std::move(row));
    if (unsynced_.size() > kMostUnsynced) unsynced_.pop_front();  // in a replay, which never syncs
  } else {
    fault_.drop(1);
  }
  count_unsynced();
}

void RowLog::sync() {
  segments_.retain();
  if (distrusted_ && pause_.over()) write_again();
  if (file_ < 0 || !put_on_disk()) return;
  if (!segments_.in_place(file_)) {
    segments_.report(
        pipeline::Severity::kWarning, "disk",
        fmt::format("log: {}: was deleted or moved away, and its rows with it; starting a new segment", path_));
    close_segment();
  }
  fault_.synced();
}

void RowLog::set_metadata(std::string metadata) {
  if (metadata == metadata_) return;
  metadata_ = std::move(metadata);
  close_segment();
}

RowResult RowLog::page(const RowQuery& query) {
  auto page = log_rows_.page(query, file_ >= 0 ? synced_rows_ : 0);
  if (!page && page.error().gone > 0 && std::exchange(late_, query.after) != query.after)
    counters_.gone += page.error().gone;
  return page;
}

void RowLog::lose(const std::string& why) { fault_.lose(1, why); }

bool RowLog::open_segment(std::int64_t second) {
  Result<NewSegment> made = segments_.make(second);
  if (!made) {
    fault_.begin(made.error().text());
    return false;
  }
  file_ = made->descriptor;
  path_ = std::move(made->path);
  bytes_ = 0;
  rows_ = synced_rows_ = 0;
  sum_ = Sha256();
  torn_ = false;
  const std::string others = metadata_ + "# session: " + utc_nano_text(session_ns_) + "\n" +
                             (superseded_.empty() ? "" : "# supersedes: " + superseded_ + "\n");
  const std::string columns = compensation::csv_columns(compensation::sensors_in(metadata_)) + "\n";
  const std::string superseded = superseded_;
  if (!write_all(others + segments_.position_line(others) + columns)) {
    if (file_ >= 0) leave_segment(0);
    superseded_ = superseded;  // no segment names these rows yet
    return false;
  }
  ++counters_.segments;
  return true;
}

void RowLog::close_segment() {
  if (file_ < 0) return;
  if (!torn_ && rows_ > 0) write_end();
  if (file_ >= 0 && put_on_disk()) leave_segment(rows_);
}

// `rows` of its rows count; without one, the file is deleted.
void RowLog::leave_segment(std::uint64_t rows) {
  ::close(std::exchange(file_, -1));
  bytes_ = 0;
  rows > 0 ? segments_.ended(rows) : segments_.unmake();
}

// If the end line cannot be written, the segment looks as after a power cut: its rows are still valid.
void RowLog::write_end() {
  torn_ = true;
  write_all(fmt::format("# end: rows {}, sha256 {}\n", rows_, sum_.hex()));
}

bool RowLog::put_on_disk() {
  if (::fdatasync(file_) == 0) {
    synced_rows_ = rows_;
    unsynced_.clear();
    count_unsynced();
    superseded_.clear();
    pause_.end();
    return true;
  }
  fault_.begin(fmt::format("{}: cannot be synced: {}", path_, std::strerror(errno)));
  distrust();
  return false;
}

// Leaves the segment without an end line.
void RowLog::distrust() {
  const std::uint64_t good = rows_ - std::min<std::uint64_t>(rows_, unsynced_.size());
  if (good > 0) superseded_ = fmt::format("{} from row {}", std::filesystem::path(path_).filename().string(), good + 1);
  leave_segment(good);
  counters_.rows -= unsynced_.size();
  distrusted_ = true;
  pause_.begin();
}

void RowLog::write_again() {
  distrusted_ = false;
  for (std::deque<Row> rows = std::exchange(unsynced_, {}); !rows.empty(); rows.pop_front())
    write_row(std::move(rows.front()));
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
    if (disk_is_full(error) && segments_.make_room()) continue;
    fault_.begin(fmt::format("{}: cannot be written: {}", path_, std::strerror(error)));
    if (done > 0 &&
        ::ftruncate(file_, bytes_) != 0) {  // an incomplete row remains: close the segment without an end line
      torn_ = true;
      close_segment();
    }
    return false;
  }
  sum_.add(text);
  bytes_ += static_cast<std::int64_t>(text.size());
  return true;
}

LogWriter::LogWriter(config::LogSegmentSettings settings, std::string name, std::string metadata, DiskThread* disk,
                     Problems& problems, Owner owner, std::shared_ptr<LogCounters> counters,
                     const SegmentPolicy& policy)
    : disk_(disk),
      counters_(std::move(counters)),
      log_(std::make_shared<RowLog>(std::move(settings), std::move(name), std::move(metadata), *counters_, problems,
                                    policy)),
      owner_(std::move(owner)) {}

// The last owner closes the segment, on the disk thread after the pending rows.
void LogWriter::close() {
  if (log_ && disk_ != nullptr)
    disk_->post(0, [log = std::exchange(log_, nullptr), counters = counters_]() mutable { log.reset(); });
  log_.reset();
}

void LogWriter::append(const compensation::CompensatedWindow& row, std::int64_t session_ns) {
  if (!log_) return;
  if (disk_ == nullptr) return log_->append(row, session_ns);
  ++counters_->pending;
  const bool taken = disk_->post(
      sizeof row,
      [log = log_, counters = counters_, written = owner_.written, row, session_ns] {
        log->append(row, session_ns);
        if (--counters->pending == 0) written();
      },
      [log = log_, counters = counters_, written = owner_.written](const std::string& why) {
        log->lose(why);
        if (--counters->pending == 0) written();
      });
  if (!taken) {
    --counters_->pending;
    log_->lose("the disk cannot keep up");
  }
  unsynced_ = true;
}

// A replay can be repeated: its segments are synced on close.
void LogWriter::sync() {
  if (!log_ || disk_ == nullptr) return;
  if (std::exchange(unsynced_, false) || counters_->unsynced > 0 || ++idle_ > kIdleSyncs) {
    idle_ = 0;
    disk_->post(0, [log = log_, synced = owner_.synced] {
      log->sync();
      synced();
    });
  }
}

void LogWriter::set_metadata(const std::string& metadata) {
  if (!log_) return;
  if (disk_ == nullptr) return log_->set_metadata(metadata);
  disk_->post(0, [log = log_, metadata] { log->set_metadata(metadata); });
}

void LogWriter::read(const RowQuery& query, Pages done) {
  const auto refuse = [done](const std::string& why) {
    done(tl::unexpected(pipeline::RowRefusal{config::kFailed, "rows: " + why}));
  };
  if (!log_) return refuse("the log is closed");
  if (disk_ == nullptr) return done(log_->page(query));
  disk_->post(
      0, [log = log_, query, done] { done(log->page(query)); }, refuse);
}

std::vector<std::unique_ptr<RowWriter>> make_logs(const pipeline::Setup& setup, DiskThread* disk, Problems& problems,
                                                  const LogWriter::Owner& owner, const SegmentPolicy& policy) {
  std::vector<std::unique_ptr<RowWriter>> logs;
  const auto counters = std::make_shared<LogCounters>();
  for (std::size_t i = 0; setup.config.log && i < setup.axes.size(); ++i)
    logs.push_back(std::make_unique<LogWriter>(log_settings(setup), log_name(setup, i), log_metadata(setup, i), disk,
                                               problems, owner, counters, policy));
  return logs;
}

}  // namespace prism::log
