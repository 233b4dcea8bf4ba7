// SPDX-License-Identifier: MIT
#include "daemon/socket/history.hpp"

#include <algorithm>

#include "daemon/socket/row_text.hpp"

namespace prism::socket {

std::string_view History::add(const compensation::CompensatedWindow& row, std::string_view axis) {
  if (blocks_.empty() || blocks_.back()->begins.size() == kBlockRows) blocks_.push_back(std::make_shared<Block>());
  Block& block = *blocks_.back();
  block.begins.push_back(block.text.size());
  append_row(block.text, axis, row);
  block.text += ',';
  if (blocks_.size() > kRows / kBlockRows + 1) blocks_.pop_front();
  return std::string_view(block.text).substr(block.begins.back(), block.text.size() - 1 - block.begins.back());
}

std::size_t History::kept() const {
  return blocks_.empty() ? 0 : (blocks_.size() - 1) * kBlockRows + blocks_.back()->begins.size();
}

std::size_t History::size() const { return std::min(kRows, kept()); }

std::vector<TextPart> History::json(std::size_t count) const {
  std::vector<TextPart> parts{TextPart("[")};
  std::size_t skip = kept() - std::min(count, size());
  for (const std::shared_ptr<Block>& block : blocks_) {
    const std::size_t rows = block->begins.size();
    const std::size_t skipped = std::min(rows, skip);
    skip -= skipped;
    if (skipped == rows) continue;
    const std::string_view text = std::string_view(block->text).substr(block->begins[skipped]);
    block == blocks_.back() ? parts.emplace_back(std::string(text.substr(0, text.size() - 1)))
                            : parts.emplace_back(std::shared_ptr<const void>(block), text);
  }
  parts.emplace_back("]");
  return parts;
}

}  // namespace prism::socket
