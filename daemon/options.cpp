// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>

#include "base/escape.hpp"
#include "base/text_number.hpp"
#include "config/version.hpp"
#include "daemon/program.hpp"

namespace prism::daemon {

std::optional<int> parse_options(int argc, char** argv, Options& options) {
  CLI::App app(
      "prismd: reads a laser gyro on a serial line, removes its bias drift, logs and publishes the corrected rate");
  app.set_version_flag("--version", std::string("prismd ") + kVersion);
  app.add_option("CONFIG", options.config, "configuration file, see prismd.json(5)");
  app.add_flag("--check", options.check,
               "check the configuration and all files that it names (or a frame description or a model), then exit (0 "
               "valid, 78 invalid); with --replay, also print how many bytes, frames and rows the capture gives");
  app.add_option("--sniff", options.sniff,
                 "listen on a serial device or HOST:PORT (TCP), or read a capture or a file of bytes, and print which "
                 "frame description "
                 "fits; CONFIG, if given, is the only description to try (name or path)");
  app.add_option("--replay", options.replay, "process a recorded capture instead of the live line; may be repeated")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("FILE");
  app.add_option("--replay-sensors", options.replay_sensors,
                 "capture of a sensor line for the replay; may be repeated (default: LINE/*.pcap in the directory of "
                 "the gyro's capture)")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("LINE=FILE");
  std::string speed = "max";
  const auto* const speed_option =
      app.add_option("--speed", speed, "speed of the replay: 1 as recorded, 10 ten times as fast, max (default)")
          ->check([](const std::string& text) {
            const double factor = text == "max" ? 1 : parse_number<double>(text).value_or(0);
            if (factor >= 1e-3 && factor <= 1e6) return std::string();
            return fmt::format("found \"{}\", expected max or a number within 0.001 to 1e6", text);
          });
  app.add_flag("--strict", options.strict,
               "exit with 78 if a model cannot be used (default: record uncorrected rates, and report it)");
  app.add_flag("--accept-clock", options.overrides.accept_clock,
               "accept frames that arrive at another rate than described (else a replay exits with 3)");
  app.add_option("--out", options.overrides.replay_log, "directory of the replay's log (default: prism-replay)");
  app.add_option("--out-frames", options.out_frames, "file for the bytes that the first output sends in the replay");
  app.add_option("--socket", options.overrides.socket,
                 "socket path instead of the configuration's; required for a socket of a replay");
  app.add_option("--model", options.overrides.model, "model file instead of the configuration's");
  app.add_option("--device", options.overrides.device, "serial device instead of the configuration's line");
  app.footer(
      "Examples:\n  prismd /etc/prism/gyro1.json --check\n  prismd gyro.json --replay capture.pcap --out replayed\n"
      "  prismd --sniff /dev/ttyUSB0\n  prismd --sniff bytes.bin ./my-gyro.json");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "prismd: %s; see prismd --help\n", printable(error.what()).c_str());
    return kExitUsage;
  }
  if (options.config.empty() && options.sniff.empty()) {
    std::fprintf(stderr, "prismd: expected CONFIG or --sniff DEVICE; see prismd --help\n");
    return kExitUsage;
  }
  const bool of_replay = *speed_option || !options.overrides.replay_log.empty() || !options.out_frames.empty() ||
                         !options.replay_sensors.empty();
  if (options.replay.empty() && of_replay) {
    std::fprintf(stderr, "prismd: --speed, --out, --out-frames and --replay-sensors need --replay\n");
    return kExitUsage;
  }
  options.speed = parse_number<double>(speed);
  if (!options.replay.empty() && options.overrides.replay_log.empty()) options.overrides.replay_log = "prism-replay";
  return std::nullopt;
}

}  // namespace prism::daemon
