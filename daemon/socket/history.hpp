// SPDX-License-Identifier: MIT
// The last hour of rows as JSON: written once, when a row happens, for notifications and for the answer to `history`.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/compensated.hpp"
#include "daemon/socket/client.hpp"

namespace prism::socket {

/// Rows stand in blocks that clients share while they are sent: an answer of an hour copies no more than the block that
/// still grows.
class History {
 public:
  static constexpr std::size_t kRows = 3600;

  /// `axis`: its name. Returns the row's JSON, which stands until the next call.
  std::string_view add(const compensation::CompensatedWindow& row, std::string_view axis);
  std::size_t size() const;
  bool empty() const { return blocks_.empty(); }

  /// The last `count` rows, or all there are, as one JSON array, oldest first, in parts to be sent one behind the
  /// other.
  std::vector<TextPart> json(std::size_t count) const;

 private:
  std::size_t kept() const;

  static constexpr std::size_t kBlockRows = 60;
  struct Block {
    std::string text;                 ///< each row followed by a comma
    std::vector<std::size_t> begins;  ///< where each row begins
  };
  std::deque<std::shared_ptr<Block>> blocks_;  ///< only the last one grows
};

}  // namespace prism::socket
