// SPDX-License-Identifier: MIT
// The two ways a row reaches the log: over the disk thread (live), or directly (replay).
#pragma once

#include <memory>
#include <string>

#include "daemon/disk_thread.hpp"
#include "daemon/pipeline/setup.hpp"
#include "daemon/row_log.hpp"

namespace prism::daemon {

/// Never waits: rows and syncs are posted. Rows that the queue cannot take are dropped and counted.
class ThreadedRowWriter : public RowWriter {
 public:
  /// `tell` is called on the disk thread.
  ThreadedRowWriter(const pipeline::Setup& setup, DiskThread& disk, std::function<void(const std::string&)> tell);
  ~ThreadedRowWriter() override;

  void append(const compensation::CompensatedWindow& row) override;
  void sync() override;
  void set_metadata(const std::string& metadata) override;
  const LogCounters& counters() const override { return *counters_; }

 private:
  DiskThread& disk_;
  std::shared_ptr<LogCounters> counters_;
  std::shared_ptr<RowLog> log_;
  bool unsynced_ = false;
};

/// Waits for the disk: a replay loses nothing. The first fault is kept.
class DirectRowWriter : public RowWriter {
 public:
  explicit DirectRowWriter(const pipeline::Setup& setup);

  void append(const compensation::CompensatedWindow& row) override { log_.append(row); }
  void sync() override {}  // a replay can be run again; the segment is synced when it closes
  void set_metadata(const std::string& metadata) override { log_.set_metadata(metadata); }
  const LogCounters& counters() const override { return counters_; }
  const std::string& first_fault() const { return first_fault_; }

 private:
  LogCounters counters_;
  std::string first_fault_;
  RowLog log_;
};

}  // namespace prism::daemon
