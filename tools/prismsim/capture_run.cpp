// SPDX-License-Identifier: MIT
#include "tools/prismsim/capture_run.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "drivers/capture_file.hpp"
#include "tools/prismsim/stop.hpp"
#include "tools/prismsim/truth_file.hpp"

namespace prism::prismsim {
namespace {

// Splits the stream into packets; their time is the arrival of the last byte. Like a real line, it falls behind if the
// frames need more than its speed.
class Packets {
 public:
  Packets(drivers::CaptureWriter& writer, const SimOptions& options)
      : writer_(writer),
        most_(options.chunk_bytes),
        byte_ns_(options.frames->wire.byte_time_ns()),
        latency_ns_(options.frames->latency_s * 1e9) {}

  // `offset_ns` is relative to switch-on: a double is exact for a day of nanoseconds, but not for the years since 1970.
  Result<void> add(std::int64_t offset_ns, const std::vector<std::uint8_t>& bytes) {
    const double first_bit_ns = std::max(static_cast<double>(offset_ns) + latency_ns_, line_free_ns_);
    line_free_ns_ = first_bit_ns + static_cast<double>(bytes.size()) * byte_ns_;
    if (most_ == 0) return write(line_free_ns_, bytes);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      chunk_.push_back(bytes[i]);
      if (chunk_.size() < most_) continue;
      if (auto done = write(first_bit_ns + static_cast<double>(i + 1) * byte_ns_, chunk_); !done) return done;
      chunk_.clear();
    }
    return {};
  }

  Result<void> finish() { return write(line_free_ns_, chunk_); }

 private:
  Result<void> write(double arrival_ns, const std::vector<std::uint8_t>& bytes) {
    if (bytes.empty()) return {};
    return writer_.data(kCaptureStart_ns + std::llround(arrival_ns), bytes);
  }

  drivers::CaptureWriter& writer_;
  std::size_t most_;
  double byte_ns_, latency_ns_, line_free_ns_ = 0;
  std::vector<std::uint8_t> chunk_;
};

}  // namespace

Result<simulation::SimulationCounters> run_capture(const SimOptions& options) {
  auto writer = drivers::CaptureWriter::open(options.out);
  if (!writer) return tl::unexpected<Error>(writer.error());
  std::optional<TruthFiles> truth;
  if (!options.truth.empty()) {
    auto opened = TruthFiles::open(options.truth, options.simulation, *options.frames);
    if (!opened) return tl::unexpected<Error>(opened.error());
    truth = std::move(*opened);
  }
  simulation::SimulatedLine line(options.frames, options.simulation);
  Packets packets(*writer, options);
  std::vector<std::uint8_t> bytes;
  const std::uint64_t frames = options.total_frames();
  Result<void> done = writer->opened(kCaptureStart_ns);
  for (std::uint64_t i = 0; done && i < frames && !stop_requested(); ++i) {
    bytes.clear();
    line.next_frame(bytes);
    done = packets.add(line.time_ns(), bytes);
    if (done && truth) done = truth->push(kCaptureStart_ns + line.time_ns(), line);
  }
  if (done) done = packets.finish();
  if (done) done = writer->flush();
  if (done && truth) done = truth->flush();
  if (!done) return tl::unexpected<Error>(done.error());
  simulation::SimulationCounters counters = line.counters();
  counters.parts = line.parts();
  return counters;
}

}  // namespace prism::prismsim
