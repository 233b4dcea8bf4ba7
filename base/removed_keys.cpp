// SPDX-License-Identifier: MIT
#include "base/removed_keys.hpp"

#include <vector>

namespace prism {

std::span<const RemovedKey> removed_keys() {
  static const std::vector<RemovedKey> kKeys{
      // {file, path, stops, instead}
  };
  return kKeys;
}

}  // namespace prism
