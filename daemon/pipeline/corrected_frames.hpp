// SPDX-License-Identifier: MIT
// The bytes that leave on an output: the device's own, with corrected rates. Pure: live and replayed alike.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/setup.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"

namespace prism::pipeline {

/// How a frame leaves, from best to worst.
enum class Form {
  kCorrected,  ///< with the engine's correction on every axis
  kFading,     ///< with a correction that moves to the engine's
  kHeld,       ///< with the last correction, because the engine has none
  kRaw,        ///< as received, because the engine has none
  kDropped,    ///< does not leave, because the engine has none
};
inline constexpr std::array kForms = {"corrected", "fading", "held", "raw", "dropped"};

/// Frames with gyro data since the start.
struct OutputCounters {
  std::uint64_t frames = 0;                            ///< that left, in any form
  std::array<std::uint64_t, kForms.size()> by_form{};  ///< as Form
  std::uint64_t unfit = 0;  ///< the field cannot have the corrected number: treated as without a correction
};

/// Appends prism's own message (docs/wire.md). `number`: of the message, modulo 2^32.
void append_message(const Rows::Sample& sample, std::uint32_t number, double correction_deg_per_h, Form form,
                    std::vector<std::uint8_t>& out);

/// Corrects the frames of one output. The correction is the engine's, with an offset by command. When it begins, ends,
/// or comes from another model or offset, the sent one moves there by at most fade_deg_per_h_per_s. Numbers are rounded
/// to the field's unit, and what rounding adds is taken back from the next frame, so that means and sums are right.
class CorrectedFrames {
 public:
  /// `index`: into Setup::outputs.
  CorrectedFrames(const Setup& setup, std::size_t index);

  /// Returns the bytes that leave because of one call of the pipeline, and the first output gives its windows their
  /// mean of the sent rates. `bytes`: that the call was given; `decoder`: the pipeline's, after it. Bytes that may be
  /// the begin of a frame wait until it is complete, or none. Before another pipeline, the last call must be its
  /// finish(), after which none wait. The result is valid until the next call.
  const std::vector<std::uint8_t>& push(std::span<const std::uint8_t> bytes, Rows& rows,
                                        const wire::FrameDecoder& decoder);
  /// Another model or offset may be in use: a switch.
  void correction_changed();
  const OutputCounters& counters() const { return counters_; }

 private:
  struct AxisState {
    std::optional<std::pair<Form, bool>> source;  ///< of the correction; true: the fallback model
    double correction = 0;                        ///< sent, deg/h
    bool fading = false;
    double known = kUnknown;     ///< the last correction of the engine
    std::int64_t known_ns = 0;   ///< time of its last sample
    double carry = 0;            ///< lost by rounding so far, in units of AxisReading::value
    double angle = 0;            ///< accumulated: sum of the corrections, the same unit
    double sum = 0, weight = 0;  ///< of the second: rates times intervals
    // Of the frame:
    const Sample* sample = nullptr;  ///< null: none with a rate
    Form form = Form::kRaw;
    double sent = kUnknown;  ///< rate, deg/h
  };

  Form follow(AxisState& axis, const compensation::Compensated& row);
  Form send(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
            std::span<const std::uint8_t> bytes);
  Form edit(const wire::DecodedMessage& message, std::span<const std::uint8_t> bytes);
  Form edit_axis(std::size_t index, double value);
  /// False, without a frame: a quantity is unknown, and the frame cannot state that.
  bool encode(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message);

  const config::OutputConfig config_;
  const bool is_first_, same_;
  const wire::FrameDescriptionPtr in_;
  wire::FrameEditor editor_;
  std::optional<wire::FrameEncoder> encoder_;
  std::vector<std::size_t> sensors_;  ///< of the encoder's description: index into the stream's
  std::vector<AxisState> axes_;
  std::vector<std::uint8_t> waiting_, out_;  ///< the decoder's last bytes; the result
  std::uint32_t number_ = 0;
  OutputCounters counters_;
};

}  // namespace prism::pipeline
