// SPDX-License-Identifier: MIT
// Bytes → readings → samples → compensated rows: the one path that live, replay and tests run.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compensation/engine.hpp"
#include "daemon/setup.hpp"
#include "drivers/clock.hpp"
#include "drivers/wire/frame_decoder.hpp"

namespace prism::daemon {

/// Who hears of the rows.
class RowSink {
 public:
  virtual ~RowSink() = default;
  virtual void sample(const compensation::Compensated& row) = 0;
  virtual void window(const compensation::CompensatedWindow& row) = 0;
};

/// Synchronous and deterministic: what comes out depends on the bytes, their arrival times and the setup only.
class Pipeline {
 public:
  Pipeline(const Setup& setup, RowSink& sink);

  /// The line was opened (again): the second in progress is closed, and nothing held from before continues.
  void begin_session();
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns);
  /// Nothing has arrived until now_ns: a candidate that waits for its end may be given up.
  void expire(std::int64_t now_ns);
  /// The end of the run: what can still be read is read, the open second is closed.
  void finish();

  Result<void> use(compensation::ModelPtr model, compensation::ModelPtr fallback) {
    return engine_.use(std::move(model), std::move(fallback));
  }

  const wire::FrameDecoder& decoder() const { return decoder_; }
  const drivers::Clock& clock() const { return clock_; }
  const compensation::Engine& engine() const { return engine_; }

 private:
  void pass(const std::vector<wire::Reading>& readings);

  wire::FrameDecoder decoder_;
  drivers::Clock clock_;
  compensation::Engine engine_;
  RowSink& sink_;
  std::vector<wire::Reading> readings_;
};

}  // namespace prism::daemon
