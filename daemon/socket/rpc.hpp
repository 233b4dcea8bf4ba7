// SPDX-License-Identifier: MIT
// JSON-RPC 2.0 over newline-delimited JSON: one line in, one line (or none, for a notification) out.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "daemon/socket/client.hpp"
#include "daemon/socket/row_requests.hpp"
#include "daemon/socket/sources.hpp"

namespace prism::socket {

inline constexpr std::size_t kMaxRequestBytes = 65536;
inline constexpr std::size_t kMaxBatch = 100;    ///< requests in one line
inline constexpr std::size_t kMaxValues = 2000;  ///< JSON values in it, containers too

enum RpcCode {
  kParseError = -32700,
  kInvalidRequest = -32600,
  kMethodNotFound = -32601,
  kInvalidParams = -32602,
  kRefused = -32000,        ///< the daemon understood and says no: data of a failed reload, a full table
  kNotPermitted = -32001,   ///< the peer may not change things
  kForeignCursor = -32002,  ///< of another log, or beyond the end of this one
};

std::string rpc_error(const nlohmann::json& id, int code, const std::string& message);
std::string rpc_result(const nlohmann::json& id, const nlohmann::ordered_json& result);

/// Answers the requests of one client. `reload` starts a reload and calls back with its outcome when it is done.
class Rpc {
 public:
  using Reload = std::function<void(std::function<void(Result<std::string>)>)>;

  /// `publisher` is that of the sources; a subscription changes what it sends.
  Rpc(const Sources& sources, Publisher& publisher, RowRequests& row_requests, Reload reload)
      : sources_(sources), publisher_(publisher), row_requests_(row_requests), reload_(std::move(reload)) {}

  /// The requests in one line of the client, without its line end. Where it holds none, that is answered here.
  static std::deque<nlohmann::json> take(const std::shared_ptr<Client>& client, std::string_view line);
  /// Answers one of them. Every answer goes to the client, some later than others.
  void one(const std::shared_ptr<Client>& client, const nlohmann::json& request);
  /// All of a line at once.
  void request(const std::shared_ptr<Client>& client, std::string_view line);

 private:
  struct Call {
    std::shared_ptr<Client> client;
    nlohmann::json id;
    bool wants_answer;
    nlohmann::json params;
  };
  void dispatch(const std::string& method, const Call& call);
  /// The axes that are asked of, which the parameter "axis" chooses; nothing where it names none: that is answered.
  std::optional<std::vector<std::size_t>> axes_of(const Call& call);
  void subscribe(const Call& call, bool on);
  void history(const Call& call);
  void events(const Call& call);
  void rows(const Call& call);
  void reload(const Call& call);
  void reply(const Call& call, const nlohmann::ordered_json& result);
  void reply(const Call& call, std::vector<TextPart> result);
  void fail_count(const Call& call, const char* key, std::size_t most);
  void fail(const Call& call, int code, const std::string& message);

  const Sources sources_;
  Publisher& publisher_;
  RowRequests& row_requests_;
  Reload reload_;
};

/// The parameters of "rows", but for the axis; what is wrong with them otherwise.
struct RowParams {
  pipeline::RowQuery query;
  double wait_s = 0;
};
Result<RowParams> row_params(const nlohmann::json& params);

}  // namespace prism::socket
