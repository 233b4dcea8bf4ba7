// SPDX-License-Identifier: MIT
#include "drivers/wire/description/commands.hpp"

#include <fmt/format.h>

#include <string>

namespace prism::wire {
namespace {

constexpr std::size_t kMostSteps = 64, kMostSentBytes = 1024;
constexpr Range kTimeMs{1, 60'000}, kPauseMs{0, 60'000}, kPeriodMs{10, 3'600'000};

std::chrono::milliseconds read_ms(const Section& section, const char* key, Range range,
                                  std::chrono::milliseconds usual) {
  return std::chrono::milliseconds(section.integer(key, range, usual.count()));
}

/// "send": text, or "send_hex": bytes; empty if both are absent.
CommandBytes read_either(const Section& section, const std::string& text_key, std::size_t most) {
  const std::string hex_key = text_key + "_hex";
  CommandBytes bytes;
  if (section.has(text_key) && section.has(hex_key))
    section.fail(hex_key, fmt::format("given together with \"{}\"; expected one of them", text_key));
  if (section.has(hex_key)) bytes = section.bytes(hex_key);
  if (section.has(text_key)) {
    const std::string text = section.raw_text(text_key);
    bytes.assign(text.begin(), text.end());
    if (text.empty()) section.fail(text_key, fmt::format("is empty, expected 1 to {} bytes", most));
  }
  if (bytes.size() > most) section.fail(text_key, fmt::format("has {} bytes, expected at most {}", bytes.size(), most));
  return bytes;
}

Command read_command(const Section& section) {
  Command step;
  step.send = read_either(section, "send", kMostSentBytes);
  step.expect = read_either(section, "expect", kMostExpectedBytes);
  step.within = read_ms(section, "within_ms", kTimeMs, step.within);
  step.wait = read_ms(section, "wait_ms", kPauseMs, step.wait);
  const bool waits = section.has("wait_ms");
  if (step.send.empty() && step.expect.empty() && !waits)
    section.fail("", "found no command, expected \"send\", \"send_hex\", \"expect\" or \"wait_ms\"");
  if (waits && !step.expect.empty())
    section.fail("wait_ms", "given together with \"expect\"; expected a step of its own");
  if (section.has("within_ms") && step.expect.empty()) section.fail("within_ms", "given without \"expect\"");
  return step;
}

std::optional<std::vector<Command>> read_steps(const Section& section, const char* key) {
  if (!section.has(key)) return std::nullopt;
  std::vector<Command> steps;
  for (const Section& step : section.objects(key)) steps.push_back(read_command(step));
  if (steps.size() > kMostSteps)
    section.fail(key, fmt::format("found {} steps, expected at most {}", steps.size(), kMostSteps));
  return steps;
}

PollRequest read_request(const Section& section, std::chrono::milliseconds within) {
  PollRequest request;
  request.send = read_either(section, "send", kMostSentBytes);
  request.within = read_ms(section, "within_ms", kTimeMs, within);
  if (request.send.empty()) section.fail("", "found no request, expected \"send\" or \"send_hex\"");
  return request;
}

Poll read_poll(const Section& section) {
  Poll poll;
  poll.every = read_ms(section, "every_ms", kPeriodMs, poll.every);
  poll.pause = read_ms(section, "pause_ms", kPauseMs, poll.pause);
  if (!section.has("requests")) {
    poll.requests.push_back(read_request(section, PollRequest().within));
    return poll;
  }
  for (const char* key : {"send", "send_hex"}) {
    if (section.has(key)) section.fail(key, "given together with \"requests\"; expected one of them");
  }
  const auto within = read_ms(section, "within_ms", kTimeMs, PollRequest().within);
  for (const Section& request : section.objects("requests")) poll.requests.push_back(read_request(request, within));
  if (poll.requests.empty() || poll.requests.size() > kMostSteps)
    section.fail("requests", fmt::format("found {}, expected an array of 1 to {}", poll.requests.size(), kMostSteps));
  return poll;
}

}  // namespace

Commands Commands::with(const Commands& changes) const {
  Commands all = *this;
  if (changes.start) all.start = changes.start;
  if (changes.stop) all.stop = changes.stop;
  if (changes.again_when_silent) all.again_when_silent = changes.again_when_silent;
  if (changes.poll) all.poll = changes.poll;
  return all;
}

Commands read_commands(const Section& section) {
  Commands commands;
  commands.start = read_steps(section, "start");
  commands.stop = read_steps(section, "stop");
  if (section.has("again_when_silent")) commands.again_when_silent = section.boolean("again_when_silent");
  if (section.has("poll")) commands.poll = read_poll(section.object("poll"));
  return commands;
}

}  // namespace prism::wire
