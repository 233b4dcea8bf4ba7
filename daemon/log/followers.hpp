// SPDX-License-Identifier: MIT
// Who follows a log by a name of its own, and how far each has come: kept on the disk, so that retention knows.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "daemon/log/disk_fault.hpp"
#include "daemon/log/segments.hpp"
#include "daemon/pipeline/log_writers.hpp"

namespace prism::log {

using pipeline::FollowerStatus, pipeline::RowCursor;

/// The user that a name was first taken by owns it; root may take any. Names that `keep_for` lists hold back retention,
/// from the beginning on: others lose what they have not fetched, which is counted and told.
///
/// Lives on the disk thread; status() may be called on any.
class Followers : public SegmentGuard {
 public:
  static constexpr std::size_t kMost = 64;

  /// `path` of the file that keeps them; what it holds of another log is forgotten with begin().
  Followers(std::string path, std::vector<std::string> keep_for, DiskFault::Tell tell);

  /// Where `name` has come to; nothing where it is new. Refused: it is another user's, or there are too many.
  Result<std::optional<RowCursor>> find(const std::string& name, std::uint32_t user);
  void remember(const std::string& name, std::uint32_t user, const RowCursor& after, std::int64_t time_s);
  /// Writes what changed since the last call.
  void save();

  bool holds(std::uint64_t segment, std::uint64_t rows) override;
  void deleted(std::uint64_t segment, std::uint64_t rows) override;

  std::map<std::string, FollowerStatus> status() const;

 private:
  void load();
  std::uint64_t unfetched(const FollowerStatus& follower, std::uint64_t segment, std::uint64_t rows) const;

  const std::string path_;
  const std::vector<std::string> keep_for_;
  const DiskFault::Tell tell_;
  mutable std::mutex mutex_;
  std::map<std::string, FollowerStatus> followers_;
  bool loaded_ = false, changed_ = false, held_ = false;
};

}  // namespace prism::log
