// SPDX-License-Identifier: MIT
// One word for the state of an instance, and what is wrong.
#pragma once

#include <string>
#include <vector>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

struct Health {
  enum class Level { kGood, kCaution, kFailed };

  Level level = Level::kGood;
  std::vector<std::string> problems;  ///< one line each, the failures first; empty if good
};

/// Good only if data, corrections, model, log, capture and disk are. Failed: something is lost or must not be used.
Health health_of(const Sources& sources);

/// "good", "caution" or "failed".
const char* health_name(Health::Level level);

}  // namespace prism::socket
