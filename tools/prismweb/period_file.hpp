// SPDX-License-Identifier: MIT
// Periods on the disk: one file, records of 136 bytes, appended.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismweb/extremes.hpp"

namespace prism::prismweb {

/// A record, little-endian: int64 begin_s; double least and greatest of rate, corrected, bias, temperature, slope,
/// uhfo; float greatest sd, mean of rate and corrected; uint32 samples, missing; uint16 seconds, good, seconds in which
/// rate and corrected were known; uint32 CRC-32 of what stands before it.
inline constexpr std::size_t kRecordBytes = 136;

class PeriodFile {
 public:
  PeriodFile() = default;
  PeriodFile(PeriodFile&& other) noexcept;
  PeriodFile& operator=(PeriodFile&& other) noexcept;
  ~PeriodFile();

  /// Opens or makes it with its first `records`; what stands behind them was never acknowledged and is cut off. Refused
  /// where there are fewer, or one is damaged.
  static Result<PeriodFile> open(const std::string& path, std::uint64_t records);

  Result<void> append(std::span<const Extremes> periods);
  Result<void> sync();
  std::uint64_t records() const { return held_.records; }

  /// What it holds; after back_to() what was appended since is written over.
  struct Mark {
    std::uint64_t records = 0;
    bool in_order = true;  ///< else a clock was set back, and all of it must be looked at
    std::int64_t last_begin_s = INT64_MIN;
  };
  const Mark& mark() const { return held_; }
  void back_to(const Mark& mark) { held_ = mark; }

  /// Those whose begin is within [from_s, to_s), in the order in which they were written.
  std::vector<Extremes> read(std::int64_t from_s, std::int64_t to_s) const;

 private:
  Result<void> look_through();
  void note(std::int64_t begin_s);
  std::int64_t begin_of(std::uint64_t record) const;

  int fd_ = -1;
  std::string path_;
  Mark held_;
};

}  // namespace prism::prismweb
