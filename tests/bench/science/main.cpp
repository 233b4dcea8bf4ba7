// SPDX-License-Identifier: MIT
// The tables of docs/science.md: simulated truths × profiles × methods, and the splits of a real recording.
// usage: bench_science simulated FIRST-SEED COUNT | intervals FIRST-SEED COUNT | real RECORDING
#include <fmt/format.h>

#include <cstdlib>
#include <cstring>

#include "tests/bench/science/tables.hpp"

int main(int argc, char** argv) {
  using namespace prism::science;
  const bool intervals_asked = argc == 4 && std::strcmp(argv[1], "intervals") == 0;
  if (argc == 4 && (intervals_asked || std::strcmp(argv[1], "simulated") == 0)) {
    const int count = std::atoi(argv[3]);
    const std::uint64_t seed = std::strtoull(argv[2], nullptr, 10);
    if (count > 0) return intervals_asked ? intervals(seed, count) : simulated(seed, count);
  }
  if (argc == 3 && std::strcmp(argv[1], "real") == 0) return real(argv[2]);
  fmt::print(stderr, "usage: bench_science simulated FIRST-SEED COUNT | intervals FIRST-SEED COUNT | real RECORDING\n");
  return 64;
}
