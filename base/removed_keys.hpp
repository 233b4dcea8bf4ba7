// SPDX-License-Identifier: MIT
// Keys of the files of earlier versions that this version does not read. The one table for all programs.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace prism {

enum class KeyFile : std::uint8_t { kPrismd, kFrames, kWeb, kRelay, kCampaign };

struct RemovedKey {
  KeyFile file;
  std::string_view path;  ///< steps joined by '/'; "*" is any key or element, "**" none or several of them
  /// True if a file must not be used without this key: the key could change a number or close a door. Else the program
  /// warns and starts, because an upgrade must not end a recording.
  bool stops;
  std::string_view instead;  ///< the replacement, as the end of a sentence
};

std::span<const RemovedKey> removed_keys();

}  // namespace prism
