// SPDX-License-Identifier: MIT
// Writes every byte of the line with its arrival time to capture segments. The live path never waits.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/disk_thread.hpp"
#include "config/config.hpp"
#include "daemon/log/segments.hpp"
#include "daemon/pipeline/interfaces.hpp"
#include "drivers/capture_file.hpp"

namespace prism::log {

/// Collects chunks and passes them to the disk thread each second (of arrival time) or 256 KiB, whichever comes first.
/// If the queue is full, the batch is dropped and counted, and the capture gets a new-session mark: a replay restarts
/// there, as the daemon does after a loss. After a disk error, data since the last successful sync are written again to
/// a new segment; the old segment is truncated at that sync.
class CaptureLog : public pipeline::CaptureSink {
 public:
  static constexpr std::size_t kMostHeld = 16 << 20;

  /// `problems` must outlive the disk thread. `most_held`: max. bytes kept in memory
  /// while the disk fails; above it, the oldest batches are dropped.
  CaptureLog(config::LogSegmentSettings settings, std::string name, DiskThread& disk, Problems& problems,
             std::size_t most_held = kMostHeld, SegmentPolicy policy = {});
  ~CaptureLog() override;

  void record(drivers::CaptureEvent event, std::span<const std::uint8_t> bytes, std::int64_t time_ns) override;
  void flush() override;

  std::uint64_t dropped_bytes() const override;
  std::optional<pipeline::RetentionStatus> retention() const override;

 private:
  class Writer;
  struct Chunk {
    std::int64_t time_ns;
    std::size_t end;  // offset in bytes
    drivers::CaptureEvent event;
  };
  struct Batch {
    std::vector<Chunk> chunks;
    std::vector<std::uint8_t> bytes;
    bool after_loss = false;  // the batch before was dropped
  };
  using BatchPtr = std::shared_ptr<Batch>;

  DiskThread& disk_;
  std::shared_ptr<Writer> writer_;
  Batch batch_;
  bool lost_ = false;
};

}  // namespace prism::log
