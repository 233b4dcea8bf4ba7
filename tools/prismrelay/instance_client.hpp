// SPDX-License-Identifier: MIT
// One prismd, over its restarts: its axes' logs and its events. It is never started by us.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/prismrelay/line_client.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

/// The part that every follower of an instance has alike: knock where it runs, ask for its status, begin anew when it
/// went.
class InstanceClient : public std::enable_shared_from_this<InstanceClient> {
 public:
  struct Calls {
    /// It answers; `status` is its answer.
    std::function<void(const nlohmann::json& status)> begun;
    std::function<void(const nlohmann::json& notification)> told;
    std::function<void()> gone;
  };

  InstanceClient(boost::asio::io_context& context, RelayState& state, std::string gyro, std::string socket,
                 Calls calls);

  void begin();
  void close();
  /// Gives the connection up, and knocks again.
  void restart(const std::string& why);
  void ask(const char* method, const nlohmann::json& params, LineClient::Message answer);

  const std::string& gyro() const { return gyro_; }
  const std::string& socket() const { return socket_; }
  bool running() const { return running_; }

 private:
  void try_connect();
  void pause(std::chrono::milliseconds time);
  void lost(const std::string& why);

  boost::asio::io_context& context_;
  RelayState& state_;
  const std::string gyro_, socket_;
  Calls calls_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<LineClient> client_;
  std::chrono::milliseconds pause_;
  bool running_ = false, closed_ = false;
};

/// The axes in a status: their names, and whether requests have to name them. Names that do not follow
/// TextRule::kAxisName are in `invalid`, as printable text.
struct StatusAxes {
  std::vector<std::string> names, invalid;
  bool several = false;
};
StatusAxes axes_of(const nlohmann::json& status);

}  // namespace prism::prismrelay
