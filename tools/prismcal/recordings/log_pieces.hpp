// SPDX-License-Identifier: MIT
// A log segment in pieces of complete lines: read by one thread, hashed by several.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/result.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/tables/read_meter.hpp"

namespace prism::recordings {

inline constexpr std::size_t kPieceBytes = 1u << 19;

/// Complete lines of a file.
struct Piece {
  std::vector<char> bytes;
  std::size_t first = 0, size = 0;  ///< of the bytes that are the lines
  std::size_t begin = 0;            ///< offset of the first line in the file
  std::size_t number = 0;           ///< of the piece in the file, from 0
  Sha256 before;                    ///< hash of all bytes before the first line

  std::string_view text() const { return std::string_view(bytes.data(), size).substr(first); }
};

/// The hash of a file, whose pieces are added by several threads in their order.
class FileHash {
 public:
  /// Waits until the pieces before this one are added, and sets Piece::before. `first` bytes of it precede its lines.
  void add(Piece& piece) {
    std::unique_lock lock(mutex_);
    added_.wait(lock, [&] { return pieces_ == piece.number; });
    hash_.add({piece.bytes.data(), piece.first});
    piece.before = hash_;
    hash_.add(piece.text());
    ++pieces_;
    added_.notify_all();
  }
  /// For the bytes after all pieces.
  void add(std::string_view bytes) { hash_.add(bytes); }
  std::string hex() const { return hash_.hex(); }

 private:
  std::mutex mutex_;
  std::condition_variable added_;
  std::size_t pieces_ = 0;
  Sha256 hash_;
};

/// Reads a file in pieces that end with a line.
class PieceReader {
 public:
  PieceReader(FileReader in, tables::ReadMeter& meter) : in_(std::move(in)), meter_(meter) {}

  /// The next lines; the first piece has at least `least` bytes. Returns false if no complete line is left.
  bool next(Piece& piece, std::size_t least) {
    std::size_t filled = rest_.size(), end = std::string::npos;
    piece.bytes.resize(std::max(piece.bytes.size(), filled + kPieceBytes));
    std::copy(rest_.begin(), rest_.end(), piece.bytes.begin());
    while (end == std::string::npos || end + 1 < least) {
      piece.bytes.resize(std::max(piece.bytes.size(), filled + kPieceBytes));
      const std::size_t got = in_.read(std::span(piece.bytes).subspan(filled, kPieceBytes));
      filled += got;
      meter_.add_bytes(got);
      if (got == 0) break;
      end = std::string_view(piece.bytes.data(), filled).rfind('\n');
    }
    piece.first = 0;
    piece.size = end == std::string::npos ? 0 : end + 1;
    rest_.assign(piece.bytes.data() + piece.size, filled - piece.size);
    if (piece.size == 0) return false;
    piece.begin = begin_;
    piece.number = pieces_++;
    begin_ += piece.size;
    return true;
  }
  /// Reads and hashes all bytes that are left.
  void finish(FileHash& hash) {
    for (Piece piece; next(piece, 0);) hash.add(piece.text());
    hash.add(rest_);
    begin_ += rest_.size();
    rest_.clear();
  }
  std::size_t bytes() const { return begin_; }  ///< in all pieces, and after finish() in the file
  const std::optional<Error>& error() const { return in_.error(); }

 private:
  FileReader in_;
  tables::ReadMeter& meter_;
  std::string rest_;
  std::size_t begin_ = 0, pieces_ = 0;
};

}  // namespace prism::recordings
