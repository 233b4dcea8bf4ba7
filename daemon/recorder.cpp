// SPDX-License-Identifier: MIT
#include "daemon/recorder.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "compensation/averager.hpp"
#include "drivers/capture_file.hpp"

namespace prism::daemon {
namespace {

constexpr std::size_t kBatchBytes = 256 << 10;
constexpr std::int64_t kPacketOverhead = 28;  // pcap packet header and the record's own

}  // namespace

// The disk thread's half: it alone touches the files.
class Recorder::Writer {
 public:
  Writer(config::SegmentSettings settings, std::string name, std::shared_ptr<std::atomic<std::uint64_t>> dropped,
         std::function<void(const std::string&)> tell)
      : settings_(std::move(settings)),
        name_(std::move(name)),
        dropped_(std::move(dropped)),
        tell_(std::move(tell)),
        clock_(settings_) {}

  void write(const Batch& batch) {
    std::size_t begin = 0;
    for (const Chunk& chunk : batch.chunks) {
      const std::span<const std::uint8_t> bytes(batch.bytes.data() + begin, chunk.end - begin);
      begin = chunk.end;
      if (!put(chunk, bytes)) *dropped_ += bytes.size();
    }
    if (file_) keep(file_->flush(true));
  }

  // The queue was full: the disk is slower than the line.
  void overrun(std::size_t bytes) {
    *dropped_ += bytes;
    lost_ = true;
    tell_(fmt::format("capture: the disk cannot keep up with the line; {} bytes dropped so far", dropped_->load()));
  }

 private:
  bool put(const Chunk& chunk, std::span<const std::uint8_t> bytes) {
    const std::int64_t second = chunk.time_ns / compensation::kNanosecondsPerSecond;
    const auto size = static_cast<std::int64_t>(bytes.size()) + kPacketOverhead;
    const auto before = file_ ? static_cast<std::int64_t>(file_->bytes_written()) : 0;
    if (clock_.begins_new(second, before + size)) file_.reset();
    if (!file_ && !open(second)) return false;
    if (std::exchange(lost_, false) && !chunk.mark) keep(file_->opened(chunk.time_ns));
    return file_ && keep(chunk.mark ? file_->opened(chunk.time_ns) : file_->data(chunk.time_ns, bytes));
  }

  bool open(std::int64_t second) {
    if (auto made = make_segment_folder(settings_); !made) return keep(std::move(made));
    const std::string path = segment_path(settings_, name_, ".pcap", second);
    Result<drivers::CaptureWriter> file = drivers::CaptureWriter::open(path);
    if (!file) return keep(tl::unexpected<Error>(file.error()));
    file_.emplace(std::move(*file));
    delete_old_segments(settings_, name_, ".pcap", path, second);
    return true;
  }

  // A fault ends the segment: what stands in it is good; the next chunk tries a new one. Told once until it works
  // again.
  bool keep(Result<void> result) {
    if (result) {
      faulty_ = false;
      return true;
    }
    file_.reset();
    lost_ = true;
    if (!std::exchange(faulty_, true))
      tell_("capture: " + result.error().text() + "; bytes are dropped and counted until it works again");
    return false;
  }

  config::SegmentSettings settings_;
  std::string name_;
  std::shared_ptr<std::atomic<std::uint64_t>> dropped_;
  std::function<void(const std::string&)> tell_;
  SegmentClock clock_;
  std::optional<drivers::CaptureWriter> file_;
  bool faulty_ = false, lost_ = false;
};

Recorder::Recorder(config::SegmentSettings settings, std::string name, DiskThread& disk,
                   std::function<void(const std::string&)> tell)
    : disk_(disk),
      dropped_(std::make_shared<std::atomic<std::uint64_t>>(0)),
      writer_(std::make_shared<Writer>(std::move(settings), std::move(name), dropped_, std::move(tell))) {}

Recorder::~Recorder() {
  flush();
  disk_.post(0, [writer = std::move(writer_)]() mutable { writer.reset(); });
}

void Recorder::mark_opened(std::int64_t time_ns) { batch_.chunks.push_back({time_ns, batch_.bytes.size(), true}); }

void Recorder::data(std::span<const std::uint8_t> bytes, std::int64_t time_ns) {
  batch_.bytes.insert(batch_.bytes.end(), bytes.begin(), bytes.end());
  batch_.chunks.push_back({time_ns, batch_.bytes.size(), false});
  const bool old = time_ns - batch_.chunks.front().time_ns >= compensation::kNanosecondsPerSecond;
  if (old || batch_.bytes.size() >= kBatchBytes) flush();
}

void Recorder::flush() {
  if (batch_.chunks.empty()) return;
  auto batch = std::make_shared<Batch>(std::exchange(batch_, {}));
  const std::size_t bytes = batch->bytes.size();
  const bool taken = disk_.post(bytes + 1, [writer = writer_, batch] { writer->write(*batch); });
  if (taken) return;
  disk_.post(0, [writer = writer_, bytes] { writer->overrun(bytes); });
}

}  // namespace prism::daemon
