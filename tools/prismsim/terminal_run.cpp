// SPDX-License-Identifier: MIT
#include "tools/prismsim/terminal_run.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <thread>
#include <vector>

#include "tools/prismsim/obedient_device.hpp"
#include "tools/prismsim/stop.hpp"
#include "tools/prismsim/truth_file.hpp"

namespace prism::prismsim {
namespace {

using Steady = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kLookForReader{10}, kSettle{50}, kLeastNap{1}, kDrainFor{5000}, kLook{2};
constexpr std::size_t kMostPending = 2048;  // bytes per write: a reader at "max" gets chunks as large as on a real line

// steady_clock is CLOCK_MONOTONIC here; unlike sleep_until, this returns on a signal.
void nap_until(Steady::time_point when) {
  const auto since = std::chrono::duration_cast<std::chrono::nanoseconds>(when.time_since_epoch()).count();
  const timespec deadline{since / 1'000'000'000, since % 1'000'000'000};
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
}

// Waits until a program has opened the line and had time to set it up (which discards its content).
void await_reader(Outlet& terminal) {
  while (!terminal.has_reader() && !stop_requested()) nap_until(Steady::now() + kLookForReader);
  if (!stop_requested()) nap_until(Steady::now() + kSettle);
}

void drain(Outlet& terminal) {
  const auto deadline = Steady::now() + kDrainFor;
  while (!terminal.is_drained() && Steady::now() < deadline && !stop_requested())
    nap_until(Steady::now() + kLookForReader);
  nap_until(Steady::now() + kLookForReader);  // for a reader that has read the bytes and checks the line once more
}

class TerminalRun {
 public:
  TerminalRun(const SimOptions& options, Outlet& terminal)
      : options_(options), terminal_(terminal), line_(options.frames, options.simulation) {
    const wire::Commands& commands = options.frames->commands;
    if (options.obey || commands.start || commands.poll) device_.emplace(commands);
  }

  Result<simulation::SimulationCounters> run() {
    if (!options_.truth.empty()) {
      auto opened = TruthFiles::open(options_.truth, options_.simulation, *options_.frames);
      if (!opened) return tl::unexpected<Error>(opened.error());
      truth_ = std::move(*opened);
    }
    if (options_.wait || !options_.speed) await_reader(terminal_);
    in_bunches_ = options_.speed && options_.simulation.rate_hz * *options_.speed > 1000;
    start_ = Steady::now();
    start_ns_ =
        std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
            .count();
    const std::uint64_t frames = options_.total_frames();
    while (line_.counters().frames < frames && !stop_requested()) {
      if (options_.speed) await_next_frame();
      if (auto done = make_due_frames(frames); !done) return tl::unexpected<Error>(done.error());
      if (device_) obey();
      if (!options_.obey || device_->sends_frame()) send();
    }
    drain(terminal_);
    if (truth_) {
      if (auto done = truth_->flush(); !done) return tl::unexpected<Error>(done.error());
    }
    simulation::SimulationCounters counters = line_.counters();
    counters.overrun_bytes = overrun_bytes_;
    counters.parts = line_.parts();
    return counters;
  }

 private:
  Steady::time_point due(std::uint64_t frame) const {
    const double seconds = static_cast<double>(frame) / options_.simulation.rate_hz / *options_.speed;
    return start_ + std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(seconds));
  }

  // Sends frames faster than 1 kHz in groups, unless the reader is behind.
  void await_next_frame() {
    const auto next = due(line_.counters().frames + 1), now = Steady::now();
    for (auto step = now + kLook; options_.obey && step < next && !stop_requested(); step += kLook) {
      nap_until(step);
      obey();
      if (device_->is_asked()) return;  // the reply does not wait for the next frame's time
    }
    if (next > now) nap_until(in_bunches_ ? std::max(next, now + kLeastNap) : next);
  }

  // Answers what the reader sent.
  void obey() {
    const bool reader = terminal_.has_reader();
    if (reader && !had_reader_) device_->restart();
    had_reader_ = reader;
    std::array<std::uint8_t, 4096> bytes;
    const std::vector<std::uint8_t> answers = device_->received({bytes.data(), terminal_.read_some(bytes)});
    if (!answers.empty()) terminal_.write_some(answers);
  }

  // At least one frame, then all that are due, up to the size of one write.
  Result<void> make_due_frames(std::uint64_t last) {
    pending_.clear();
    const auto now = Steady::now();
    do {
      line_.next_frame(pending_);
      if (truth_) {
        if (auto done = truth_->push(start_ns_ + line_.time_ns(), line_); !done) return done;
      }
    } while (line_.counters().frames < last && pending_.size() < kMostPending &&
             (!options_.speed || due(line_.counters().frames + 1) <= now));
    return {};
  }

  void send() {
    std::span<const std::uint8_t> rest = pending_;
    while (!rest.empty() && !stop_requested()) {
      if (!terminal_.has_reader()) {
        if (options_.speed) return;  // lost, as without a reader
        await_reader(terminal_);
        continue;
      }
      const std::size_t taken = terminal_.write_some(rest);
      rest = rest.subspan(taken);
      if (options_.overrun && !rest.empty()) {
        overrun_bytes_ += rest.size();
        return;
      }
      if (taken == 0) terminal_.wait_for_room(20);
    }
  }

  const SimOptions& options_;
  Outlet& terminal_;
  simulation::SimulatedLine line_;
  std::optional<ObedientDevice> device_;
  bool had_reader_ = false;
  std::optional<TruthFiles> truth_;
  std::vector<std::uint8_t> pending_;
  Steady::time_point start_;
  std::int64_t start_ns_ = 0;
  std::uint64_t overrun_bytes_ = 0;
  bool in_bunches_ = false;
};

}  // namespace

Result<simulation::SimulationCounters> run_terminal(const SimOptions& options, Outlet& terminal) {
  return TerminalRun(options, terminal).run();
}

}  // namespace prism::prismsim
