// SPDX-License-Identifier: MIT
// An assertion for fuzzers: ends the run on failure; libFuzzer then saves the input.
#pragma once

#include <cstdlib>

inline void require(bool holds) {
  if (!holds) std::abort();
}
