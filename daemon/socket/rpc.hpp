// SPDX-License-Identifier: MIT
// JSON-RPC 2.0 over newline-delimited JSON: one line in, one line (or none, for a notification) out.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "config/socket_protocol.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/setup.hpp"
#include "daemon/socket/answers.hpp"
#include "daemon/socket/client.hpp"
#include "daemon/socket/sources.hpp"

namespace prism::socket {

// Requests for log pages, read on the disk thread. A request at the end of the log may wait for new rows.

/// Used on the live thread only. One request per client at a time.
class RowRequests {
 public:
  static constexpr double kLongestWait_s = 30;

  struct Request {
    std::shared_ptr<Client> client;
    pipeline::RowWriter* log;  ///< must outlive this
    pipeline::RowQuery query;
    double wait_s;  ///< max. wait for a first row, 0 to kLongestWait_s
    std::function<void(pipeline::RowResult)> answer;
  };

  /// Returns false without effect if a request of this client is pending.
  bool add(boost::asio::any_io_executor executor, Request request);
  /// Call after a sync: new rows may be on the disk.
  void synced();
  std::size_t waiting() const { return waiting_.size(); }

 private:
  struct Entry {
    Entry(boost::asio::any_io_executor on, Request asked)
        : request(std::move(asked)), executor(on), timer(std::move(on)), until(Client::Clock::now()) {}
    Request request;
    boost::asio::any_io_executor executor;
    boost::asio::steady_timer timer;
    Client::Clock::time_point until;
    bool reading = false, asked_again = false;
  };
  using Entries = std::list<std::shared_ptr<Entry>>;

  void read(const std::shared_ptr<Entry>& entry);
  void take(const std::shared_ptr<Entry>& entry, pipeline::RowResult page);
  void end(const std::shared_ptr<Entry>& entry, pipeline::RowResult page);

  Entries waiting_;
  const std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

// Parameters of the methods "send" and "rows", and counts. Errors are for the client.

/// Returns the integer parameter, 1 to max, or `otherwise` if it is missing; nullopt if it is invalid.
std::optional<std::size_t> count_param(const nlohmann::json& params, const char* key, std::size_t otherwise,
                                       std::size_t max);

struct SendParams {
  std::size_t line = 0;             ///< 0: the gyro's; sensor lines follow
  std::vector<std::uint8_t> bytes;  ///< 1 to 1024
};

/// Reads {"text": …} or {"hex": "55 AA"}, and "line", the name of a sensor line.
Result<SendParams> send_params(const nlohmann::json& params, const pipeline::Setup& setup);

/// Parameters of "rows" without the axis.
struct RowParams {
  pipeline::RowQuery query;
  double wait_s = 0;
};
Result<RowParams> row_params(const nlohmann::json& params);

inline constexpr std::size_t kMaxRequestBytes = 65536;
inline constexpr std::size_t kMaxBatch = 100;    ///< requests in one line
inline constexpr std::size_t kMaxValues = 2000;  ///< JSON values in one line, containers included

using enum config::SocketError;

std::string rpc_error(const nlohmann::json& id, int code, const std::string& message,
                      const nlohmann::ordered_json* data = nullptr);
std::string rpc_result(const nlohmann::json& id, nlohmann::ordered_json result);

/// Handles requests. `reload` starts a reload and calls back with its result.
class Rpc {
 public:
  using Reload = std::function<void(std::function<void(Result<std::string>)>)>;

  /// Sends bytes to the device of a line (0: the gyro's). Errors: not allowed, or not possible now.
  using Send = std::function<Result<void>(std::size_t line, std::span<const std::uint8_t> bytes)>;

  /// `publisher`: the one of `sources`; subscriptions change it.
  Rpc(const Sources& sources, Publisher& publisher, RowRequests& row_requests, Reload reload)
      : sources_(sources), publisher_(publisher), row_requests_(row_requests), reload_(std::move(reload)) {}

  /// Without this call, "send" fails: a replay has no device.
  void send_by(Send send) { send_ = std::move(send); }

  /// Returns the requests in one line (without line end) of the client. If the line is invalid, sends an error and
  /// returns no request.
  static std::deque<nlohmann::json> take(const std::shared_ptr<Client>& client, std::string_view line);
  /// Handles one request. Some responses are sent later.
  void one(const std::shared_ptr<Client>& client, nlohmann::json request);
  /// Handles all requests of a line at once.
  void request(const std::shared_ptr<Client>& client, std::string_view line);

 private:
  struct Call;
  void dispatch(const std::string& name, const Call& call);
  /// Returns the axes that the parameter "axis" selects (default: all). If it is invalid, sends an error and returns
  /// nullopt.
  std::optional<std::vector<std::size_t>> axes_of(const Call& call);
  void axis_answers(const Call& call, AxisAnswer answer);
  void subscribe(const Call& call);
  void unsubscribe(const Call& call);
  void change_subscription(const Call& call, bool on);
  void history(const Call& call);
  void events(const Call& call);
  void rows(const Call& call);
  void reload(const Call& call);
  void send(const Call& call);
  void reply(const Call& call, nlohmann::ordered_json result);
  void reply(const Call& call, std::vector<TextPart> result);
  void fail_count(const Call& call, const char* key, std::size_t most);
  void fail(const Call& call, int code, const std::string& message, const nlohmann::ordered_json* data = nullptr);

  const Sources sources_;
  Publisher& publisher_;
  RowRequests& row_requests_;
  Reload reload_;
  Send send_;
};

}  // namespace prism::socket
