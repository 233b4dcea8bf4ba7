// SPDX-License-Identifier: MIT
#include "daemon/log/segments.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "base/time_scale.hpp"

namespace prism::log {
namespace {

namespace fs = std::filesystem;
using pipeline::LogPosition, pipeline::OldIndex, pipeline::SupersededRows, pipeline::kNoLog;

constexpr std::int64_t kDay_s = 86400;
constexpr double kMiB = 1 << 20;
constexpr std::int64_t kLookAfterNew_s = 10;  // a line that flaps begins a segment with each connection
constexpr std::int64_t kLookEvery_s = 60;
constexpr std::int64_t kMinGrowth_s = 10;  // shorter: the growth is not known

// Time until `bytes` more are stored.
std::int64_t wait_for(std::int64_t bytes, double bytes_per_s) {
  constexpr double kMost_s = 1e11;  // above: not worth announcing
  if (bytes < 0) return 0;
  const double wait_s = bytes_per_s > 0 ? static_cast<double>(bytes) / bytes_per_s : kMost_s;
  return wait_s < kMost_s ? static_cast<std::int64_t>(wait_s) + 1 : std::numeric_limits<std::int64_t>::max();
}

// The lines "# KEY: VALUE" above the columns of a log, as far as they are complete; nullopt: it cannot be opened.
std::optional<std::string> header_lines(const std::string& path) {
  auto in = FileReader::open(path);
  if (!in) return std::nullopt;
  std::string text;
  for (std::string line;
       text.size() < kMaxTextBytes && in->read_line(line) && in->line_ended() && line.starts_with("# ");)
    text += line + '\n';
  return text;
}

// "" if the header lines have no such key.
std::string header_value(const std::string& text, const std::string& key) {
  const std::string before = "# " + key + ": ";
  for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1)
    if (text.compare(at, before.size(), before) == 0)
      return text.substr(at + before.size(), text.find('\n', at) - at - before.size());
  return {};
}

// The number of complete rows of a log: that of the end line, or counted after a crash. They are synced before a client
// sees them; 0 if that fails.
std::uint64_t rows_in_file(const std::string& path) {
  constexpr std::uint64_t kEndChars = 128;
  constexpr std::string_view kEnd = "# end: rows ";
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  auto in = FileReader::open(path);
  if (!in || ::fstat(file.get(), &status) != 0 || ::fdatasync(file.get()) != 0) return 0;
  const auto bytes = static_cast<std::uint64_t>(status.st_size);
  in->seek(bytes - std::min(bytes, kEndChars));
  std::string line;
  while (in->read_line(line)) {
    if (!line.starts_with(kEnd) || !in->line_ended()) continue;
    const std::string_view number = std::string_view(line).substr(kEnd.size());
    if (const auto rows = parse_number<std::uint64_t>(number.substr(0, number.find(',')))) return *rows;
  }
  in->seek(0);
  std::uint64_t rows = 0;
  bool below_columns = false;
  while (in->read_line(line) && in->line_ended()) {
    if (line.starts_with('#')) continue;
    rows += std::exchange(below_columns, true);
  }
  return rows;
}

}  // namespace

bool disk_is_full(int error) { return error == ENOSPC || error == EDQUOT; }

Segments::Segments(config::LogSegmentSettings settings, std::string name, std::string extension, SegmentPolicy policy)
    : settings_(std::move(settings)),
      name_(std::move(name)),
      extension_(std::move(extension)),
      policy_(std::move(policy)),
      started_s_(policy_.uptime_s()) {}

bool Segments::begins_new(std::int64_t second, std::int64_t bytes) {
  const std::int64_t period = second / settings_.max_age_s - (second % settings_.max_age_s < 0 ? 1 : 0);
  if (period == period_ && bytes <= settings_.max_bytes) return false;
  period_ = period;
  return true;
}

Result<NewSegment> Segments::make(std::int64_t second) {
  std::error_code error;
  fs::create_directories(settings_.directory, error);
  if (error) return make_error(settings_.directory, "cannot be created: " + error.message());
  if (auto begun = begin(); !begun) return tl::unexpected<Error>(begun.error());
  StoredSegment segment;
  segment.name = {.begin_s = second, .running_s = running_s()};
  for (;;) {
    NewSegment made;
    segment.number = segment.name.number = next_;
    segment.file = segment.name.file(name_, extension_);
    segment.path = made.path = settings_.directory + "/" + segment.file;
    made.descriptor = ::open(made.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_APPEND | O_CLOEXEC, 0644);
    if (made.descriptor >= 0) {
      ::flock(made.descriptor, LOCK_EX | LOCK_NB);
      ++next_;
      current_ = made.path;
      stored_.push_back(std::move(segment));
      next_look_s_ = std::min(next_look_s_, policy_.uptime_s() + scaled_s(kLookAfterNew_s));
      return made;
    }
    const int why = errno;
    if (why == EEXIST) {
      ++next_;
    } else if (!disk_is_full(why) || !make_room()) {
      return make_error(made.path, std::string("cannot be created: ") + std::strerror(why));
    }
  }
}

std::string Segments::position_line(const std::string& others) {
  if (id_ == kNoLog) id_ = sha256_hex(others).substr(0, pipeline::kLogIdChars);
  StoredSegment& newest = stored_.back();
  newest.position = {id_, newest.number, end_ + 1, newest.name.running_s};
  return newest.position->line();
}

void Segments::ended(std::uint64_t rows) { end_ += rows; }

void Segments::unmake() {
  ::unlink(current_.c_str());
  if (stored_.empty() || stored_.back().path != current_) return;
  next_ = stored_.back().number;
  stored_.pop_back();
  if (stored_.empty() && end_ == 0) id_ = kNoLog;
}

// The log continues where the newest segment ends.
Result<void> Segments::begin() {
  if (has_begun_) return {};
  if (auto listed = scan(); !listed) return listed;
  has_begun_ = true;
  const OldIndex index = OldIndex::read(index_path()).value_or(OldIndex());
  is_log() ? begin_log(index) : begin_capture(index);
  if (!stored_.empty()) next_ = std::max(next_, stored_.back().number + 1);
  return {};
}

void Segments::begin_log(const OldIndex& index) {
  const auto is_new = [this](std::size_t i) { return i > 0 && stored_[i - 1].name.number > 0; };
  std::size_t newest = stored_.size();  // one after the newest whose position is known
  while (is_new(newest) && !position(newest - 1)) --newest;
  if (is_new(newest)) {
    id_ = position(newest - 1)->log;
  } else if (!index.id.empty()) {
    id_ = index.id;
  }
  number_old(index);
  if (is_new(newest)) {
    const LogPosition& last = *position(newest - 1);
    end_ = last.first - 1 + written(newest - 1);
    // A running time that grows by more than the rows and a day is damage, and makes no segment old.
    const auto rows_s = static_cast<std::int64_t>(end_ + 1 - last.first);
    const std::int64_t most_s =
        newest < 2 ? last.running_s : started_s(newest - 2) + static_cast<std::int64_t>(rows_of(newest - 2)) + kDay_s;
    ran_s_ = std::min(last.running_s, most_s) + rows_s;
  }
  for (; newest < stored_.size(); ++newest) end_ += written(newest);
}

// A capture ran as long as it was written, by this machine's clock, and at most as long as a segment may be.
void Segments::begin_capture(const OldIndex& index) {
  number_old(index);
  if (stored_.empty() || stored_.back().name.number == 0) return;
  const StoredSegment& last = stored_.back();
  struct stat file {};
  const bool is_there = ::stat(last.path.c_str(), &file) == 0;
  ran_s_ = last.name.running_s +
           (is_there ? std::clamp<std::int64_t>(file.st_mtime - last.name.begin_s, 0, settings_.max_age_s) : 0);
}

// Segments of 0.3 and older have no position. They have the numbers of their index; those without one follow by name.
// If there are newer segments, the oldest of them tells where the last old one ended.
void Segments::number_old(const OldIndex& index) {
  next_ = index.next;
  end_ = index.deleted_rows;
  ran_s_ = index.clock_s;
  std::map<std::uint64_t, OldIndex::Entry> entries = index.entries;
  std::set<std::string> listed;
  for (const auto& [number, entry] : entries) listed.insert(entry.file);
  std::map<std::string, std::size_t> there;
  for (std::size_t i = 0; i < stored_.size() && stored_[i].name.number == 0; ++i) {
    there[stored_[i].file] = i;
    if (!listed.contains(stored_[i].file)) entries[next_++] = {stored_[i].file, 0, index.clock_s};
  }
  if (entries.empty()) return;
  for (auto& [number, entry] : entries) {
    const auto found = there.find(entry.file);
    if (!is_log() || found == there.end()) continue;
    const std::string& path = stored_[found->second].path;
    if (entry.rows == 0) entry.rows = rows_in_file(path);
    if (const auto superseded = SupersededRows::parse(header_value(header_lines(path).value_or(""), "supersedes")))
      for (auto& [earlier, one] : entries)
        if (earlier < number && one.file == superseded->file) one.rows = std::min(one.rows, superseded->row - 1);
  }
  if (is_log() && id_ == kNoLog)
    id_ = sha256_hex(header_lines(stored_.front().path).value_or("")).substr(0, pipeline::kLogIdChars);
  for (const auto& [number, entry] : entries) {
    if (const auto found = there.find(entry.file); found != there.end()) {
      StoredSegment& segment = stored_[found->second];
      segment.number = number;
      segment.rows = entry.rows;
      segment.name.running_s = entry.clock_s;
      if (is_log()) segment.position = {id_, number, end_ + 1, entry.clock_s};
    }
    end_ += entry.rows;
  }
  if (there.size() < stored_.size()) {  // these are the newer ones
    const StoredSegment& newer = stored_[there.size()];
    const std::uint64_t numbers = newer.number - next_;
    const std::uint64_t rows = position(there.size()) ? newer.position->first - 1 - end_ : 0;
    for (std::size_t i = 0; i < there.size(); ++i) {
      stored_[i].number += numbers;
      if (is_log()) stored_[i].position->first += rows;
    }
  }
  std::stable_sort(stored_.begin(), stored_.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
}

// Oldest first. Segments of 0.3 that come later are left alone.
Result<void> Segments::scan() {
  std::map<std::string, StoredSegment> known;
  for (const StoredSegment& segment : stored_) known[segment.file] = segment;
  std::vector<StoredSegment> found;
  std::error_code error;
  for (fs::directory_iterator entry(settings_.directory, error), end; !error && entry != end; entry.increment(error)) {
    const std::string file = entry->path().filename().string();
    const auto name = pipeline::SegmentName::parse(file, name_, extension_);
    if (!name || (has_begun_ && name->number == 0 && !known.contains(file))) continue;
    StoredSegment& segment =
        known.try_emplace(file, StoredSegment{*name, name->number, file, entry->path()}).first->second;
    std::error_code unknown;
    const std::uintmax_t bytes = entry->file_size(unknown);
    segment.bytes = unknown ? 0 : static_cast<std::int64_t>(bytes);
    found.push_back(segment);
  }
  if (error && error != std::errc::no_such_file_or_directory)
    return make_error(settings_.directory, "cannot be listed: " + error.message());
  const auto age = [](const StoredSegment& segment) {
    return std::tuple(segment.name.number, segment.number, segment.name.begin_s, segment.name.same, segment.file);
  };
  std::sort(found.begin(), found.end(), [&](const auto& a, const auto& b) { return age(a) < age(b); });
  stored_ = std::move(found);
  return {};
}

const LogPosition* Segments::position(std::size_t i) {
  StoredSegment& segment = stored_[i];
  if (!segment.position && !segment.is_damaged) {
    const auto header = header_lines(segment.path);
    if (!header) return nullptr;
    segment.position = LogPosition::parse(header_value(*header, "log"));
    segment.is_damaged = !segment.position;
  }
  return segment.position ? &*segment.position : nullptr;
}

std::uint64_t Segments::first(std::size_t i) {
  const LogPosition* const at = position(i);
  return at != nullptr && at->log == id_ ? at->first : 0;
}

std::uint64_t Segments::written(std::size_t i) {
  StoredSegment& segment = stored_[i];
  if (segment.rows == 0) segment.rows = rows_in_file(segment.path);
  return segment.rows;
}

std::uint64_t Segments::rows_of(std::size_t i) {
  if (stored_[i].name.number == 0) return stored_[i].rows;
  if (!is_log() || first(i) == 0) return 0;
  std::size_t next = i + 1;
  while (next < stored_.size() && first(next) == 0) ++next;
  return (next < stored_.size() ? first(next) - 1 : end_) - (first(i) - 1);
}

std::uint64_t Segments::deleted_rows() {
  std::size_t oldest = 0;
  while (oldest < stored_.size() && first(oldest) == 0) ++oldest;
  return oldest < stored_.size() ? first(oldest) - 1 : end_;
}

std::int64_t Segments::running_s() const { return ran_s_ + (policy_.deletes ? policy_.uptime_s() - started_s_ : 0); }

// Running time at its start; of 0.3 and older: at its end.
std::int64_t Segments::started_s(std::size_t i) {
  const StoredSegment& segment = stored_[i];
  return is_log() && first(i) != 0 ? segment.position->running_s : segment.name.running_s;
}

bool Segments::in_place(int descriptor) const {
  struct stat open {
  }, there{};
  return ::fstat(descriptor, &open) == 0 && ::stat(current_.c_str(), &there) == 0 && open.st_dev == there.st_dev &&
         open.st_ino == there.st_ino;
}

std::optional<pipeline::RetentionStatus> Segments::retention() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

void Segments::retain() {
  if (!policy_.deletes) return;
  const std::int64_t now_s = policy_.uptime_s();
  if (now_s < next_look_s_) return;
  next_look_s_ = now_s + scaled_s(kLookEvery_s);
  if (!begin() || !scan()) return;
  pipeline::RetentionStatus status;
  std::optional<NextDeletion> next = plan(status);
  if (next && delete_due(*next)) next = plan(status);
  status.next = std::move(next);
  const std::lock_guard lock(status_mutex_);
  status_ = std::move(status);
}

std::optional<NextDeletion> Segments::plan(pipeline::RetentionStatus& status) {
  status = {};
  status.uptime_s = policy_.uptime_s();
  status.segments = stored_.size();
  status.keep_bytes = settings_.keep_bytes;
  status.keep_s = settings_.keep_days * kDay_s;
  status.deleted_segments = (stored_.empty() ? next_ : stored_.front().number) - 1;
  status.deleted_rows = is_log() ? deleted_rows() : 0;
  for (const StoredSegment& segment : stored_) status.bytes += segment.bytes;
  if (!first_look_s_) first_look_s_ = status.uptime_s, first_bytes_ = status.bytes;
  if (stored_.empty() || stored_.front().path == current_) return std::nullopt;
  const StoredSegment& oldest = stored_.front();
  const std::int64_t since_s = status.uptime_s - *first_look_s_;
  const std::int64_t grown = status.bytes + removed_bytes_ - first_bytes_;
  const double bytes_per_s =
      since_s < scaled_s(kMinGrowth_s) ? 0 : static_cast<double>(grown) / static_cast<double>(since_s);
  const std::int64_t by_bytes_s = wait_for(status.keep_bytes - status.bytes, bytes_per_s);
  const std::int64_t by_age_s = std::max<std::int64_t>(status.keep_s - age_s(0), 0);
  const bool by_bytes = by_bytes_s <= by_age_s;
  return NextDeletion{oldest.file, rows_of(0), oldest.bytes,
                      by_bytes ? NextDeletion::Why::kBytes : NextDeletion::Why::kAge, by_bytes ? by_bytes_s : by_age_s};
}

// Running time since the next segment began.
std::int64_t Segments::age_s(std::size_t i) {
  const bool is_old = stored_[i].name.number == 0;
  std::size_t next = is_old ? i : i + 1;
  while (next < stored_.size() && is_log() && first(next) == 0) ++next;
  return next < stored_.size() ? std::max<std::int64_t>(running_s() - started_s(next), 0) : 0;
}

// A deletion that is due waits for notice_s, so that it is announced. Further ones that are due then do not wait again.
// Returns true if it deleted the segment.
bool Segments::delete_due(NextDeletion& next) {
  const std::int64_t now_s = policy_.uptime_s();
  if (next.in_s > 0) {
    due_since_s_.reset();
    next_look_s_ = std::min(next_look_s_, now_s + next.in_s);
    next.in_s += policy_.notice_s;
    return false;
  }
  const std::int64_t left_s = policy_.notice_s - (now_s - *(due_since_s_ = due_since_s_.value_or(now_s)));
  next.in_s = std::max<std::int64_t>(left_s, 0);
  if (left_s <= 0 && !remove(0, next.why)) return false;
  next_look_s_ = now_s + next.in_s;
  return left_s <= 0;
}

bool Segments::remove(std::size_t i, NextDeletion::Why why) {
  const StoredSegment segment = stored_[i];
  // Another process writes it, for example a second prismd: this one locks only the newest segment. A link is only a
  // name.
  std::error_code error;
  if (!fs::is_symlink(segment.path, error) && is_locked(segment.path)) return false;
  const std::uint64_t rows = rows_of(i);
  fs::remove(segment.path, error);
  if (error) {
    if (std::exchange(kept_, segment.file) != segment.file)
      report(pipeline::Severity::kWarning, "retention",
             fmt::format("{}: {}: cannot be deleted: {}", section(), segment.path, error.message()));
    return false;
  }
  sync_directory(settings_.directory);
  removed_bytes_ += segment.bytes;
  stored_.erase(stored_.begin() + static_cast<std::ptrdiff_t>(i));
  const bool has_old =
      std::any_of(stored_.begin(), stored_.end(), [](const auto& one) { return one.name.number == 0; });
  if (segment.name.number == 0 && !has_old && !stored_.empty())
    fs::remove(index_path(), error);  // newer ones need none
  report(
      pipeline::Severity::kInfo, "retention",
      fmt::format("{}: deleted {} ({}{:.1f} MiB): {}", section(), segment.file,
                  rows > 0 ? counted(rows, "row") + ", " : "", static_cast<double>(segment.bytes) / kMiB, reason(why)));
  return true;
}

// The limit that is exceeded.
std::string Segments::reason(NextDeletion::Why why) const {
  using Why = NextDeletion::Why;
  if (why == Why::kDiskFull) return fmt::format("the disk is full ({}/when_full)", section());
  return why == Why::kBytes ? fmt::format("more than {:.1f} MiB ({}/keep_mib)",
                                          static_cast<double>(settings_.keep_bytes) / kMiB, section())
                            : fmt::format("written more than {} ago, as prismd measured ({}/keep_days)",
                                          counted(static_cast<std::uint64_t>(settings_.keep_days), "day"), section());
}

bool Segments::make_room() {
  if (!settings_.delete_when_full || !policy_.deletes || !begin()) return false;
  for (std::size_t i = 0; i < stored_.size(); ++i)
    if (stored_[i].path != current_ && remove(i, NextDeletion::Why::kDiskFull)) return true;
  return false;
}

}  // namespace prism::log
