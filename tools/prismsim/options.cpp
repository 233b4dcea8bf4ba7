// SPDX-License-Identifier: MIT
#include "tools/prismsim/options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "compensation/earth_rate.hpp"
#include "config/search_path.hpp"
#include "config/version.hpp"
#include "drivers/transport/network_line.hpp"
#include "tools/command_line.hpp"

namespace prism::prismsim {
namespace {

constexpr int kUsage = 64, kBadConfiguration = 78;
constexpr double kMostHours = 24 * 366;

// Command line before it is interpreted.
struct CommandLine {
  std::string profile = "paper", frames = "trplg", speed = "1";
  std::vector<std::string> axes, invalid;
  std::optional<double> rate_hz, hours;
  std::string tcp, tcp_listen, udp;  // addresses of a network line
  double cycles = 1;
  double latitude_deg = compensation::AxisPlacement().latitude_deg;
  std::vector<double> elevation_deg = {compensation::AxisPlacement().elevation_deg};
  std::vector<double> azimuth_deg = {compensation::AxisPlacement().azimuth_deg};
};

int complain(int code, const std::string& what) {
  fmt::print(stderr, "prismsim: {}\n", what);
  return code;
}

void declare_gyro(CLI::App& app, CommandLine& line, SimOptions& options) {
  const CLI::Validator share = tools::within(0, 1);
  simulation::SimulationSettings& simulation = options.simulation;
  app.add_option("--profile", line.profile, "thermal cycle: paper, second, third, beyond, fast, steady or warm-up")
      ->capture_default_str();
  app.add_option("--seed", simulation.seed, "random numbers of the day: another seed is another day of the same gyro")
      ->check(tools::within(0, 1e15))
      ->capture_default_str();
  auto* cycles = app.add_option("--cycles", line.cycles, "number of cycles")
                     ->check(tools::within(1e-6, 1000.0))
                     ->capture_default_str();
  app.add_option("--hours", line.hours, "stop after this many hours instead")
      ->check(tools::within(1e-6, kMostHours))
      ->excludes(cycles);
  app.add_option("--frames", line.frames, "frame description: a name or a path")->capture_default_str();
  app.add_option("--axis", line.axes, "axes of the description to simulate: one or several, x,y,z (default: its first)")
      ->delimiter(',')
      ->type_name("TEXT");
  app.add_option("--invalid", line.invalid, "AXIS:FROM:TO, in seconds: the device marks the axis invalid")
      ->delimiter(',');
  app.add_option("--rate", line.rate_hz, "frames per second, all message types (default: from the description)")
      ->check(tools::within(0.01, 100000.0));
  app.add_option("--latitude", line.latitude_deg, "site latitude, degrees north")
      ->check(tools::within(-90.0, 90.0))
      ->capture_default_str();
  app.add_option("--elevation", line.elevation_deg, "input axis, degrees above the horizon; a list for several axes")
      ->delimiter(',')
      ->check(tools::within(-90.0, 90.0))
      ->capture_default_str();
  app.add_option("--azimuth", line.azimuth_deg, "input axis, degrees from north over east; a list for several axes")
      ->delimiter(',')
      ->check(tools::within(-360.0, 360.0))
      ->capture_default_str();
  app.add_option("--outliers", simulation.outliers_per_h, "jumps of the angle per hour")
      ->check(tools::within(0.0, 1e6));
  app.add_option("--lose-frames", simulation.lose_frames, "share of frames not sent, 0 to 1")->check(share);
  app.add_option("--drop-bytes", simulation.drop_bytes, "share of bytes dropped by the line, 0 to 1")->check(share);
  app.add_option("--damage-bytes", simulation.damage_bytes, "share of bytes changed by the line, 0 to 1")->check(share);
}

// Causes of bias other than T, dT/dt and U.
void declare_truth(CLI::App& app, simulation::BiasModelSettings& truth) {
  app.add_flag("--smooth", truth.smooth, "smooth non-quadratic bias instead of the paper's equation");
  app.add_flag("--in-air", truth.thermometer_in_air, "the thermometer is in the chamber's air, not in the gyro");
  const std::tuple<const char*, double&, const char*> sizes[]{
      {"--sensor-lag", truth.sensor_lag_s, "lag of the thermometer behind the body, s"},
      {"--hysteresis", truth.hysteresis_deg_per_h, "half the gap between heating and cooling, deg/h"},
      {"--turn-on", truth.turn_on_deg_per_h, "1 sigma of the offset of each switch-on, deg/h"},
      {"--warm-up", truth.warm_up_deg_per_h, "bias at switch-on, falls to 1/e in an hour, deg/h"},
      {"--flicker", truth.flicker_deg_per_h, "bias instability B, deg/h"},
      {"--mode-hops", truth.mode_hops_deg_per_h, "1 sigma of the bias levels between mode hops, deg/h"},
      {"--ageing", truth.ageing_deg_per_h_per_day, "drift, deg/h per day"},
      {"--thermal-ageing", truth.thermal_ageing_per_day, "growth of the thermal bias per day, 0.01: by 1 %"},
      {"--age", truth.age_days, "days that the gyro has aged before this switch-on"},
      {"--gradient", truth.gradient_deg_per_h_per_degc,
       "bias per degC of case minus body temperature, deg/h; only a case thermometer detects it"},
      {"--tilt", truth.tilt_deg_per_h, "daily tilt of the floor, amplitude, deg/h"}};
  for (const auto& [name, value, text] : sizes) app.add_option(name, value, text)->check(tools::within(0.0, 1e4));
}

void declare_output(CLI::App& app, CommandLine& line, SimOptions& options) {
  app.add_option("--out", options.out, "write a capture, at full speed")->type_name("FILE");
  app.add_option("--truth", options.truth, "write the truth once a second, as CSV")->type_name("FILE");
  app.add_option("--chunk-bytes", options.chunk_bytes, "bytes per capture packet (default: one frame)")
      ->check(tools::within(1, 65536));
  app.add_flag("--pty", options.terminal, "send on a pseudo-terminal and print its path");
  app.add_option("--link", options.link, "the same, and create a symbolic link to it")->type_name("PATH");
  app.add_option("--tcp", line.tcp, "send through TCP: connect to a prismd that listens")->type_name("HOST:PORT");
  app.add_option("--tcp-listen", line.tcp_listen, "send through TCP: wait for a prismd that connects")
      ->type_name("HOST:PORT");
  app.add_option("--udp", line.udp, "send datagrams to this address")->type_name("HOST:PORT");
  app.add_flag("--obey", options.obey,
               "send only after the description's start commands, and only on request if it has a poll");
  app.add_flag("--wait", options.wait, "on a pseudo-terminal: start when a program opens it");
  app.add_flag("--overrun", options.overrun, "on a pseudo-terminal: drop bytes if the reader is too slow");
  app.add_option("--speed", line.speed, "on a pseudo-terminal: 1 real time, 10 ten times as fast, max")
      ->capture_default_str();
}

std::optional<int> read_frames(const CommandLine& line, SimOptions& options) {
  const std::string path = config::find_data_file(line.frames, "frames", ".");
  const auto text = config::read_data_file(path, "frames", "--frames");
  if (!text) return complain(kBadConfiguration, text.error().text());
  wire::GyroChoice choice;
  if (!line.axes.empty()) choice.axes.clear();
  for (const std::string& axis : line.axes) choice.axes.push_back({.axis = axis});
  choice.sensors = true;
  const auto frames = wire::parse_frame_description(*text, path, choice);
  if (!frames) return complain(kBadConfiguration, frames.error().text());
  if (!(*frames)->carries_gyro() && (*frames)->sensors().empty())
    return complain(kBadConfiguration, path + ": has no gyro or sensor to simulate");
  if ((*frames)->sent_kinds.empty())
    return complain(kBadConfiguration, path + ": its columns are chosen by a configuration; expected them in the file");
  if ((*frames)->axes.empty() && !options.truth.empty())
    return complain(kUsage, "--truth: " + path + " is an instrument without a gyro, which has no bias");
  options.frames = *frames;
  return std::nullopt;
}

/// Frames per second of all message types sent; the description's rate counts those with gyro data.
double sent_rate_hz(const wire::FrameDescription& frames) {
  const auto with_gyro = std::count_if(frames.sent_kinds.begin(), frames.sent_kinds.end(), [&](int kind) {
    return frames.kinds[static_cast<std::size_t>(kind)].roles.carries_gyro();
  });
  return frames.rate_hz * static_cast<double>(frames.sent_kinds.size()) /
         static_cast<double>(std::max<std::ptrdiff_t>(with_gyro, 1));
}

/// The counter of a device that is set to another rate: its ticks per second stay.
std::optional<int> scale_counter(SimOptions& options) {
  const auto& rule = options.frames->counter;
  if (!rule || !rule->step_follows_rate) return std::nullopt;
  const double rate_hz = options.simulation.rate_hz, step = rule->ticks_per_s / rate_hz;
  if (rule->modulus != 0 && step >= static_cast<double>(rule->modulus)) {
    return complain(kUsage, fmt::format("--rate: found {}, expected more than {}: the counter of \"{}\" begins again "
                                        "after {} ticks, {} a second",
                                        rate_hz, rule->ticks_per_s / static_cast<double>(rule->modulus),
                                        options.frames->name, rule->modulus, rule->ticks_per_s));
  }
  const auto scaled = std::make_shared<wire::FrameDescription>(*options.frames);
  scaled->counter->ticks_per_frame = step;
  options.frames = scaled;
  return std::nullopt;
}

// "y:10:20"
Result<simulation::InvalidTime> read_invalid(const std::string& text, const wire::FrameDescription& frames) {
  const std::size_t first = text.find(':'), second = text.find(':', first + 1);
  const std::string axis = text.substr(0, first);
  simulation::InvalidTime time;
  while (time.axis < frames.axes.size() && frames.axes[time.axis].name != axis) ++time.axis;
  const bool good = second != std::string::npos && time.axis < frames.axes.size() &&
                    CLI::detail::lexical_cast(text.substr(first + 1, second - first - 1), time.from_s) &&
                    CLI::detail::lexical_cast(text.substr(second + 1), time.to_s) && time.from_s < time.to_s;
  if (!good)
    return make_error("--invalid", fmt::format("found \"{}\", expected AXIS:FROM:TO of an axis in --axis", text));
  return time;
}

// One number applies to all axes.
std::optional<int> place(const CommandLine& line, SimOptions& options) {
  const std::size_t axes = options.frames->axes.size();
  const std::pair<const char*, std::size_t> lists[] = {{"--elevation", line.elevation_deg.size()},
                                                       {"--azimuth", line.azimuth_deg.size()}};
  for (const auto& [name, count] : lists) {
    if (count != 1 && count != axes)
      return complain(kUsage,
                      fmt::format("{}: found {} numbers, expected one or {}, one for each axis", name, count, axes));
  }
  const auto of = [](const std::vector<double>& list, std::size_t i) { return list.size() == 1 ? list[0] : list[i]; };
  for (std::size_t i = 0; i < axes; ++i) {
    const compensation::AxisPlacement placement{line.latitude_deg, of(line.elevation_deg, i), of(line.azimuth_deg, i)};
    options.simulation.earth_rate_deg_per_h[i] = compensation::earth_rate_deg_per_h(placement);
  }
  return std::nullopt;
}

std::optional<int> read_network(const CommandLine& line, SimOptions& options) {
  const std::pair<const char*, transport::Network> lines[] = {{"--tcp", {"tcp", line.tcp, false, ""}},
                                                              {"--tcp-listen", {"tcp", line.tcp_listen, true, ""}},
                                                              {"--udp", {"udp", line.udp, false, ""}}};
  for (const auto& [name, network] : lines) {
    if (network.address.empty()) continue;
    if (!options.network.type.empty()) return complain(kUsage, fmt::format("{}: found two network lines", name));
    if (const auto endpoint = transport::parse_endpoint(network.address); !endpoint)
      return complain(kUsage, fmt::format("{}: {}", name, endpoint.error()));
    options.network = network;
  }
  return std::nullopt;
}

std::optional<int> understand(const CommandLine& line, SimOptions& options) {
  const auto profile = simulation::find_profile(line.profile);
  if (!profile) return complain(kUsage, "--profile: " + profile.error().text());
  options.simulation.profile = *profile;
  options.terminal = options.terminal || !options.link.empty();
  if (auto code = read_network(line, options)) return code;
  if (options.terminal + !options.out.empty() + !options.network.type.empty() != 1) {
    return complain(kUsage,
                    "expected one of --out FILE (a capture), --pty (a pseudo-terminal), --tcp, --tcp-listen and --udp; "
                    "see prismsim --help");
  }
  if (line.speed != "max") {
    char* end = nullptr;
    const double factor = std::strtod(line.speed.c_str(), &end);
    if (line.speed.empty() || *end != '\0' || !(factor >= 1e-3 && factor <= 1e6)) {
      return complain(kUsage,
                      fmt::format("--speed: found \"{}\", expected max or a number within 0.001 to 1e6", line.speed));
    }
    options.speed = factor;
  }
  if (auto code = read_frames(line, options)) return code;
  options.simulation.rate_hz = line.rate_hz.value_or(sent_rate_hz(*options.frames));
  if (auto code = line.rate_hz ? scale_counter(options) : std::nullopt) return code;
  if (auto code = place(line, options)) return code;
  for (const std::string& text : line.invalid) {
    const auto time = read_invalid(text, *options.frames);
    if (!time) return complain(kUsage, time.error().text());
    options.simulation.invalid.push_back(*time);
  }
  options.duration_s = line.hours ? *line.hours * 3600 : line.cycles * options.simulation.profile.duration_s();
  return std::nullopt;
}

}  // namespace

std::uint64_t SimOptions::total_frames() const {
  return static_cast<std::uint64_t>(std::ceil(duration_s * simulation.rate_hz - 1e-6));
}

std::optional<int> parse_sim_options(int argc, char** argv, SimOptions& options) {
  CLI::App app("prismsim: a simulated laser gyro in a thermal chamber, on a pseudo-terminal or into a capture file");
  CommandLine line;
  tools::use_readable_help(app);
  tools::add_examples(
      app, {"prismsim --profile paper --seed 1 --out cycle1.pcap", "prismsim --link /tmp/gyro --wait --speed 10"});
  app.set_version_flag("--version", std::string("prismsim ") + kVersion);
  declare_gyro(app, line, options);
  declare_truth(app, options.simulation.truth);
  declare_output(app, line, options);
  if (const auto code = tools::parse(app, "prismsim", argc, argv)) return code;
  return understand(line, options);
}

}  // namespace prism::prismsim
