// SPDX-License-Identifier: MIT
// The tables of docs/benchmarks.md: simulated truths × profiles × methods, and the splits of a real recording.
// usage: bench_science simulated|passes|outliers|cycles|designs|intervals|siblings|cost|lag|rest|monitor FIRST-SEED
// COUNT | real RECORDING
#include <fmt/format.h>

#include <cstdlib>
#include <cstring>

#include "tests/bench/science/tables.hpp"

int main(int argc, char** argv) {
  using namespace prism::science;
  constexpr std::pair<const char*, int (*)(std::uint64_t, int)> kTables[] = {
      {"simulated", simulated}, {"passes", passes},   {"outliers", outliers},
      {"cycles", cycles},       {"designs", designs}, {"intervals", intervals},
      {"siblings", siblings},   {"cost", cost},       {"lag", lag},
      {"rest", rest},           {"monitor", monitor}};
  for (const auto& [name, table] : kTables) {
    if (argc != 4 || std::strcmp(argv[1], name) != 0) continue;
    const int count = std::atoi(argv[3]);
    if (count > 0) return table(std::strtoull(argv[2], nullptr, 10), count);
  }
  if (argc == 3 && std::strcmp(argv[1], "real") == 0) return real(argv[2]);
  fmt::print(stderr,
             "usage: bench_science simulated|passes|outliers|cycles|designs|intervals|siblings|cost|lag|rest|monitor "
             "FIRST-SEED COUNT | "
             "real RECORDING\n");
  return 64;
}
