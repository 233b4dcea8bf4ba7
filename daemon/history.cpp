// SPDX-License-Identifier: MIT
#include "daemon/history.hpp"

#include <algorithm>

#include "compensation/compensated_text.hpp"

namespace prism::daemon {

void History::add(const compensation::CompensatedWindow& row) {
  last_ = row;
  if (blocks_.empty() || blocks_.back()->begins.size() == kBlockRows) blocks_.push_back(std::make_shared<Block>());
  Block& block = *blocks_.back();
  block.begins.push_back(block.text.size());
  compensation::append_json(block.text, row);
  block.text += ',';
  if (blocks_.size() > kRows / kBlockRows + 1) blocks_.pop_front();
}

std::size_t History::size() const {
  if (blocks_.empty()) return 0;
  return std::min(kRows, (blocks_.size() - 1) * kBlockRows + blocks_.back()->begins.size());
}

std::vector<TextPart> History::json(std::size_t count) const {
  std::vector<TextPart> parts{TextPart("[")};
  const std::size_t wanted = std::min(count, size());
  std::size_t behind = blocks_.empty() ? 0 : (blocks_.size() - 1) * kBlockRows + blocks_.back()->begins.size();
  for (const std::shared_ptr<Block>& block : blocks_) {
    const std::size_t rows = block->begins.size();
    const std::size_t left_out = behind > wanted ? std::min(rows, behind - wanted) : 0;
    behind -= rows;
    if (left_out == rows) continue;
    const std::string_view text = std::string_view(block->text).substr(block->begins[left_out]);
    block == blocks_.back() ? parts.emplace_back(std::string(text.substr(0, text.size() - 1)))
                            : parts.emplace_back(std::shared_ptr<const void>(block), text);
  }
  parts.emplace_back("]");
  return parts;
}

}  // namespace prism::daemon
