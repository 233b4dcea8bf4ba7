// SPDX-License-Identifier: MIT
// A live line through TCP: opened, lost and opened again.
#include "daemon/line/live_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/daemon_parts.hpp"

namespace prism::line {
namespace {

using boost::asio::ip::tcp;
using pipeline::LineState;

struct LiveLineTest : test::DaemonPartsTest {
  LiveLineTest() {
    setup_.config.line.retry_min_s = 0.01;
    setup_.line.network = {"tcp", "127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()), false, ""};
    parts_ = std::make_unique<test::DaemonParts>(setup_, std::vector<std::unique_ptr<pipeline::RowWriter>>(),
                                                 [this](const socket::Event& event) { kinds.push_back(event.kind); });
    line.emplace(io, parts_->device, pipeline::kGyroLine, clock, true, parts_->events.teller());
  }
  const pipeline::LineStatus& status() { return parts_->device.lines[pipeline::kGyroLine]; }
  /// Runs until this is true, or a generous limit is over.
  bool comes(const std::function<bool()>& what) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!what()) {
      if (std::chrono::steady_clock::now() >= end) return false;
      io.restart();
      io.run_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  tcp::socket accepted() {
    tcp::socket device(io);
    acceptor.non_blocking(true);
    EXPECT_TRUE(comes([&] {
      boost::system::error_code error;
      acceptor.accept(device, error);
      return !error;
    }));
    return device;
  }
  void send(tcp::socket& device, int frames) {
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < frames; ++i) encoder_.encode({{10.0}, setup_.frames->period_s(), 25.0, 1.5}, bytes);
    boost::asio::write(device, boost::asio::buffer(bytes));
  }

  boost::asio::io_context io;
  tcp::acceptor acceptor{io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0)};
  ArrivalClock clock;
  std::vector<std::string> kinds;
  std::optional<LiveLine> line;
};

TEST_F(LiveLineTest, IsOpenedLostAndOpenedAgain) {
  EXPECT_FALSE(line->is_open());
  line->start();
  EXPECT_FALSE(line->is_open()) << "it connects";
  EXPECT_EQ(status().state, LineState::kConnecting);
  for (int session = 1; session <= 2; ++session) {
    tcp::socket device = accepted();
    ASSERT_TRUE(comes([&] { return line->is_open(); })) << session;
    send(device, 3);
    ASSERT_TRUE(comes([&] { return status().state == LineState::kReceiving; })) << session;
    EXPECT_TRUE(comes([&] { return parts_->device.frames() >= 3u * static_cast<unsigned>(session); }));
    EXPECT_EQ(parts_->device.sessions, static_cast<std::uint64_t>(session));
    device.close();
    ASSERT_TRUE(comes([&] { return !line->is_open(); })) << session;
    EXPECT_EQ(status().state, LineState::kConnecting);
  }
  EXPECT_THAT(kinds, testing::ElementsAre("line_open", "line_receiving", "line_lost")) << "repeats are counted only";
  line->stop();
  EXPECT_FALSE(line->is_open());
  io.restart();
  io.run();
}

}  // namespace
}  // namespace prism::line
