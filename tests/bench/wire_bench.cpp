// SPDX-License-Identifier: MIT
// Speed of the frame decoder on one core: decoding, encoding and time stamping of shipped descriptions, and random
// bytes.
// bench_wire FRAMES_DIR [NAME ...]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"

namespace {

namespace wire = prism::wire;

using prism::wire::DecodedMessage;
using prism::wire::FrameDescriptionPtr;
using Bytes = std::vector<std::uint8_t>;

constexpr int kFrames = 20'000;  // about 1 MB, so that memory speed does not matter
constexpr std::size_t kChunkBytes = 4096;
constexpr int kRounds = 60;

wire::FrameDescriptionPtr load(const std::string& path) {
  std::ifstream in(path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  auto parsed = prism::wire::parse_frame_description(text, path);
  if (!parsed) std::fprintf(stderr, "%s\n", parsed.error().text().c_str()), std::exit(1);
  return *parsed;
}

/// Seconds of the fastest round.
template <class Work>
double fastest(Work work) {
  double best = 1e9;
  for (int round = 0; round < kRounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

Bytes encoded(const wire::FrameDescriptionPtr& description) {
  prism::wire::FrameEncoder encoder(description);
  Bytes bytes;
  for (int i = 0; i < kFrames; ++i) {
    encoder.encode({.rate_deg_per_h = {8.4652},
                    .interval_s = description->period_s(),
                    .temperature_degc = 25 + 1e-6 * i,
                    .uhfo_v = 5.3},
                   bytes);
  }
  return bytes;
}

template <class Take>
void feed_all(prism::wire::FrameDecoder& decoder, const Bytes& bytes, std::vector<wire::DecodedMessage>& out,
              Take take) {
  static std::int64_t arrival_ns = 0;
  const double byte_ns = decoder.description().wire.byte_time_ns();
  for (std::size_t at = 0; at < bytes.size(); at += kChunkBytes) {
    const std::size_t size = std::min(kChunkBytes, bytes.size() - at);
    arrival_ns += static_cast<std::int64_t>(byte_ns * static_cast<double>(size));
    out.clear();
    decoder.feed({bytes.data() + at, size}, arrival_ns, out);
    for (const wire::DecodedMessage& reading : out) take(reading);
  }
}

void measure(const std::string& dir, const std::string& name) {
  const wire::FrameDescriptionPtr description = load(dir + "/" + name + ".json");
  const Bytes bytes = encoded(description);
  std::vector<wire::DecodedMessage> out;
  out.reserve(4096);
  prism::wire::FrameDecoder decoder(description);
  std::size_t frames = 0;
  const double decode_s =
      fastest([&] { feed_all(decoder, bytes, out, [&](const wire::DecodedMessage&) { ++frames; }); });
  prism::drivers::Clock clock(description, {.source = prism::drivers::ClockSource::kDevice});
  double sum = 0;
  const double clock_s = fastest([&] {
    feed_all(decoder, bytes, out, [&](const wire::DecodedMessage& reading) {
      if (!clock.push(reading)) return;
      if (const auto sample = clock.sample(reading, 0)) sum += sample->interval_s;
    });
  });
  const double encode_s = fastest([&] { frames += encoded(description).size(); });
  std::printf("%-18s %8.2f %8.0f %12.2f %10.2f\n", name.c_str(), kFrames / decode_s / 1e6,
              static_cast<double>(bytes.size()) / decode_s / 1e6, kFrames / clock_s / 1e6, kFrames / encode_s / 1e6);
  if (frames == 0 || !(sum >= 0)) std::exit(1);
}

void measure_garbage(const std::string& dir, const std::string& name) {
  const wire::FrameDescriptionPtr description = load(dir + "/" + name + ".json");
  std::mt19937 random(7);
  Bytes bytes(1'000'000);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  prism::wire::FrameDecoder decoder(description);
  std::vector<wire::DecodedMessage> out;
  const double seconds = fastest([&] { feed_all(decoder, bytes, out, [](const wire::DecodedMessage&) {}); });
  std::printf("%-18s %17.0f\n", name.c_str(), static_cast<double>(bytes.size()) / seconds / 1e6);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: bench_wire FRAMES_DIR [NAME ...]\n"), 64;
  std::vector<std::string> names(argv + 2, argv + argc);
  if (names.empty()) names = {"trplg", "trplg-increment", "kvh1750", "stim300", "xor7-10", "xsens-mtdata2"};
  std::printf("%-18s %8s %8s %12s %10s\n%-18s %8s %8s %12s %10s\n", "frames", "decode", "", "and stamp", "encode", "",
              "M/s", "MB/s", "M/s", "M/s");
  for (const std::string& name : names) measure(argv[1], name);
  std::printf("\n%-18s %17s\n", "random bytes", "MB/s");
  for (const std::string& name : names) measure_garbage(argv[1], name);
  return 0;
}
