// SPDX-License-Identifier: MIT
// One device: passes the bytes of its lines to the pipeline; logs, counts and publishes the rows.
#pragma once

#include <algorithm>
#include <boost/circular_buffer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/problems.hpp"
#include "compensation/at_rest.hpp"
#include "compensation/block_stability.hpp"
#include "compensation/sample.hpp"
#include "daemon/pipeline/corrected_frames.hpp"
#include "daemon/pipeline/interfaces.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/statements.hpp"
#include "daemon/pipeline/stream_watch.hpp"
#include "drivers/commands.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::pipeline {

enum class LineState { kNone, kConnecting, kReceiving, kSilent, kReplaying, kEnded };

/// A line: its state, independent of its data, and its capture.
struct LineStatus {
  LineState state = LineState::kNone;
  std::string detail;                               ///< reason, human-readable
  std::int64_t since_ns = 0;                        ///< host time of the last change of state
  std::int64_t last_data_ns = 0;                    ///< arrival of the last bytes; 0: none since the start
  std::optional<transport::LineCounters> hardware;  ///< nullopt if the driver does not count
  std::vector<std::string> notes;                   ///< settings that the device did not accept at open
  drivers::PollCounters polls;                      ///< since the start
  std::unique_ptr<CaptureSink> capture;             ///< null: none is configured

  /// True if the line delivers rows, so that the latest values are current.
  bool delivers() const { return state == LineState::kReceiving || state == LineState::kReplaying; }
  bool replays() const { return state == LineState::kReplaying || state == LineState::kEnded; }
  void set(LineState now, const std::string& why, std::int64_t now_ns) {
    if (now != state) since_ns = now_ns;
    state = now;
    detail = why;
  }
};

/// The line of an output; without `hardware` to `capture`.
struct OutputStatus : LineStatus {
  std::uint64_t bytes = 0;                          ///< written since the start
  std::uint64_t lost_bytes = 0;                     ///< not written: the line was closed, or its reader too slow
  boost::circular_buffer<float> latencies_s{4096};  ///< of the latest writes, from the read of a frame's last byte

  /// `share` 0 to 1; kUnknown: no write yet.
  double latency_s(double share) const {
    if (latencies_s.empty()) return kUnknown;
    std::vector<float> sorted(latencies_s.begin(), latencies_s.end());
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  }
};

/// One input axis: its log, latest values, stability and reported quality.
struct AxisRecord {
  /// Consecutive plausible seconds after which a sensor's fault is over.
  static constexpr int kCalmS = 30;

  std::string name;                ///< as in the frame description
  std::string prefix;              ///< of texts about the axis: "x: "; empty for a device with one axis
  std::unique_ptr<RowWriter> log;  ///< null: none is configured
  compensation::BlockStability stability;
  compensation::AtRest at_rest;
  std::optional<ModelVerdict> verdict;        ///< the last one of prismcal monitor on the model in use
  std::optional<Offset> offset;               ///< in use
  std::optional<std::int64_t> offset_ends_s;  ///< uptime at which it expires, also if the host's clock is set back
  std::uint64_t seconds = 0;                  ///< rows since the start
  std::uint64_t windows = 0;                  ///< of these: with a full window
  std::uint64_t corrected = 0;                ///< of these: with a corrected rate
  /// Of the current session: none before its first frame or full second, and after its end.
  std::optional<compensation::Compensated> last_sample;
  std::optional<compensation::CompensatedWindow> last_window;
  SensorChanges changes;
  std::uint32_t last_quality = compensation::kNoModel;  ///< as reported

  /// `block_s`: length of the stability blocks.
  void keep(const compensation::CompensatedWindow& row, std::int64_t session_ns, int block_s);
  /// Reports a change of quality, values that became implausible or plausible again, and changes of sensors.
  void watch(const compensation::CompensatedWindow& row, const Tell& tell, Problems& problems);

 private:
  void watch_rest(Problems& problems);
};

/// Number of the gyro's line. The lines of Setup::sensor_lines follow in order.
inline constexpr std::size_t kGyroLine = 0;

/// Keys of problems of the stream.
inline constexpr const char *kNoRate = "no_rate", *kClocksDiffer = "rate", *kDiskBlocked = "disk";

/// Not thread-safe. Rows go to the log, then to `publish`; events about them go to `tell` afterwards.
class Device {
 public:
  using Publish = std::function<void(const Rows&)>;
  /// Takes the bytes that leave on an output because of one call: whole frames, and bytes between frames.
  using Send = std::function<void(std::size_t output, std::span<const std::uint8_t> bytes)>;
  using OffsetEnded = std::function<void(std::size_t axis, const Offset& ended)>;

  /// `logs`: one per axis, or empty (no log). `captures`: one per line, or empty. `problems` must outlive this.
  Device(Setup setup, std::vector<std::unique_ptr<RowWriter>> logs, std::vector<std::unique_ptr<CaptureSink>> captures,
         Publish publish, Tell tell, Problems& problems);

  /// Corrected frames go to `send`, before their rows go anywhere. Without it they are dropped, and the rows are the
  /// same.
  void send_by(Send send) { send_ = std::move(send); }
  /// The line was opened (again) at now_ns.
  void begin_session(std::size_t line, std::int64_t now_ns);
  /// Arrival times never decrease over all lines, except when the host clock was set.
  void feed(std::size_t line, std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// The host clock was set from before_ns to now_ns. Begins a session on every line.
  void clock_set(std::int64_t before_ns, std::int64_t now_ns);
  /// No data arrived on the line until now_ns.
  void expire(std::size_t line, std::int64_t now_ns);
  /// The line was lost, or the run ends.
  void finish(std::size_t line);
  /// Must be the last call: closes the segments.
  void close();
  /// Syncs the logs. Call once a second.
  void sync();

  /// The verdicts of prismcal monitor, by axis. Ignores those on another model than that in use.
  void take_verdicts(const ModelVerdicts& verdicts);
  /// Sets the offset of an axis, or ends it (nullopt); `how` is for the event. The comparison at rest and the stability
  /// begin again. An offset of another model than that in use ends at once.
  void use_offset(std::size_t axis, std::optional<Offset> offset, const std::string& how);
  /// Ends the offsets that have expired, by the host's clock or by its uptime. Call once a second.
  void end_offsets(std::int64_t now_s, std::int64_t uptime_s);
  /// Called with each offset that ends.
  void call_at_end_of_offsets(OffsetEnded ended) { offset_ended_ = std::move(ended); }

  /// Applies a new set-up completely, or not at all. Another frame description, axis or clock starts a new pipeline.
  /// Returns true if the lines must be reopened. Errors: a changed socket, directory or number of logs (needs a
  /// restart).
  Result<bool> reconfigure(Setup setup);

  /// Of the line, in the current pipeline.
  const wire::DecoderCounters& decoded(std::size_t line) const;
  /// Since the start, over all pipelines.
  std::uint64_t frames() const { return frames_before_ + decoded(kGyroLine).frames; }

  Setup setup;                             ///< changed by reconfigure()
  std::unique_ptr<Pipeline> pipeline;      ///< never null
  std::vector<LineStatus> lines;           ///< the gyro's, then Setup::sensor_lines
  std::vector<AxisRecord> axes;            ///< in order of the set-up's
  std::vector<CorrectedFrames> outputs;    ///< as Setup::outputs
  std::vector<OutputStatus> output_lines;  ///< the same; empty in a replay
  Problems& problems;
  const LogCounters* log = nullptr;  ///< of all axes' logs together; null without a log
  std::uint64_t sessions = 0;        ///< of the gyro's line
  std::string clocks_differed;       ///< the last disagreement of clocks since the start; empty: none

 private:
  void keep(Rows& rows, std::span<const std::uint8_t> bytes = {});
  void end_session(Rows& rows);
  void make_outputs();
  void end_offset_of_other_model(std::size_t axis);
  void watch(const Rows& rows);
  void watch_clock();
  void watch_stages(std::int64_t now_ns);
  void set_or_clear(const char* key, Problem found, const std::string& over);

  const Publish publish_;
  const Tell tell_;
  Send send_;
  OffsetEnded offset_ended_ = [](std::size_t, const Offset&) {};
  StageMonitor stages_;
  std::int64_t stages_checked_ns_ = 0;
  std::uint64_t frames_before_ = 0;
  std::uint64_t reported_by_arrival_ = 0, reported_resets_ = 0;  ///< of the pipeline's ClockStatus
};

}  // namespace prism::pipeline
