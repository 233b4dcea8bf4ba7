// SPDX-License-Identifier: MIT
// Keeps every byte of the line with its arrival time, in capture segments, without the live path ever waiting.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/disk_thread.hpp"
#include "daemon/segments.hpp"

namespace prism::daemon {

/// Gathers chunks and hands them to the disk thread each second (of arrival time) or 256 KiB, whichever comes first.
/// A batch that the queue cannot take is dropped and counted, and the capture says so with a new-session mark: a replay
/// then begins anew there, as the daemon would after a loss.
class Recorder {
 public:
  /// `tell` is called on the disk thread, once per fault.
  Recorder(config::SegmentSettings settings, std::string name, DiskThread& disk,
           std::function<void(const std::string&)> tell);
  ~Recorder();

  void mark_opened(std::int64_t time_ns);
  void data(std::span<const std::uint8_t> bytes, std::int64_t time_ns);
  void flush();

  std::uint64_t dropped_bytes() const { return dropped_->load(); }

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
  };

  DiskThread& disk_;
  std::shared_ptr<std::atomic<std::uint64_t>> dropped_;
  std::shared_ptr<Writer> writer_;
  Batch batch_;
};

}  // namespace prism::daemon
