// SPDX-License-Identifier: MIT
// The daemon's parts without a line: tests feed frames of the trplg description, and a client uses a socket pair.
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/host_time.hpp"
#include "daemon/pipeline/device.hpp"
#include "daemon/socket/rpc.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::test {

/// Connected as in the live daemon.
struct DaemonParts {
  using Told = std::function<void(const socket::Event&)>;

  explicit DaemonParts(
      pipeline::Setup setup, std::vector<std::unique_ptr<pipeline::RowWriter>> logs = {},
      Told told = [](const auto&) {})
      : events([this, told = std::move(told)](const socket::Event& event) {
          told(event);
          publisher.event(event);
        }),
        device(
            std::move(setup), std::move(logs), {},
            [this](const pipeline::Rows& rows) {
              publisher.rows(rows, device.log != nullptr && device.log->pending > 0);
            },
            events.teller(), problems) {}

  socket::Rpc rpc(socket::Rpc::Actions actions = {[](const auto&) {}}) {
    return socket::Rpc({device, events, publisher, started_ns}, std::move(actions));
  }
  void begin_session(std::int64_t now_ns) {
    device.begin_session(pipeline::kGyroLine, now_ns);
    set_line(pipeline::LineState::kReceiving);
  }
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
    device.feed(pipeline::kGyroLine, bytes, arrival_ns);
  }
  void set_line(pipeline::LineState state, const std::string& detail = {}) {
    device.lines[pipeline::kGyroLine].set(state, detail, host_time_ns());
  }

  const std::int64_t started_ns = host_time_ns();
  socket::Publisher publisher;
  socket::EventLog events;
  Problems problems{pipeline::problems_as_events(events.teller())};
  pipeline::Device device;
};

class DaemonPartsTest : public testing::Test {
 protected:
  DaemonPartsTest() : setup_(make_setup()), encoder_(setup_.frames), parts_(std::make_unique<DaemonParts>(setup_)) {}

  pipeline::Setup make_setup(const std::string& more = "", const std::string& frames = "trplg") {
    std::ofstream(folder_.file("gyro.json")) << R"({"name": "gyro", "frames": ")" << PRISM_SOURCE_DIR
                                             << "/config/frames/" << frames << R"(.json", "clock": "device",
              "line": {"device": "/dev/null"}, "socket": {"path": ")"
                                             << folder_.file("socket") << R"("})" << more << "}";
    const auto setup = pipeline::load_setup(folder_.file("gyro.json"));
    if (!setup) throw std::runtime_error(setup.error().text());
    return *setup;
  }

  /// Frames of `seconds` seconds, at the description's rate.
  void feed(int seconds) {
    const auto frames = static_cast<int>(setup_.frames->rate_hz) * seconds;
    for (int i = 0; i < frames; ++i) {
      std::vector<std::uint8_t> bytes;
      encoder_.encode({{10.0, -20.0, 30.0}, setup_.frames->period_s(), 25.0, 1.5}, bytes);
      arrival_ns_ += static_cast<std::int64_t>(setup_.frames->period_s() * 1e9);
      parts_->feed(bytes, arrival_ns_);
    }
  }

  void begin_session() { parts_->begin_session(arrival_ns_); }

  test::TemporaryFolder folder_;
  pipeline::Setup setup_;
  wire::FrameEncoder encoder_;
  std::unique_ptr<DaemonParts> parts_;
  std::int64_t arrival_ns_ = 1'700'000'000'000'000'000;
};

/// Handles all requests of a line at once.
inline void request(socket::Rpc& rpc, const std::shared_ptr<socket::Client>& client, std::string_view line) {
  for (nlohmann::json& one : socket::Rpc::take(client, line)) rpc.one(client, std::move(one));
}

/// One client and the text that it receives.
class Asker {
 public:
  using Socket = boost::asio::local::stream_protocol::socket;

  explicit Asker(std::size_t max_queued_bytes = 1 << 20,
                 std::shared_ptr<socket::ClientMemory> memory = std::make_shared<socket::ClientMemory>())
      : mine_(io_) {
    Socket theirs(io_);
    boost::asio::local::connect_pair(mine_, theirs);
    mine_.non_blocking(true);
    client_ = std::make_shared<socket::Client>(std::move(theirs), max_queued_bytes, std::move(memory));
  }
  ~Asker() { client_->close(); }  // a publisher may keep it longer than io_
  Asker(const Asker&) = delete;
  Asker& operator=(const Asker&) = delete;

  const std::shared_ptr<socket::Client>& client() const { return client_; }
  boost::asio::io_context& io() { return io_; }

  void hang_up() { mine_.close(); }
  void shut_down() { mine_.shutdown(Socket::shutdown_send); }

  void poll() {
    io_.restart();
    io_.poll();
  }
  /// Returns the text that was sent so far.
  std::string take() {
    std::string text;
    for (char buffer[65536];;) {
      const ssize_t size = ::recv(mine_.native_handle(), buffer, sizeof buffer, MSG_DONTWAIT);
      if (size <= 0) return text;
      text.append(buffer, static_cast<std::size_t>(size));
    }
  }

  /// Returns all text until no more arrives.
  std::string read() {
    std::string text;
    for (;;) {
      poll();
      const std::string more = take();
      if (more.empty()) return text;
      text += more;
    }
  }
  nlohmann::json ask(socket::Rpc& rpc, const std::string& line) {
    request(rpc, client_, line);
    return nlohmann::json::parse(read());
  }
  nlohmann::json ask(socket::Rpc& rpc, std::string_view method, const nlohmann::json& params) {
    return ask(
        rpc,
        nlohmann::json{{"jsonrpc", "2.0"}, {"id", 1}, {"protocol", 2}, {"method", method}, {"params", params}}.dump());
  }
  /// The result; of a device with one axis, the members of the axis are in the result itself.
  nlohmann::json result(socket::Rpc& rpc, std::string_view method, const nlohmann::json& params = nullptr) {
    return own(ask(rpc, method, params).at("result"));
  }
  static nlohmann::json own(nlohmann::json all) {
    if (!all.is_object() || !all.contains("axes") || all["axes"].size() != 1 || !all["axes"].is_object()) return all;
    nlohmann::json own = all["axes"].front();
    all.erase("axes");
    if (!own.is_object()) return own;
    for (auto& [key, value] : own.items()) {
      if (key == "log" && all.contains(key)) {
        all[key].update(value);
      } else {
        all[key] = std::move(value);
      }
    }
    return all;
  }

 private:
  boost::asio::io_context io_;
  Socket mine_;
  std::shared_ptr<socket::Client> client_;
};

}  // namespace prism::test
