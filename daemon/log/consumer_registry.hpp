// SPDX-License-Identifier: MIT
// Named consumers of a log and their cursors, stored on disk and used by retention.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "daemon/log/segments.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/notice.hpp"

namespace prism::log {

using pipeline::FollowerStatus, pipeline::RowCursor;

/// The first user of a name owns it; root may use any name. Segments that a name in `keep_for` has not fetched are not
/// deleted (also before its first request). Other consumers hold them up to a limit (retention.hpp); after that they
/// lose these rows, and the loss is counted and reported.
///
/// Used on the disk thread only; status() is thread-safe.
class ConsumerRegistry : public SegmentGuard {
 public:
  static constexpr std::size_t kMost = 64;

  /// `path`: of the file with the cursors.
  ConsumerRegistry(std::string path, std::vector<std::string> keep_for, pipeline::Tell tell);

  /// Returns the cursor of `name`, nullopt if it is new. Errors: the name belongs to another user; too many names.
  Result<std::optional<RowCursor>> find(const std::string& name, std::uint32_t user);
  void remember(const std::string& name, std::uint32_t user, const RowCursor& after, std::int64_t time_s);
  /// Writes the file if it changed since the last call.
  void save();

  std::optional<Hold> holder(std::uint64_t segment, std::uint64_t rows) override;
  void deleted(std::uint64_t segment, std::uint64_t rows) override;

  std::map<std::string, FollowerStatus> status() const;

 private:
  void load();
  std::uint64_t unfetched(const FollowerStatus& follower, std::uint64_t segment, std::uint64_t rows) const;

  const std::string path_;
  const std::vector<std::string> keep_for_;
  const pipeline::Tell tell_;
  mutable std::mutex mutex_;
  std::map<std::string, FollowerStatus> followers_;
  bool loaded_ = false, changed_ = false;
};

}  // namespace prism::log
