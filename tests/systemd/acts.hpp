// SPDX-License-Identifier: MIT
// The attempts of the probe: operations that prismd needs, and forbidden ones that an attacker in prismd's process
// would try.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace prism::test {

struct Act {
  std::string name;
  bool needed;                ///< prismd needs it; else it is forbidden
  std::function<long()> run;  ///< returns a negative value and sets errno if the kernel rejects it
};

/// No attempt harms a machine that permits it: dangerous system calls get invalid arguments.
std::vector<Act> acts();

}  // namespace prism::test
