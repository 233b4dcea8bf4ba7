// SPDX-License-Identifier: MIT
// The bytes that leave on an output: the device's own, with corrected rates. Pure: live and replayed alike.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "config/config.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/setup.hpp"
#include "drivers/wire/encode/frame_editor.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"

namespace prism::pipeline {

/// Since the start.
struct OutputCounters {
  std::uint64_t frames = 0;     ///< with gyro data that left, in any form
  std::uint64_t corrected = 0;  ///< of these: with the engine's correction on every axis
  std::uint64_t fading = 0;     ///< of these: with a correction that moves to the engine's
  std::uint64_t held = 0;       ///< of these: with the last correction, because the engine has none
  std::uint64_t raw = 0;        ///< of these: as received, because the engine has none
  std::uint64_t dropped = 0;    ///< did not leave, because the engine has no correction
  std::uint64_t unfit = 0;      ///< the field cannot have the corrected number: treated as without a correction
};

/// prism's own message (docs/wire.md).
namespace message {
inline constexpr std::size_t kBytes = 44;
enum Flag : std::uint32_t { kFading = 1U << 16, kHeld = 1U << 17, kRaw = 1U << 18 };  ///< with the bits of Quality

struct Fields {
  std::uint8_t axis = 0;      ///< index, as served
  std::uint32_t number = 0;   ///< of the message, modulo 2^32
  std::int64_t time_ns = 0;   ///< of the sample
  double rate_deg_per_h = 0;  ///< as measured
  double correction_deg_per_h = 0;
  float sd_deg_per_h = 0;  ///< NaN: not known
  std::uint32_t flags = 0;
};
void append(const Fields& fields, std::vector<std::uint8_t>& out);
}  // namespace message

/// Corrects the frames of one output. The correction is the engine's. When it begins, ends or comes from another model,
/// the sent one moves there by at most fade_deg_per_h_per_s. Numbers are rounded to the field's unit, and what rounding
/// adds is taken back from the next frame, so that means and sums are right.
class CorrectedFrames {
 public:
  CorrectedFrames(const Setup& setup, const Setup::Output& output);

  /// Appends what leaves because of one call of the pipeline. `bytes`: that the call was given; `decoder`: the
  /// pipeline's, after it. Bytes that may be the begin of a frame wait until it is complete, or none. Before another
  /// pipeline, the last call must be its finish(), after which none wait.
  void push(std::span<const std::uint8_t> bytes, const Rows& rows, const wire::FrameDecoder& decoder,
            std::vector<std::uint8_t>& out);
  /// Another model may be in use: a switch.
  void model_changed();

  /// After push(), for each of its Rows::windows: the mean rate that was sent in its second; kUnknown: none.
  const std::vector<double>& second_means() const { return means_; }
  const OutputCounters& counters() const { return counters_; }

 private:
  enum class Source { kNone, kModel, kFallback, kHeld, kRaw };
  struct AxisState {
    Source source = Source::kNone;
    double correction = 0;  ///< sent, deg/h
    bool fading = false;
    std::optional<std::int64_t> known_ns;  ///< time of the last sample with the engine's correction
    double known = 0;                      ///< that correction
    double carry = 0;                      ///< lost by rounding so far, in units of AxisReading::value
    double angle = 0;                      ///< accumulated: sum of the corrections, the same unit
    double sum = 0, weight = 0;            ///< of the second: rates times intervals
  };
  /// How a frame leaves, from best to worst.
  enum class Form { kCorrected, kFading, kHeld, kRaw };
  struct Verdict {
    Form form = Form::kRaw;
    bool drop = false;
    double correction = 0;   ///< deg/h
    double sent = kUnknown;  ///< rate, deg/h
  };

  Verdict follow(AxisState& axis, const Sample& measured, const compensation::Compensated& row);
  bool send(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
            std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& out);
  bool edit(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
            std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& out);
  bool edit_axis(std::size_t index, const wire::AxisReading& reading, const Sample* sample, Verdict* verdict);
  void encode(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
              std::vector<std::uint8_t>& out);
  void count(std::span<const Rows::Sample> samples);
  void close_seconds(const Rows& rows, std::size_t first_sample);

  const config::OutputConfig config_;
  const wire::FrameDescriptionPtr in_;
  wire::FrameEditor editor_;
  std::optional<wire::FrameEncoder> encoder_;
  std::vector<std::size_t> sensors_;  ///< of the encoder's description: index into the stream's
  std::vector<AxisState> axes_;
  std::vector<std::uint8_t> waiting_;  ///< the decoder's last bytes
  std::uint32_t number_ = 0;
  std::vector<Verdict> verdicts_;  ///< of the frame's samples
  std::vector<double> means_;
  OutputCounters counters_;
};

}  // namespace prism::pipeline
