// SPDX-License-Identifier: MIT
#include "daemon/row_writers.hpp"

#include <utility>

namespace prism::daemon {

ThreadedRowWriter::ThreadedRowWriter(const pipeline::Setup& setup, DiskThread& disk,
                                     std::function<void(const std::string&)> tell)
    : disk_(disk),
      counters_(std::make_shared<LogCounters>()),
      log_(std::make_shared<RowLog>(*setup.config.log, setup.config.name, pipeline::log_metadata(setup), *counters_,
                                    std::move(tell))) {}

ThreadedRowWriter::~ThreadedRowWriter() {
  // The last owner closes the segment on the disk thread, after the rows before it.
  disk_.post(0, [log = std::move(log_), counters = counters_]() mutable { log.reset(); });
}

void ThreadedRowWriter::append(const compensation::CompensatedWindow& row) {
  if (disk_.post(sizeof row, [log = log_, row] { log->append(row); })) {
    unsynced_ = true;
  } else {
    ++counters_->dropped;
  }
}

void ThreadedRowWriter::sync() {
  if (std::exchange(unsynced_, false)) disk_.post(0, [log = log_] { log->sync(); });
}

void ThreadedRowWriter::set_metadata(const std::string& metadata) {
  disk_.post(0, [log = log_, metadata] { log->set_metadata(metadata); });
}

DirectRowWriter::DirectRowWriter(const pipeline::Setup& setup)
    : log_(*setup.config.log, setup.config.name, pipeline::log_metadata(setup), counters_,
           [this](const std::string& what) {
             if (first_fault_.empty()) first_fault_ = what;
           }) {}

}  // namespace prism::daemon
