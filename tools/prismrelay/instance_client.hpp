// SPDX-License-Identifier: MIT
// Client of one prismd. Never starts a stopped instance.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/client/async_connection.hpp"
#include "tools/client/response.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

/// Connects if the instance is running, requests its status, and reconnects after a disconnect.
class InstanceClient : public std::enable_shared_from_this<InstanceClient> {
 public:
  using OnResponse = std::function<void(const client::Response& response)>;
  struct Callbacks {
    std::function<void(const nlohmann::json& status)> connected;  ///< with the response to `status`
    std::function<void(const nlohmann::json& notification)> notification;
    std::function<void()> disconnected;  ///< only after `connected`
  };

  InstanceClient(boost::asio::io_context& context, RelayState& state, std::string gyro, std::string socket,
                 Callbacks callbacks);

  void start();
  void close();
  /// Closes the connection and connects again after a pause.
  void restart(const std::string& reason);
  /// Has no effect without a connection. `method` must be a literal.
  void call(const char* method, const nlohmann::json& params, OnResponse on_response);

  const std::string& gyro() const { return gyro_; }
  const std::string& socket() const { return socket_; }
  bool running() const { return running_; }

 private:
  void try_connect();
  void retry_after(std::chrono::milliseconds delay);
  void on_disconnected(const std::string& reason);

  boost::asio::io_context& context_;
  RelayState& state_;
  const std::string gyro_, socket_;
  Callbacks callbacks_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<client::AsyncConnection> client_;
  std::chrono::milliseconds retry_delay_;
  bool running_ = false, closed_ = false;
};

/// The names of the axes in a status. `invalid` has those that do not follow TextRule::kAxisName, as printable text.
struct StatusAxes {
  std::vector<std::string> names, invalid;
};
StatusAxes axes_of(const nlohmann::json& status);

}  // namespace prism::prismrelay
