// SPDX-License-Identifier: MIT
// prismd live compared with a minimal relay in the same run: CPU, and latency from the write on the serial line to the
// client's line. A benchmark, not a test: it prints ratios and has no limits.
#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/bench/abusers.hpp"
#include "tests/bench/live_program.hpp"

namespace {

namespace wire = prism::wire;

using prism::bench::Bench;
using prism::bench::Outcome;
using prism::wire::FrameDescriptionPtr;

void print_row(const char* what, double ours, double floor, double ratio, const char* unit, double wanted,
               bool at_least) {
  fmt::print("{:<34} {:>12.2f} {:>12.2f} {:>8.2f}   {} {:.2f}   [{}]\n", what, ours, floor, ratio,
             at_least ? ">=" : "<=", wanted, unit);
}

struct Programs {
  const char *prismd, *relay;
  std::string description, model, folder;
  const char* before;  // another prismd to compare with, or null
};

// Settings of both programs, for frames of one nominal rate.
struct Course {
  Programs programs;
  std::string description;  // with this rate: a clock with 1000 Hz would reject frames at 100 Hz
  wire::FrameDescriptionPtr frames;
  const char* clock;
  std::size_t frame_bytes = 0, line_bytes = 0;

  Course(const Programs& both, double rate_hz, const char* clock_source)
      : programs(both), description(both.description), clock(clock_source) {
    const std::string key = "\"rate_hz\": 1000";
    description.replace(description.find(key), key.size(), fmt::format("\"rate_hz\": {:g}", rate_hz));
    const auto parsed = prism::wire::parse_frame_description(description, "benchmark");
    if (!parsed) {
      fmt::print(stderr, "bench_live: {}\n", parsed.error().text());
      std::exit(1);
    }
    frames = *parsed;
    std::vector<std::uint8_t> one;
    prism::wire::FrameEncoder(frames).encode(
        {.rate_deg_per_h = {8.4652}, .interval_s = frames->period_s(), .temperature_degc = 25, .uhfo_v = 5.32}, one);
    frame_bytes = one.size();
    line_bytes = prismd()->line_bytes();
  }

  std::unique_ptr<Bench> prismd(bool through_tcp = false) const { return prismd(programs.prismd, through_tcp); }
  std::unique_ptr<Bench> prismd(const char* program, bool through_tcp = false) const {
    auto bench = std::make_unique<Bench>(frames, "prismd", programs.folder, through_tcp);
    bench->start_prismd(program, description, clock, programs.model);
    return bench;
  }
  std::unique_ptr<Bench> relay(bool through_tcp = false) const {
    auto bench = std::make_unique<Bench>(frames, "relay", programs.folder, through_tcp);
    bench->start_relay(programs.relay, frame_bytes, line_bytes);
    return bench;
  }
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Results of both programs, round by round.
struct Rounds {
  std::vector<double> ours, floor;

  void add(double a, double b) { ours.push_back(a), floor.push_back(b); }
  // The ratio is the median of the rounds' ratios: a slow phase of the machine affects both programs of a round.
  void print(const std::string& what, double wanted) const {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < ours.size(); ++i) ratios.push_back(ours[i] / floor[i]);
    print_row(what.c_str(), median(ours), median(floor), median(ratios), "us", wanted, false);
  }
};

// The core and the memory that the kernel assigns to a process change its latency by a fifth for its lifetime, and so
// do earlier programs. So each round starts each program again, alone, alternately first and second.
void compare_paced(const Programs& programs, double rate_hz) {
  constexpr int kRounds = 16;
  const Course course(programs, rate_hz, "host");
  const auto paced = [rate_hz](std::unique_ptr<Bench> bench) {
    bench->line_bytes();
    return bench->paced(rate_hz, 2);
  };
  Rounds latency, cpu, latency_before, cpu_before;
  for (int round = 0; round < kRounds; ++round) {
    Outcome ours, floor, before;
    const auto measure = [&](bool now) {
      if (now) ours = paced(course.prismd());
      if (!now && programs.before != nullptr) before = paced(course.prismd(programs.before));
    };
    measure(round % 2 == 0);
    floor = paced(course.relay());
    measure(round % 2 == 1);
    latency.add(ours.latency_us, floor.latency_us);
    cpu.add(ours.cpu_us_per_frame, floor.cpu_us_per_frame);
    latency_before.add(ours.latency_us, before.latency_us);
    cpu_before.add(ours.cpu_us_per_frame, before.cpu_us_per_frame);
  }
  latency.print(fmt::format("median latency at {:g} frames/s", rate_hz), rate_hz > 500 ? 1.1 : 1.3);
  if (rate_hz > 500) cpu.print("CPU per frame at 1000 frames/s", 1.4);
  if (programs.before == nullptr) return;
  latency_before.print("  latency relative to the other prismd", 1.05);
  cpu_before.print("  CPU relative to the other prismd", 1.15);
}

// The same through TCP on the loopback interface, compared with a bare TCP relay.
void compare_tcp(const Programs& programs) {
  constexpr int kRounds = 16;
  constexpr double kRateHz = 1000;
  const Course course(programs, kRateHz, "host");
  const auto paced = [](std::unique_ptr<Bench> bench) {
    bench->line_bytes();
    return bench->paced(kRateHz, 2);
  };
  Rounds latency, cpu;
  for (int round = 0; round < kRounds; ++round) {
    const bool first = round % 2 == 0;
    const Outcome one = paced(first ? course.prismd(true) : course.relay(true));
    const Outcome two = paced(first ? course.relay(true) : course.prismd(true));
    const Outcome &ours = first ? one : two, &floor = first ? two : one;
    latency.add(ours.latency_us, floor.latency_us);
    cpu.add(ours.cpu_us_per_frame, floor.cpu_us_per_frame);
  }
  latency.print("TCP: median latency, 1000 frames/s", 1.25);
  cpu.print("TCP: CPU per frame, 1000 frames/s", 1.5);
}

// Added lateness of another subscriber's lines while four clients request an hour of history.
void compare_history(const Programs& programs, const char* program, double rate_hz) {
  const Course course(programs, rate_hz, "device");
  const auto bench = course.prismd(program);
  bench->fill(static_cast<std::size_t>(3601 * rate_hz));
  if (::setpriority(PRIO_PROCESS, 0, -10) != 0) fmt::print("(only root can run the subscriber at nice -10)\n");
  const double alone_us = bench->paced(rate_hz, 10).p99_us;
  auto askers = prism::bench::four_that_ask(bench->socket(), prism::bench::hour_of_history(), 1);
  const double beside_us = bench->paced(rate_hz, 10).p99_us;
  ::setpriority(PRIO_PROCESS, 0, 0);
  askers.reset();
  fmt::print(
      "p99 lateness at {:g} frames/s: alone {:.2f} ms, with four clients that request an hour of history {:.2f} ms "
      "(target: at most 5 ms more)\n",
      rate_hz, 1e-3 * alone_us, 1e-3 * beside_us);
}

std::pair<Outcome, Outcome> compare_flood(const Programs& programs) {
  const Course course(programs, 1000, "device");
  fmt::print("live: one client, {} bytes per frame, {} bytes per line\n", course.frame_bytes, course.line_bytes);
  const Outcome ours = course.prismd()->flood(1'000'000);
  return {ours, course.relay()->flood(1'000'000)};
}

}  // namespace

// usage: bench_live PRISMD RELAY DESCRIPTION MODEL DIRECTORY [ANOTHER_PRISMD]
int main(int argc, char** argv) {
  if (argc != 6 && argc != 7) return 64;
  ::signal(SIGPIPE, SIG_IGN);
  const auto text = prism::read_text_file(argv[3]);
  if (!text) {
    fmt::print(stderr, "bench_live: {}\n", text.error().text());
    return 1;
  }
  const Programs programs{argv[1], argv[2], *text, argv[4], argv[5], argc == 7 ? argv[6] : nullptr};
  const bool only_tcp = std::getenv("PRISM_ONLY_TCP") != nullptr;
  const auto [a, b] = only_tcp ? std::pair<Outcome, Outcome>() : compare_flood(programs);
  fmt::print("{:<34} {:>12} {:>12} {:>8}   target\n", "", "prismd", "relay", "ratio");
  if (only_tcp) {
    compare_tcp(programs);
    return 0;
  }
  for (const double rate_hz : {100.0, 1000.0}) compare_paced(programs, rate_hz);
  compare_tcp(programs);
  print_row("CPU per frame at maximum rate", a.cpu_us_per_frame, b.cpu_us_per_frame,
            a.cpu_us_per_frame / b.cpu_us_per_frame, "us", 2.0, false);
  print_row("frames/s at maximum rate", a.lines_per_s, b.lines_per_s, a.lines_per_s / b.lines_per_s, "1/s", 1.0, true);
  fmt::print("lines lost at maximum rate: prismd {:.3f} %, relay {:.3f} %\n", 100 * a.lost, 100 * b.lost);
  for (const double rate_hz : {200.0, 1000.0}) {
    compare_history(programs, programs.prismd, rate_hz);
    if (programs.before == nullptr) continue;
    fmt::print("  the other prismd: ");
    compare_history(programs, programs.before, rate_hz);
  }
  return 0;
}
