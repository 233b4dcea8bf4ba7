// SPDX-License-Identifier: MIT
#include "tools/prismweb/plotjuggler.hpp"

#include <gtest/gtest.h>

#include <array>

namespace prism::prismweb {
namespace {

const std::string kBatch =
    R"({"instance":"gyro1","batch":[{"jsonrpc":"2.0","method":"window","params":{"axis":"z","time_s":10,"rate_deg_per_h":8.5,"bias_deg_per_h":null,)"
    R"("quality":"warming"}},{"jsonrpc":"2.0","method":"event","params":{"time_s":11.5,"text":"lost"}},{"jsonrpc":"2.0","method":"lost","params":{"rows":3}}]})";

TEST(PlotJuggler, SendsADatagramPerRowWithItsTimestamp) {
  const auto datagrams = plotjuggler_datagrams(kBatch);
  ASSERT_EQ(datagrams.size(), 2U);
  EXPECT_EQ(
      nlohmann::json::parse(datagrams[0]),
      nlohmann::json::parse(R"({"timestamp":10,"gyro1":{"z":{"window":{"rate_deg_per_h":8.5,"quality":"warming"}}}})"));
  EXPECT_EQ(nlohmann::json::parse(datagrams[1]),
            nlohmann::json::parse(R"({"timestamp":11.5,"gyro1":{"event":"lost"}})"));
  EXPECT_TRUE(plotjuggler_datagrams("no batch").empty());
  EXPECT_TRUE(plotjuggler_datagrams("{}").empty());
}

TEST(PlotJuggler, SendsWithoutAReceiver) {
  boost::asio::io_context io;
  boost::asio::ip::udp::socket receiver(io, {boost::asio::ip::make_address("127.0.0.1"), 0});
  PlotJuggler sender(io, {"127.0.0.1", receiver.local_endpoint().port(), true});
  EXPECT_EQ(sender.subscribe().sample_every, 1U);
  sender.deliver("gyro1", std::make_shared<const std::string>(kBatch), 3);
  std::array<char, 1000> buffer{};
  const std::size_t size = receiver.receive(boost::asio::buffer(buffer));
  EXPECT_EQ(nlohmann::json::parse(std::string(buffer.data(), size))["timestamp"], 10);
  receiver.close();
  for (int i = 0; i < 100; ++i) sender.deliver("gyro1", std::make_shared<const std::string>(kBatch), 3);
}

}  // namespace
}  // namespace prism::prismweb
