// SPDX-License-Identifier: MIT
#include "daemon/log/capture_log.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <deque>
#include <utility>

#include "compensation/second_averager.hpp"

namespace prism::log {
namespace {

constexpr std::size_t kBatchBytes = 256 << 10;
constexpr std::int64_t kPacketOverhead = 28;  // pcap packet header and the record's header

}  // namespace

// The part on the disk thread; only it uses the files. Keeps each batch until it is synced. After a failed write or
// sync it truncates the file at the last successful sync and writes the batches again to a new segment.
class CaptureLog::Writer {
 public:
  Writer(config::LogSegmentSettings settings, std::string name, std::size_t most_held, Problems& problems,
         SegmentPolicy policy)
      : most_held_(most_held),
        fault_("capture", name, "bytes", dropped_, problems),
        segments_(std::move(settings), std::move(name), ".pcap", std::move(policy)) {}

  ~Writer() {
    if (!held_.empty()) try_held();  // last attempt, even during a pause
  }

  void write(BatchPtr batch) {
    batch->after_loss = std::exchange(lost_, false) || batch->after_loss;
    held_bytes_ += batch->bytes.size();
    held_.push_back(std::move(batch));
    if (pause_.over()) try_held();
    while (held_bytes_ > most_held_) drop_oldest();
  }

  // From any thread.
  void lose(std::size_t bytes, const std::string& why) { fault_.lose(bytes, why); }

  // Called if write() threw.
  void abandon(const BatchPtr& batch, const std::string& why) {
    if (!held_.empty() && held_.back() == batch) {
      held_bytes_ -= batch->bytes.size();
      held_.pop_back();
    }
    lose(batch->bytes.size(), why);
    lost_ = true;
  }

  std::uint64_t dropped() const { return dropped_; }
  std::optional<pipeline::RetentionStatus> retention() const { return segments_.retention(); }

 private:
  void try_held() {
    if (!put_held()) return distrust();
    if (file_ && !segments_.in_place(file_->descriptor())) {
      warn(fmt::format("capture: {}: was deleted or moved away; starting a new segment", file_->path()));
      file_.reset();
      if (!put_held()) return distrust();
    }
    held_.clear();
    held_bytes_ = 0;
    pause_.end();
    fault_.synced();
    segments_.retain();
  }

  bool put_held() {
    for (const BatchPtr& batch : held_) {
      bool after_loss = batch->after_loss;
      std::size_t done = 0;
      for (const Chunk& chunk : batch->chunks) {
        const std::span<const std::uint8_t> bytes(batch->bytes.data() + done, chunk.end - done);
        if (!put(chunk, bytes, std::exchange(after_loss, false))) return false;
        done = chunk.end;
      }
    }
    return sync();
  }

  bool put(const Chunk& chunk, std::span<const std::uint8_t> bytes, bool after_loss) {
    const std::int64_t second = chunk.time_ns / compensation::kNanosecondsPerSecond;
    const auto size = static_cast<std::int64_t>(bytes.size()) + kPacketOverhead;
    const auto before = file_ ? static_cast<std::int64_t>(file_->bytes_written()) : 0;
    if (segments_.begins_new(second, before + size)) {
      if (!sync()) return false;
      file_.reset();
    }
    if (!file_ && !open(second)) return false;
    const bool mark = chunk.event == drivers::CaptureEvent::kOpened;
    if (after_loss && !mark && !good(file_->opened(chunk.time_ns))) return false;
    return good(file_->append(chunk.time_ns, chunk.event, bytes));
  }

  bool open(std::int64_t second) {
    Result<NewSegment> made = segments_.make(second);
    if (!made) return good(tl::unexpected<Error>(made.error()));
    const auto make_room = [this](int error) { return disk_is_full(error) && segments_.make_room(); };
    Result<drivers::CaptureWriter> file = drivers::CaptureWriter::adopt(made->descriptor, made->path, make_room);
    if (!file) {
      segments_.unmake();  // else a full disk gets an empty file every second
      return good(tl::unexpected<Error>(file.error()));
    }
    file_.emplace(std::move(*file));
    synced_bytes_ = 0;
    return true;
  }

  bool sync() {
    if (!file_) return true;
    if (!good(file_->flush(true))) return false;
    synced_bytes_ = file_->bytes_written();
    return true;
  }

  void warn(const std::string& text) { segments_.report(pipeline::Severity::kWarning, "disk", text); }

  bool good(const Result<void>& result) {
    if (!result) fault_.begin(result.error().text());
    return result.has_value();
  }

  // After a failed sync the kernel may mark pages as clean that were never written.
  void distrust() {
    pause_.begin();
    if (!file_) return;
    const std::string path = file_->path();
    file_.reset();
    if (synced_bytes_ == 0) {
      segments_.unmake();
    } else if (::truncate(path.c_str(), static_cast<off_t>(synced_bytes_)) != 0) {
      warn(fmt::format("capture: {}: cannot truncate at byte {}: {}; the next segment repeats the bytes after it", path,
                       synced_bytes_, std::strerror(errno)));
    }
  }

  void drop_oldest() {
    fault_.drop(held_.front()->bytes.size());
    held_bytes_ -= held_.front()->bytes.size();
    held_.pop_front();
    (held_.empty() ? lost_ : held_.front()->after_loss) = true;
  }

  const std::size_t most_held_;
  std::atomic<std::uint64_t> dropped_{0};
  WriteFault fault_;
  ExponentialBackoff pause_;
  Segments segments_;
  std::optional<drivers::CaptureWriter> file_;
  std::uint64_t synced_bytes_ = 0;  // of file_
  std::deque<BatchPtr> held_;
  std::size_t held_bytes_ = 0;
  bool lost_ = false;  // the next data begin a new session
};

CaptureLog::CaptureLog(config::LogSegmentSettings settings, std::string name, DiskThread& disk, Problems& problems,
                       std::size_t most_held, SegmentPolicy policy)
    : disk_(disk),
      writer_(std::make_shared<Writer>(std::move(settings), std::move(name), most_held, problems, std::move(policy))) {}

CaptureLog::~CaptureLog() {
  flush();
  disk_.post(0, [writer = std::move(writer_)]() mutable { writer.reset(); });
}

std::uint64_t CaptureLog::dropped_bytes() const { return writer_->dropped(); }

std::optional<pipeline::RetentionStatus> CaptureLog::retention() const { return writer_->retention(); }

void CaptureLog::record(drivers::CaptureEvent event, std::span<const std::uint8_t> bytes, std::int64_t time_ns) {
  batch_.bytes.insert(batch_.bytes.end(), bytes.begin(), bytes.end());
  batch_.chunks.push_back({time_ns, batch_.bytes.size(), event});
  const bool old = time_ns - batch_.chunks.front().time_ns >= compensation::kNanosecondsPerSecond;
  if (old || batch_.bytes.size() >= kBatchBytes) flush();
}

void CaptureLog::flush() {
  if (batch_.chunks.empty()) return;
  batch_.after_loss = lost_;
  auto batch = std::make_shared<Batch>(std::exchange(batch_, {}));
  lost_ = !disk_.post(
      batch->bytes.size() + 1, [writer = writer_, batch] { writer->write(batch); },
      [writer = writer_, batch](const std::string& why) { writer->abandon(batch, why); });
  if (lost_) writer_->lose(batch->bytes.size(), "the disk cannot keep up with the line");
}

}  // namespace prism::log
