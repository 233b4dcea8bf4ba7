// SPDX-License-Identifier: MIT
#include "daemon/capture_log.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <utility>

#include "compensation/averager.hpp"
#include "daemon/segments.hpp"
#include "drivers/capture_file.hpp"

namespace prism::daemon {
namespace {

constexpr std::size_t kBatchBytes = 256 << 10;
constexpr std::int64_t kPacketOverhead = 28;  // pcap packet header and the record's own

}  // namespace

// The disk thread's half: it alone touches the files.
class CaptureLog::Writer {
 public:
  Writer(config::SegmentSettings settings, std::string name, DiskFault::Tell tell)
      : tell_(tell),
        fault_("capture", "bytes", dropped_, std::move(tell)),
        segments_(std::move(settings), std::move(name), ".pcap") {}

  void write(Batch& batch) {
    lost_ = lost_ || batch.after_loss;
    for (const Chunk& chunk : batch.chunks) {
      const std::span<const std::uint8_t> bytes(batch.bytes.data() + batch.done, chunk.end - batch.done);
      if (!put(chunk, bytes)) fault_.drop(bytes.size());
      batch.done = chunk.end;
    }
    if (!file_ || !keep(file_->flush(true))) return;
    if (!segments_.in_place(file_->descriptor())) {
      tell_(fmt::format("capture: {}: was deleted or moved away; a new segment begins", file_->path()));
      file_.reset();
    }
    fault_.synced();
  }

  // From any thread.
  void lose(std::size_t bytes, const std::string& why) { fault_.lose(bytes, why); }

  void abandon(const Batch& batch, const std::string& why) {
    lose(batch.bytes.size() - batch.done, why);
    lost_ = true;
  }

  std::uint64_t dropped() const { return dropped_; }

 private:
  bool put(const Chunk& chunk, std::span<const std::uint8_t> bytes) {
    const std::int64_t second = chunk.time_ns / compensation::kNanosecondsPerSecond;
    const auto size = static_cast<std::int64_t>(bytes.size()) + kPacketOverhead;
    const auto before = file_ ? static_cast<std::int64_t>(file_->bytes_written()) : 0;
    if (segments_.begins_new(second, before + size)) file_.reset();
    if (!file_ && !open(second)) return false;
    if (std::exchange(lost_, false) && !chunk.mark && !keep(file_->opened(chunk.time_ns))) return false;
    return keep(chunk.mark ? file_->opened(chunk.time_ns) : file_->data(chunk.time_ns, bytes));
  }

  bool open(std::int64_t second) {
    Result<NewSegment> made = segments_.make(second);
    if (!made) return keep(tl::unexpected<Error>(made.error()));
    const auto make_room = [this](int error) { return disk_is_full(error) && segments_.make_room(); };
    Result<drivers::CaptureWriter> file = drivers::CaptureWriter::adopt(made->descriptor, made->path, make_room);
    if (!file) {
      ::unlink(made->path.c_str());  // a disk that is full would get an empty file a second
      return keep(tl::unexpected<Error>(file.error()));
    }
    file_.emplace(std::move(*file));
    return true;
  }

  // A fault ends the segment: what stands in it is good; the next chunk tries a new one.
  bool keep(const Result<void>& result) {
    if (result) return true;
    file_.reset();
    lost_ = true;
    fault_.begin(result.error().text());
    return false;
  }

  std::atomic<std::uint64_t> dropped_{0};
  DiskFault::Tell tell_;
  DiskFault fault_;
  Segments segments_;
  std::optional<drivers::CaptureWriter> file_;
  bool lost_ = false;  // what comes next is a session of its own
};

CaptureLog::CaptureLog(config::SegmentSettings settings, std::string name, DiskThread& disk, DiskFault::Tell tell)
    : disk_(disk), writer_(std::make_shared<Writer>(std::move(settings), std::move(name), std::move(tell))) {}

CaptureLog::~CaptureLog() {
  flush();
  disk_.post(0, [writer = std::move(writer_)]() mutable { writer.reset(); });
}

std::uint64_t CaptureLog::dropped_bytes() const { return writer_->dropped(); }

void CaptureLog::mark_opened(std::int64_t time_ns) { batch_.chunks.push_back({time_ns, batch_.bytes.size(), true}); }

void CaptureLog::data(std::span<const std::uint8_t> bytes, std::int64_t time_ns) {
  batch_.bytes.insert(batch_.bytes.end(), bytes.begin(), bytes.end());
  batch_.chunks.push_back({time_ns, batch_.bytes.size(), false});
  const bool old = time_ns - batch_.chunks.front().time_ns >= compensation::kNanosecondsPerSecond;
  if (old || batch_.bytes.size() >= kBatchBytes) flush();
}

void CaptureLog::flush() {
  if (batch_.chunks.empty()) return;
  batch_.after_loss = lost_;
  auto batch = std::make_shared<Batch>(std::exchange(batch_, {}));
  lost_ = !disk_.post(
      batch->bytes.size() + 1, [writer = writer_, batch] { writer->write(*batch); },
      [writer = writer_, batch](const std::string& why) { writer->abandon(*batch, why); });
  if (lost_) writer_->lose(batch->bytes.size(), "the disk cannot keep up with the line");
}

}  // namespace prism::daemon
