// SPDX-License-Identifier: MIT
// Answers to start-up commands and replies to polls of any bytes: a start-up ends in its time, a poller never sends
// more than it should. The first byte selects the description of the replies, the second the size of the chunks.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "drivers/commands.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace {

namespace wire = prism::wire;
using prism::drivers::Poller, prism::drivers::StartUp;
using std::chrono::milliseconds;

constexpr int kMostMs = 20'000;

std::vector<wire::FrameDescriptionPtr> polled() {
  std::vector<wire::FrameDescriptionPtr> all;
  for (const char* name : {"scpi-thermometer", "comwintop-8pt1000", "weiss-simcon32"}) {
    const std::string path = std::string(PRISM_SOURCE_DIR "/config/frames/") + name + ".json";
    std::ifstream in(path);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    wire::GyroChoice choice;
    choice.sensors = true;
    if (auto parsed = wire::parse_frame_description(text, path, choice)) all.push_back(*parsed);
  }
  if (all.size() != 3) std::abort();
  return all;
}

std::vector<wire::Command> steps() {
  return {{.send = {'A', '\r'}, .expect = {'O', 'K'}},
          {.send = {0x55}, .expect = {}, .wait = milliseconds(200)},
          {.send = {}, .expect = {0xFA, 0x31}, .within = milliseconds(500)}};
}

void start(std::span<const std::uint8_t> bytes, std::size_t chunk) {
  StartUp run(steps());
  int ms = 0, sends = 0;
  for (std::size_t at = 0; ms < kMostMs && !run.is_done() && !run.has_failed(); ms += 50) {
    while (!run.proceed(StartUp::Time() + milliseconds(ms)).empty()) ++sends;
    if (at < bytes.size()) run.received(bytes.subspan(at, std::min(chunk, bytes.size() - at)));
    at += chunk;
  }
  if (ms >= kMostMs || sends > 3 || run.text().size() > 250) std::abort();
}

void poll(const wire::FrameDescriptionPtr& description, std::span<const std::uint8_t> bytes, std::size_t chunk) {
  Poller poller(*description->commands.poll);
  wire::FrameDecoder decoder(description);
  std::vector<wire::DecodedMessage> messages;
  poller.begin(Poller::Time());
  for (int ms = 0; ms < kMostMs; ms += 50) {
    const auto now = Poller::Time() + milliseconds(ms);
    poller.proceed(now);
    const std::size_t at = static_cast<std::size_t>(ms / 50) * chunk;
    if (at >= bytes.size()) continue;
    decoder.feed(bytes.subspan(at, std::min(chunk, bytes.size() - at)), ms, messages);
    if (!messages.empty()) poller.replied(now);
    messages.clear();
  }
  const auto periods = static_cast<std::uint64_t>(milliseconds(kMostMs) / description->commands.poll->every);
  if (poller.counters().requests > periods || poller.counters().missed > poller.counters().requests) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<wire::FrameDescriptionPtr> kAll = polled();
  if (size < 2) return 0;
  const std::span<const std::uint8_t> bytes(data + 2, size - 2);
  const std::size_t chunk = 1u + data[1] % 64u;
  start(bytes, chunk);
  poll(kAll[data[0] % kAll.size()], bytes, chunk);
  return 0;
}
