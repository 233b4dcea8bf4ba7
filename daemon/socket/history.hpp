// SPDX-License-Identifier: MIT
// The rows of the last hour as JSON, written once for notifications and for `history`.
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

/// Rows are stored in blocks that send queues share: a response of an hour copies only the last block.
class History {
 public:
  static constexpr std::size_t kRows = 3600;

  /// `axis`: name of the axis. Returns the row's JSON, valid until the next call.
  std::string_view add(const compensation::CompensatedWindow& row, std::string_view axis);
  std::size_t size() const;
  bool empty() const { return blocks_.empty(); }

  /// Returns the last `count` rows, or all if there are fewer, as a JSON array in consecutive parts, oldest first.
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
