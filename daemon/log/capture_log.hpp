// SPDX-License-Identifier: MIT
// Keeps every byte of the line with its arrival time, in capture segments, without the live path ever waiting.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/disk_thread.hpp"
#include "config/config.hpp"
#include "daemon/log/disk_fault.hpp"
#include "daemon/pipeline/log_writers.hpp"

namespace prism::log {

/// Gathers chunks and hands them to the disk thread each second (of arrival time) or 256 KiB, whichever comes first.
/// A batch that the queue cannot take is dropped and counted, and the capture says so with a new-session mark: a replay
/// then begins anew there, as the daemon would after a loss. After a fault of the disk what no good sync has seen is
/// written again, into a new segment; the old one ends where its last good sync was.
class CaptureLog : public pipeline::CaptureSink {
 public:
  /// `tell` is called on any thread, once per fault and once when it is over.
  /// `most_held`: bytes that wait in memory while the disk refuses them; what is more is dropped, the oldest first.
  CaptureLog(config::SegmentSettings settings, std::string name, DiskThread& disk, DiskFault::Tell tell,
             std::size_t most_held = 16 << 20);
  ~CaptureLog() override;

  void mark_opened(std::int64_t time_ns) override;
  void data(std::span<const std::uint8_t> bytes, std::int64_t time_ns) override;
  void flush() override;

  std::uint64_t dropped_bytes() const override;

 private:
  class Writer;
  struct Chunk {
    std::int64_t time_ns;
    std::size_t end;  // in bytes; a chunk that ends where it begins is a mark
    bool mark;
  };
  struct Batch {
    std::vector<Chunk> chunks;
    std::vector<std::uint8_t> bytes;
    bool after_loss = false;  // a batch before it was dropped
  };
  using BatchPtr = std::shared_ptr<Batch>;

  DiskThread& disk_;
  std::shared_ptr<Writer> writer_;
  Batch batch_;
  bool lost_ = false;
};

}  // namespace prism::log
