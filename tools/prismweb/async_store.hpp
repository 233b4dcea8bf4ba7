// SPDX-License-Identifier: MIT
// A store behind the disk's thread: a disk that hangs holds up neither a client nor the watchdog.
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

/// How long a disk may take before it is said to hang.
inline constexpr std::chrono::seconds kDiskTimeout{5};

/// What serves asks, and is told on the context's thread; the store itself is touched by the disk's thread alone.
class AsyncStore {
 public:
  /// Of the store, when it was asked.
  struct Known {
    std::string cursor;  ///< behind what it was given; empty: the log is to be read from its beginning
    std::optional<std::int64_t> first_s, last_s;
    std::string trouble;  ///< why it cannot be opened or kept, or began anew; empty where nothing is to be said
    bool open = false;
  };
  /// Begins within [from_s, to_s), joined by steps of `step_s`, a multiple of 60.
  struct Query {
    std::int64_t from_s, to_s, step_s;
  };
  struct Periods {
    std::vector<PeriodSummary> steps;
    std::optional<std::int64_t> last_s;  ///< of the store's seconds: what follows is not in them
  };
  using OnChange = std::function<void(const Known&)>;
  template <class T>
  using Answer = std::function<void(const Result<T>&)>;

  /// `io` and `disk` outlive it.
  AsyncStore(boost::asio::io_context& io, DiskThread& disk, std::string folder,
             std::chrono::milliseconds timeout = kDiskTimeout);

  /// `told` is called when the disk has done this, or take() or clear(), and when a damaged store was begun anew.
  void open(OnChange on_change);
  /// Takes seconds that follow the cursor `from` and end at `to`; without effect if the store is not at `from`. They
  /// are kept every second time, and while the log is read from its beginning (`building`) every so many times.
  void take(std::vector<PeriodSummary> seconds, const std::string& from, const std::string& to, bool building);
  void clear();
  /// Keeps what was taken; `told` is not called.
  void keep();

  /// Each is answered once; refused where the disk has not answered within the patience, and where the store is
  /// damaged. Store::cursors_before.
  void cursors_before(std::int64_t second, Answer<std::vector<std::string>> answer);
  void periods(const Query& query, Answer<Periods> answer);

 private:
  struct Kept;
  template <class Work>
  void run(Work work);
  template <class T, class Work>
  void ask(Work work, Answer<T> answer);

  boost::asio::io_context& io_;
  DiskThread& disk_;
  std::chrono::milliseconds timeout_;
  OnChange on_change_;
  std::shared_ptr<Kept> kept_;
};

}  // namespace prism::prismweb
