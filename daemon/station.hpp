// SPDX-License-Identifier: MIT
// One gyro's station: the place where the rooms meet. Rows go to log, clients and statistics; questions are answered.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "compensation/block_stability.hpp"
#include "daemon/event_log.hpp"
#include "daemon/pipeline.hpp"
#include "daemon/publisher.hpp"
#include "daemon/recorder.hpp"
#include "daemon/row_log.hpp"
#include "daemon/setup.hpp"

namespace prism::daemon {

enum class LineState { kNone, kConnecting, kReceiving, kSilent, kReplaying, kEnded };

/// Where rows are written: on a thread of its own (live), or right here (a replay, which may wait).
class RowWriter {
 public:
  virtual ~RowWriter() = default;
  virtual void append(const compensation::CompensatedWindow& row) = 0;
  /// Puts what was appended on the disk; called once a second of real time, however fast the data's time runs.
  virtual void sync() = 0;
  virtual void set_metadata(const std::string& metadata) = 0;
  virtual const LogCounters& counters() const = 0;
};

/// Not thread-safe: lives on the live path's thread.
class Station : public RowSink {
 public:
  /// `rows` may be null: nothing is logged.
  Station(Setup setup, std::unique_ptr<RowWriter> rows);

  // The line's side.
  void begin_session(std::int64_t now_ns);
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  void expire(std::int64_t now_ns);
  void finish();
  /// Once a second: what was written goes to the disk.
  void sync();
  void set_state(LineState state, const std::string& detail = {});
  /// What the hardware counted so far; nothing where it does not count. New errors are an event.
  void line_hardware(const std::optional<drivers::LineCounters>& counters);
  /// What the line could not be given when it was opened.
  void line_notes(std::vector<std::string> notes) { line_notes_ = std::move(notes); }
  void tell(Severity severity, const std::string& kind, const std::string& text);

  /// Takes over a new setup, all of it or none: another frame description, another axis or clock begin a new pipeline;
  /// a changed socket is refused, it needs a restart. True: the line has to be opened anew.
  Result<bool> reconfigure(Setup setup);

  // The clients' side: answers as JSON values, finite numbers and texts only.
  nlohmann::ordered_json status() const;
  nlohmann::ordered_json bias() const;
  nlohmann::ordered_json stability() const;
  nlohmann::ordered_json line() const;
  nlohmann::ordered_json model() const;
  nlohmann::ordered_json config() const;
  nlohmann::ordered_json history(std::size_t seconds) const;
  nlohmann::ordered_json events(std::size_t count) const;

  const Setup& setup() const { return setup_; }
  LineState state() const { return state_; }
  /// One line for systemd's STATUS= and for people.
  std::string summary() const;
  std::uint64_t bytes_received() const { return pipeline_->decoder().counters().bytes + bytes_before_; }
  const Pipeline& pipeline() const { return *pipeline_; }
  const compensation::BlockStability& block_stability() const { return stability_; }
  std::uint64_t frames() const { return frames_before_ + pipeline_->decoder().counters().frames; }

  Publisher publisher;
  /// Set where the line's bytes are to be kept.
  std::unique_ptr<Recorder> recorder;

 private:
  void sample(const compensation::Compensated& row) override;
  void window(const compensation::CompensatedWindow& row) override;
  void watch_quality(const compensation::CompensatedWindow& row);

  Setup setup_;
  std::unique_ptr<RowWriter> rows_;
  std::unique_ptr<Pipeline> pipeline_;
  EventLog events_;
  compensation::BlockStability stability_;
  std::deque<compensation::CompensatedWindow> history_;
  compensation::Compensated last_;
  bool has_last_ = false;
  LineState state_ = LineState::kNone;
  std::string state_detail_;
  std::int64_t state_since_ns_ = 0, started_ns_ = 0;
  std::uint64_t sessions_ = 0, bytes_before_ = 0, frames_before_ = 0;
  std::uint32_t last_quality_ = compensation::kNoModel;
  std::optional<drivers::LineCounters> hardware_;
  std::vector<std::string> line_notes_;
};

/// This machine's UTC, ns since 1970.
std::int64_t host_time_ns();

}  // namespace prism::daemon
