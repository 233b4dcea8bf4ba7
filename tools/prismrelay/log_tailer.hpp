// SPDX-License-Identifier: MIT
// One axis' log, followed by cursor: at most one page is on its way, from the question to the commit.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "tools/prismrelay/batch.hpp"
#include "tools/prismrelay/line_client.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

class LogTailer;

/// What followers share: the batch that is gathered, and how much may be on its way at once.
struct RowTraffic {
  Batch* batch = nullptr;
  RelayState* state = nullptr;
  std::string follower;                 ///< the name that prismd remembers us by
  std::function<void()> gathered;       ///< something is in the batch
  std::function<void()> freed;          ///< another large page may be asked for
  bool open = false;                    ///< the ledger takes rows
  int large = 0;                        ///< large pages on their way
  static constexpr int kLargeMax = 24;  // of 256 KiB: what a thousand that lag behind may hold of our memory
};

class LogTailer : public std::enable_shared_from_this<LogTailer> {
 public:
  using Gone = std::function<void(const std::string& why)>;

  /// `axis_asked`: of a device of several axes, else empty.
  LogTailer(boost::asio::io_context& context, RowTraffic& traffic, LogKey log, std::string axis_asked);

  void open(const std::string& socket, Gone gone);
  void close();
  /// Where the ledger has come to; from there on.
  void resume(const std::string& cursor);
  /// What was gathered is in the ledger, or is not.
  void committed();
  void dropped();
  /// Asks, where it may and does not already.
  void ask();

  const LogKey& log() const { return log_; }
  bool lags() const { return lags_; }
  /// A prismd that owes an answer for so long stands still.
  bool is_unresponsive(std::chrono::steady_clock::time_point now) const;

 private:
  void answer(const nlohmann::json& message);
  void refused(const nlohmann::json& error);
  /// Shows why no rows come, and asks again later.
  void fail(const std::string& why);
  void release_slot();

  RowTraffic& traffic_;
  const LogKey log_;
  const std::string axis_asked_;
  std::shared_ptr<LineClient> client_;
  std::string cursor_, next_cursor_;
  double next_arrival_s_ = 0;
  std::size_t next_rows_ = 0, next_refused_ = 0;
  std::uint64_t next_missing_ = 0;
  std::string next_why_;
  std::chrono::steady_clock::time_point requested_at_, retry_at_;
  bool asking_ = false, gathered_ = false, lags_ = true, large_ = false, next_more_ = false;
};

}  // namespace prism::prismrelay
