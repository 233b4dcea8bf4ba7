// SPDX-License-Identifier: MIT
// Time stamps of the rows of a table, for a year and more of rows: mostly one to four bytes a stamp, without a loss.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/prismcal/recordings/packed_bits.hpp"

namespace prism::recordings {

/// Any integers. Those of 4096 neighbours are stored as differences from a line, of as many bits as their range needs.
class PackedStamps {
 public:
  PackedStamps() = default;
  explicit PackedStamps(std::span<const std::int64_t> stamps) { push(stamps); }

  void push(std::int64_t stamp);
  void push(std::span<const std::int64_t> stamps) {
    for (const std::int64_t stamp : stamps) push(stamp);
  }
  std::size_t size() const { return blocks_.size() * kBlock + open_.size(); }
  bool empty() const { return size() == 0; }
  /// index < size().
  std::int64_t operator[](std::size_t index) const {
    const std::size_t block = index / kBlock;
    return block < blocks_.size() ? blocks_[block][index % kBlock] : open_[index % kBlock];
  }
  std::int64_t front() const { return (*this)[0]; }          ///< requires !empty()
  std::int64_t back() const { return (*this)[size() - 1]; }  ///< requires !empty()

  /// Calls visit(index, stamp) for begin <= index < end in order, end <= size(): faster than by index.
  template <class Visit>
  void for_each(std::size_t begin, std::size_t end, Visit&& visit) const {
    while (begin < end) {
      const std::size_t block = begin / kBlock, until = std::min(end, (block + 1) * kBlock);
      if (block < blocks_.size()) {
        const Block& packed = blocks_[block];
        for (; begin < until; ++begin) visit(begin, packed[begin % kBlock]);
      } else {
        for (; begin < until; ++begin) visit(begin, open_[begin % kBlock]);
      }
    }
  }

 private:
  static constexpr std::size_t kBlock = 4096;
  /// In unsigned integers, whose overflow is defined.
  struct Block {
    explicit Block(const std::vector<std::int64_t>& stamps);
    std::int64_t operator[](std::size_t i) const { return static_cast<std::int64_t>(base + step * i + differences[i]); }
    std::uint64_t base = 0, step = 0;
    PackedBits differences;
  };

  std::vector<Block> blocks_;       ///< all of kBlock stamps
  std::vector<std::int64_t> open_;  ///< the stamps after them
};

/// Calls visit(i, step) for the step from stamp i - 1 to stamp i. Requires !empty().
template <class Visit>
void for_each_step(const PackedStamps& stamps, Visit&& visit) {
  std::int64_t before = stamps.front();
  stamps.for_each(1, stamps.size(), [&](std::size_t i, std::int64_t stamp) {
    visit(i, stamp - before);
    before = stamp;
  });
}

}  // namespace prism::recordings
