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
#include "tools/prismweb/store.hpp"

namespace prism::prismweb {

/// How long a disk may take before it is said to hang.
inline constexpr std::chrono::seconds kDiskPatience{5};

/// What serves asks, and is told on the context's thread; the store itself is touched by the disk's thread alone.
class StoreKeeper {
 public:
  /// Of the store, when it was asked.
  struct Known {
    std::string cursor;
    std::optional<std::int64_t> first_s, last_s;
    std::string trouble;  ///< why it cannot be opened or kept, or began anew; empty where nothing is to be said
    bool open = false;
  };
  /// Begins within [from_s, to_s), by hours or minutes, joined by steps of `step_s`.
  struct Query {
    std::int64_t from_s, to_s, step_s;
    bool by_hours;
  };
  struct Periods {
    std::vector<Extremes> steps;
    std::optional<std::int64_t> last_s;  ///< of the store's seconds: what follows is not in them
  };
  using Told = std::function<void(const Known&)>;
  template <class T>
  using Answer = std::function<void(const Result<T>&)>;

  /// `io` and `disk` outlive it.
  StoreKeeper(boost::asio::io_context& io, DiskThread& disk, std::string folder,
              std::chrono::milliseconds patience = kDiskPatience);

  /// Each is told once, when the disk has done it.
  void open(Told told);
  /// Takes seconds that end at `cursor`. They are kept at once where a minute ended, and while the log is read from its
  /// beginning (`building`) every so many pages.
  void take(std::vector<Extremes> seconds, const std::string& cursor, bool building, Told told);
  void clear(Told told);
  /// Keeps what was taken up to `cursor`; nobody is told.
  void keep(const std::string& cursor);

  /// Each is answered once; refused where the disk has not answered within the patience.
  /// Store::cursors_before.
  void cursors_before(std::int64_t second, Answer<std::vector<std::string>> answer);
  void periods(const Query& query, Answer<Periods> answer);

 private:
  struct Kept;
  template <class Work>
  void run(Work work, Told told);
  template <class T, class Work>
  void ask(Work work, Answer<T> answer);

  boost::asio::io_context& io_;
  DiskThread& disk_;
  std::chrono::milliseconds patience_;
  std::shared_ptr<Kept> kept_;
};

}  // namespace prism::prismweb
