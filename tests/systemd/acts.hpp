// SPDX-License-Identifier: MIT
// The acts that the probe tries: those that a prismd taken over by an attacker would want, and those that prismd lives
// on.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace prism::test {

struct Act {
  std::string name;
  bool needed;                ///< prismd lives on it; else it is forbidden
  std::function<long()> run;  ///< negative with errno set: the kernel's answer
};

/// Nothing in the list harms a machine that lets it through: what would is called with arguments that cannot be served.
std::vector<Act> acts();

}  // namespace prism::test
