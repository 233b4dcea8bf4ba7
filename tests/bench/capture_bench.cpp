// SPDX-License-Identifier: MIT
// Captures and the simulated gyro: time to write, read and generate one small packet.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <fstream>
#include <iterator>

#include "drivers/capture_file.hpp"
#include "tools/prismsim/simulation/simulated_line.hpp"

namespace prism::bench {
namespace {

constexpr const char* kFile = "bench_capture.pcap";
constexpr int kPackets = 1'000'000;

bool write_capture() {
  auto writer = drivers::CaptureWriter::open(kFile);
  const std::vector<std::uint8_t> frame(20, 0x5A);
  for (int i = 0; writer && i < kPackets; ++i) {
    if (!writer->data(std::int64_t{i} * 5'000'000, frame)) return false;
  }
  return writer && writer->flush();
}

void write_packets(benchmark::State& state) {
  for (auto _ : state) {
    if (!write_capture()) return state.SkipWithError("cannot write the capture");
  }
  state.SetItemsProcessed(state.iterations() * kPackets);
  std::remove(kFile);
}
BENCHMARK(write_packets)->Unit(benchmark::kMillisecond);

void read_packets(benchmark::State& state) {
  if (!write_capture()) return state.SkipWithError("cannot write the capture");
  for (auto _ : state) {
    auto reader = drivers::CaptureReader::open(kFile);
    std::size_t bytes = 0;
    while (const auto packet = reader->next()) bytes += packet->bytes.size();
    benchmark::DoNotOptimize(bytes);
  }
  state.SetItemsProcessed(state.iterations() * kPackets);
  std::remove(kFile);
}
BENCHMARK(read_packets)->Unit(benchmark::kMillisecond);

void make_frames(benchmark::State& state) {
  const std::string path = std::string(PRISM_SOURCE_DIR) + "/config/frames/trplg.json";
  std::ifstream in(path);
  const auto frames = wire::parse_frame_description(std::string(std::istreambuf_iterator<char>(in), {}), path);
  if (!frames) return state.SkipWithError(frames.error().text().c_str());
  simulation::SimulatedLine line(*frames, {});
  std::vector<std::uint8_t> bytes;
  for (auto _ : state) {
    bytes.clear();
    line.next_frame(bytes);
    benchmark::DoNotOptimize(bytes.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(make_frames);

}  // namespace
}  // namespace prism::bench

BENCHMARK_MAIN();
