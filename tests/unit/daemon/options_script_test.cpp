// SPDX-License-Identifier: MIT
// prismd's command line, as scripts (options.txt).
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "daemon/program.hpp"
#include "tests/support/scripts.hpp"

namespace prism::daemon {
namespace {

using Lines = std::vector<std::string>;

/// "prismd ARGUMENT…": the exit code with the messages, or the options that differ from the defaults and the overrides.
struct OptionsPlayer {
  Lines play(const std::string& command, std::istream& words) {
    std::vector<std::string> arguments = {command};
    for (std::string word; words >> word;) arguments.push_back(word == "''" ? "" : word);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    Options options;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const auto code = parse_options(static_cast<int>(argv.size()), argv.data(), options);
    std::istringstream printed(testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr());
    Lines lines = code ? Lines{fmt::format("exit {}", *code)} : shown(options);
    for (std::string line; std::getline(printed, line);) lines.push_back(line);
    return lines;
  }

  static Lines shown(const Options& options) {
    Lines lines;
    const auto add = [&](const char* name, const std::string& value) {
      if (!value.empty()) lines.push_back(fmt::format("{}: {}", name, value));
    };
    const auto flag = [&](const char* name, bool is_set) { add(name, is_set ? "yes" : ""); };
    add("config", options.config);
    flag("check", options.check);
    flag("strict", options.strict);
    add("replay", fmt::to_string(fmt::join(options.replay, " ")));
    add("speed", options.speed ? fmt::format("{}", *options.speed) : "");
    add("sniff", options.sniff);
    add("replay_sensors", fmt::to_string(fmt::join(options.replay_sensors, " ")));
    add("out_frames", options.out_frames);
    const pipeline::Overrides& overrides = options.overrides;
    add("overrides: model", overrides.model);
    add("overrides: device", overrides.device);
    add("overrides: socket", overrides.socket);
    add("overrides: replay_log", overrides.replay_log);
    flag("overrides: accept_clock", overrides.accept_clock);
    flag("overrides: tolerate_models", overrides.tolerate_models);
    flag("overrides: without_models", overrides.without_models);
    return lines;
  }
};

TEST(ProgramOptions, Scripts) { test::expect_scripts<OptionsPlayer>("daemon/options.txt"); }

}  // namespace
}  // namespace prism::daemon
