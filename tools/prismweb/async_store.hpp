// SPDX-License-Identifier: MIT
// Runs a period store on the disk thread, so that a blocked disk delays neither clients nor the watchdog.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/disk_thread.hpp"
#include "tools/prismweb/period_store.hpp"

namespace prism::prismweb {

/// The disk is reported as blocked after this time.
inline constexpr std::chrono::seconds kDiskTimeout{5};

/// Call from the thread of `io`, which also runs the callbacks. Only the disk thread accesses the store.
class AsyncStore {
 public:
  /// State of the store after an operation.
  struct Status {
    std::string cursor;  ///< after the last row included; empty: read the log from the start
    std::optional<std::int64_t> first_s, last_s;
    std::string problem;  ///< why the store cannot be opened or written, or was rebuilt; empty: none
    bool open = false;
  };
  /// Periods that begin within [from_s, to_s), in steps of `step_s`, a multiple of 60.
  struct Query {
    std::int64_t from_s, to_s, step_s;
  };
  struct Periods {
    std::vector<PeriodSummary> steps;
    std::optional<std::int64_t> last_s;  ///< last second in the store
  };
  using OnChange = std::function<void(const Status&)>;
  template <class T>
  using Answer = std::function<void(const Result<T>&)>;

  /// `io` and `disk` must outlive the store.
  AsyncStore(boost::asio::io_context& io, DiskThread& disk, std::string folder,
             std::chrono::milliseconds timeout = kDiskTimeout);

  /// Calls `on_change` after open(), push() and clear(), and after a damaged store was rebuilt.
  void open(OnChange on_change);
  /// Adds seconds between the cursors `from` and `to`. No effect if the store is not at `from`. Commits every second
  /// call, or every 20th while the store is built from the start of the log (`building`).
  void push(std::vector<PeriodSummary> seconds, const std::string& from, const std::string& to, bool building);
  void clear();
  /// Writes the pushed seconds to disk. Does not call `on_change`.
  void commit();

  /// These call `answer` exactly once. Errors: the disk did not respond within the timeout, the store is damaged or
  /// could not be opened. See PeriodStore for the results.
  void cursors_before(std::int64_t second, Answer<std::vector<std::string>> answer);
  void periods(const Query& query, Answer<Periods> answer);

 private:
  struct State;
  template <class Work>
  void run(Work work);
  template <class T, class Work>
  void run_query(Work work, Answer<T> answer);

  boost::asio::io_context& io_;
  DiskThread& disk_;
  std::chrono::milliseconds timeout_;
  OnChange on_change_;
  std::shared_ptr<State> state_;
};

}  // namespace prism::prismweb
