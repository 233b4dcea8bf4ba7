// SPDX-License-Identifier: MIT
#include "drivers/wire/description/commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "base/json_table.hpp"

namespace prism::wire {
namespace {

constexpr std::size_t kMostSteps = 64, kMostSentBytes = 1024;
constexpr Range kTimeMs{1, 60'000}, kPauseMs{0, 60'000}, kPeriodMs{10, 3'600'000};

// "send": text, or "send_hex": bytes; none: unchanged.
void read_either(const Section& section, const std::string& text_key, std::size_t most, CommandBytes& bytes) {
  const std::string hex_key = text_key + "_hex";
  if (section.has(text_key) && section.has(hex_key))
    section.fail(hex_key, fmt::format("given together with \"{}\"; expected one of them", text_key));
  if (section.has(hex_key)) bytes = section.bytes(hex_key);
  if (section.has(text_key)) {
    const std::string text = section.raw_text(text_key);
    bytes.assign(text.begin(), text.end());
    if (text.empty()) section.fail(text_key, fmt::format("is empty, expected 1 to {} bytes", most));
  }
  if (bytes.size() > most) section.fail(text_key, fmt::format("has {} bytes, expected at most {}", bytes.size(), most));
}

// {"send": "READ?\r"}, or {"send_hex": "55 AA"} if a byte is not printable.
void print_either(const CommandBytes& bytes, const std::string& text_key, Json& json) {
  if (bytes.empty()) return;
  const bool is_text =
      std::all_of(bytes.begin(), bytes.end(), [](int c) { return (c >= 0x20 && c <= 0x7e) || c == '\r' || c == '\n'; });
  if (is_text)
    json[text_key] = std::string(bytes.begin(), bytes.end());
  else
    json[text_key + "_hex"] = fmt::format("{:02X}", fmt::join(bytes, " "));
}

template <class T>
void add_bytes(JsonTable<T>& keys, const std::string& key, CommandBytes T::*member, std::size_t most, const char* help,
               const char* hex_help) {
  const Json type = {{"type", "string"}};
  keys.custom(
      key.c_str(), type, help,
      [=](const Section& section, T& object) { read_either(section, key, most, object.*member); },
      [=](const T& object, Json& json) { print_either(object.*member, key, json); });
  keys.custom((key + "_hex").c_str(), type, hex_help, [](const Section&, T&) {}, nullptr);
}

template <class T>
void add_send(JsonTable<T>& keys) {
  add_bytes(keys, "send", &T::send, kMostSentBytes, "Text to send, with its line end: READ?\\r",
            "Bytes to send: 55 AA 01.");
}

JsonTable<Command> step_keys() {
  JsonTable<Command> keys;
  add_send(keys);
  add_bytes(keys, "expect", &Command::expect, kMostExpectedBytes, "", "Text or bytes that the answer contains.");
  return keys.integer("within_ms", kTimeMs, &Command::within, "Time limit of the answer.")
      .print_if([](const Command& step) { return !step.expect.empty(); })
      .integer("wait_ms", kPauseMs, &Command::wait, "A pause after sending.")
      .print_if([](const Command& step) { return step.expect.empty(); })
      .then([](const Section& section, Command& step) {
        const bool waits = section.has("wait_ms");
        if (step.send.empty() && step.expect.empty() && !waits)
          section.fail("", "found no command, expected \"send\", \"send_hex\", \"expect\" or \"wait_ms\"");
        if (waits && !step.expect.empty())
          section.fail("wait_ms", "given together with \"expect\"; expected a step of its own");
        if (section.has("within_ms") && step.expect.empty()) section.fail("within_ms", "given without \"expect\"");
      });
}

JsonTable<PollRequest> request_keys() {
  JsonTable<PollRequest> keys;
  add_send(keys);
  return keys.integer("within_ms", kTimeMs, &PollRequest::within, "Time limit of a reply.")
      .then([](const Section& section, PollRequest& request) {
        if (request.send.empty()) section.fail("", "found no request, expected \"send\" or \"send_hex\"");
      });
}

// The only request, or the common settings of several.
void read_requests(const Section& section, Poll& poll) {
  if (!section.has("requests")) return request_keys().read(section, poll.requests.emplace_back());
  for (const char* key : {"send", "send_hex"}) {
    if (section.has(key)) section.fail(key, "given together with \"requests\"; expected one of them");
  }
  if (poll.requests.empty() || poll.requests.size() > kMostSteps)
    section.fail("requests", fmt::format("found {}, expected an array of 1 to {}", poll.requests.size(), kMostSteps));
  if (!section.has("within_ms")) return;
  const std::chrono::milliseconds within(section.integer("within_ms", kTimeMs));
  const std::vector<Section> sections = section.objects("requests");
  for (std::size_t i = 0; i < sections.size(); ++i) {
    if (!sections[i].has("within_ms")) poll.requests[i].within = within;
  }
}

JsonTable<Poll> poll_keys() {
  JsonTable<Poll> keys;
  keys.integer("every_ms", kPeriodMs, &Poll::every, "Period.")
      .integer("pause_ms", kPauseMs, &Poll::pause, "Between a reply and the next request.");
  const JsonTable<PollRequest> request = request_keys();
  const Json only = request.schema();
  for (const auto& [key, schema] : only["properties"].items())  // read_requests() reads them
    keys.custom(
        key.c_str(), schema, "", [](const Section&, Poll&) {}, nullptr);
  return keys.list("requests", request, &Poll::requests, "Several requests in turn.").then(read_requests);
}

void check_steps(const Section& section, const char* key, const std::optional<std::vector<Command>>& steps) {
  if (steps && steps->size() > kMostSteps)
    section.fail(key, fmt::format("found {} steps, expected at most {}", steps->size(), kMostSteps));
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

const JsonTable<Commands>& command_keys() {
  static const JsonTable<Commands> keys =
      JsonTable<Commands>()
          .list("start", step_keys(), &Commands::start,
                "Commands to the device after each opening of the line, instead of the description's. An empty list "
                "sends "
                "nothing.")
          .boolean("again_when_silent", &Commands::again_when_silent,
                   "Sends the start-up commands again after silence_s without a frame.")
          .list("stop", step_keys(), &Commands::stop, "Commands at the end of prismd.")
          .object(
              "poll", poll_keys(), &Commands::poll,
              "Requests to a device that answers only when asked, instead of the description's: send or send_hex, or "
              "a list of requests.")
          .then([](const Section& section, Commands& commands) {
            check_steps(section, "start", commands.start);
            check_steps(section, "stop", commands.stop);
          });
  return keys;
}

}  // namespace prism::wire
