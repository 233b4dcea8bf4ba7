// SPDX-License-Identifier: MIT
// What a fuzzer asks of a result: where it does not hold, the run ends there and the input is kept.
#pragma once

#include <cstdlib>

inline void require(bool holds) {
  if (!holds) std::abort();
}
