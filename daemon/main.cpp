// SPDX-License-Identifier: MIT
// prismd: acquire, compensate, log, publish. Live, replay, check or sniff, as the command line requests.
#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <exception>

#include "base/host_time.hpp"
#include "base/time_scale.hpp"
#include "daemon/logging.hpp"
#include "daemon/pipeline/setup.hpp"
#include "daemon/program.hpp"

namespace prism::daemon {
namespace {

void print_growth(const char* what, const std::optional<config::LogSegmentSettings>& settings, double bytes_per_day) {
  if (!settings) return;
  fmt::print("{}: {:.0f} MB a day\n", what, 1e-6 * bytes_per_day);
  const std::string warning = pipeline::directory_problem(settings->directory);
  if (!warning.empty()) fmt::print("warning: {}: {}\n", what, warning);
}

void check(const pipeline::Setup& setup) {
  const config::Config& config = setup.config;
  for (const std::string& key : config.removed_keys) fmt::print("warning: {}\n", key);
  for (const std::string& note : setup.notes) fmt::print("note: {}\n", note);
  fmt::print("{}: good: frames {} ({:g} Hz), model {}, line {}, unit {}\n", config.path, setup.frames->name,
             setup.frames->rate_hz, pipeline::models_text(setup),
             config.line.device.empty() ? "none" : config.line.device, pipeline::unit_name(setup));
  for (std::size_t i = 0; i < config.outputs.size(); ++i) {
    const config::OutputConfig& output = config.outputs[i];
    fmt::print("output {}: {}, frames {}; without a correction: {}\n", i + 1, output.line.device, output.frames,
               config::kUnknownPolicies[static_cast<std::size_t>(output.when_unknown)]);
  }
  print_growth("log", config.log, pipeline::log_bytes_per_day(setup));
  print_growth("capture", config.capture, pipeline::capture_bytes_per_day(setup));
}

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (const auto scale = check_time_scale(); !scale) {
    fmt::print(stderr, "prismd: {}\n", scale.error().text());
    return kExitConfig;
  }
  if (!options.sniff.empty()) return run_sniff(options.sniff, options.config);
  if (options.check) {
    if (const int code = check_document(options.config); code >= 0) return code;
  }
  pipeline::Overrides overrides = options.overrides;
  overrides.tolerate_models = options.replay.empty() && !options.check && !options.strict;
  Result<pipeline::Setup> setup = pipeline::load_setup(options.config, overrides);
  if (setup && options.replay.empty()) setup->loaded_ns = host_time_ns();
  if (!setup) {
    fmt::print(stderr, "prismd: {}\n", setup.error().text());
    return kExitConfig;
  }
  if (setup->config.line.device.empty() && options.replay.empty()) {
    fmt::print(
        stderr,
        "prismd: {}:/line/device: is missing, expected the gyro's serial device (or \"tcp\", \"udp\", or --replay)\n",
        setup->config.path);
    return kExitConfig;
  }
  begin_logging(setup->config.event_level);
  if (options.check) check(*setup);
  if (options.check && options.replay.empty()) return kExitDone;
  const int code =
      options.replay.empty() ? run_live(options, std::move(*setup)) : run_replay(options, std::move(*setup));
  finish_logging();
  return code;
}

}  // namespace
}  // namespace prism::daemon

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed stderr must not end prismd
  try {
    return prism::daemon::run(argc, argv);
  } catch (const std::exception& bug) {
    std::fprintf(stderr, "prismd: internal error: %s; please report it\n", bug.what());
    return prism::daemon::kExitBug;
  }
}
