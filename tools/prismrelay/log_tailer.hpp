// SPDX-License-Identifier: MIT
// Reads the log of one axis by cursor. At most one page is in progress, from its request to its commit.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "tools/client/async_connection.hpp"
#include "tools/client/response.hpp"
#include "tools/prismrelay/batch.hpp"
#include "tools/prismrelay/divided_commit.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

class LogTailer;

/// State that all log tailers share: the current batch, and the limit of large pages. The functions are called within
/// the tailers' member functions.
struct RowTraffic {
  Batch* batch = nullptr;
  RelayState* state = nullptr;
  std::function<void()> batch_extended;  ///< called after an addition to the batch
  std::function<void()> slot_released;   ///< another large page may be requested; must post its calls of request_page()
  bool database_up = false;
  int large = 0;                        ///< large pages in progress
  static constexpr int kMaxLarge = 24;  // of 256 KiB: limits the memory if a thousand logs are behind
};

/// Create with std::make_shared; use only on the thread of `context`. `traffic` must outlive it.
class LogTailer : public std::enable_shared_from_this<LogTailer> {
 public:
  LogTailer(boost::asio::io_context& context, RowTraffic& traffic, LogKey log);

  /// Connects to prismd. Failures are reported by `on_disconnect` only.
  void open(const std::string& socket, client::AsyncConnection::OnEnd on_disconnect);
  /// Ends the connection and its request. A page in the batch stays in it.
  void close();
  /// Continues after `cursor`, the one in the database; from the start of the log if it is empty. The response to an
  /// earlier request is ignored.
  void resume(const std::string& cursor);
  /// The batch was committed: stores the cursor, requests the next page. `refusal`: the part of the page that the
  /// server refused; if it refused the cursor, the page is requested again after 5 s.
  void committed(const Refusal& refusal = {});
  /// The batch was lost: resume() must follow.
  void discarded();
  /// Requests the next page if the database is connected, resume() was called, the connection is open, no page is in
  /// progress, the last error is 5 s ago, and, for a large page, fewer than kMaxLarge are in progress.
  void request_page();
  /// Asks prismd how far the log is behind while the database is down. Call about once a minute.
  void check_retention();

  const LogKey& log() const { return log_; }
  /// Returns true if prismd has not responded to a request for 40 s.
  bool is_unresponsive(std::chrono::steady_clock::time_point now) const;

 private:
  void on_response(std::uint64_t generation, std::string_view response_text);
  void on_error(const client::RequestError& error);
  /// Reports the reason; request_page() does nothing for 5 s.
  void fail(const std::string& reason);
  void log_refusal(const Refusal& refusal);
  /// Warns if more than half of the rows that prismd keeps are not in the database, and it deletes rows.
  void watch_retention(const nlohmann::json& page);
  void release_slot();

  RowTraffic& traffic_;
  const LogKey log_;
  std::shared_ptr<client::AsyncConnection> client_;
  std::string cursor_;            ///< after the last committed row
  PageSummary page_;              ///< the page in the batch
  std::uint64_t generation_ = 0;  ///< number of calls of resume()
  std::chrono::steady_clock::time_point requested_at_, retry_at_;
  std::chrono::steady_clock::time_point refusal_logged_at_;
  std::size_t unlogged_refusals_ = 0;
  bool requested_ = false, in_batch_ = false, is_behind_ = true, has_slot_ = false;
  bool is_late_ = false;        ///< as reported by watch_retention()
  bool many_refusals_ = false;  ///< then the next page is small, until a page without a refused row
};

}  // namespace prism::prismrelay
