// SPDX-License-Identifier: MIT
// JSON-RPC 2.0 over newline-delimited JSON: one line in, one line (or none, for a notification) out.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "config/socket_protocol.hpp"
#include "daemon/pipeline/interfaces.hpp"
#include "daemon/pipeline/statements.hpp"
#include "daemon/socket/answers.hpp"
#include "daemon/socket/client.hpp"

namespace prism::socket {

inline constexpr std::size_t kMaxRequestBytes = 65536;

using enum config::SocketError;

std::string rpc_error(const nlohmann::json& id, int code, const std::string& message,
                      const nlohmann::ordered_json* data = nullptr);

/// Handles requests.
class Rpc {
 public:
  using Done = std::function<void(Result<std::string>)>;

  struct Actions {
    /// Starts a reload and calls back with its result.
    std::function<void(Done)> reload;
    /// Sends bytes to the device of a line (0: the gyro's). Errors: not allowed, or not possible now. Null: a replay,
    /// which has no device.
    std::function<Result<void>(std::size_t line, std::span<const std::uint8_t> bytes)> send = nullptr;
    /// Sets the offset of an axis, or ends it (nullopt), and calls back with its text. Null: a replay.
    std::function<void(std::size_t axis, std::optional<pipeline::Offset>, Done)> set_offset = nullptr;
  };

  Rpc(const Sources& sources, Actions actions) : sources_(sources), actions_(std::move(actions)) {}

  /// Call after a sync of the log: new rows may be on the disk.
  void synced();

  /// Returns the requests in one line (without line end) of the client. If the line is invalid, sends an error and
  /// returns no request.
  static std::deque<nlohmann::json> take(const std::shared_ptr<Client>& client, std::string_view line);
  /// Handles one request. Some responses are sent later.
  void one(const std::shared_ptr<Client>& client, nlohmann::json request);

 private:
  struct Call;
  void dispatch(Call call);
  /// Sets the axes that the parameter "axis" selects. If it is invalid, sends an error and returns false.
  bool take_axes(Call& call);
  void change_subscription(const Call& call);
  void history(const Call& call);
  void events(const Call& call);
  void rows(const Call& call);
  boost::asio::awaitable<void> answer_rows(Call call, pipeline::RowQuery query, double wait_s);
  void reload(const Call& call);
  void offset(const Call& call);
  void send(const Call& call);

  const Sources sources_;
  const Actions actions_;
  std::vector<std::weak_ptr<boost::asio::steady_timer>> waiting_;  ///< requests at the end of the log
  std::uint64_t syncs_ = 0;
};

}  // namespace prism::socket
