// SPDX-License-Identifier: MIT
// What the gyros say, as PlotJuggler's "UDP Server" takes it with the protocol JSON and the field timestamp.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/prismweb/settings.hpp"
#include "tools/prismweb/subscription_table.hpp"

namespace prism::prismweb {

/// A datagram for each notification of a batch {"instance":…,"batch":[…]} that has a time:
/// {"timestamp": s, INSTANCE: {AXIS: {"window" or "sample": {…}}}}, or {"timestamp": s, INSTANCE: {"event": TEXT}}.
/// PlotJuggler makes a curve of each number, named by its place. What is not known is left out.
std::vector<std::string> plotjuggler_datagrams(const std::string& text);

/// Sends without waiting and without an answer: whether PlotJuggler runs is its own affair.
class PlotJuggler : public Subscriber {
 public:
  PlotJuggler(boost::asio::io_context& io, const PlotJugglerSettings& settings);
  void deliver(const std::string& instance, const Text& text, std::uint64_t rows) override;
  Subscription subscribe() const;

 private:
  const PlotJugglerSettings settings_;
  boost::asio::ip::udp::endpoint to_;
  boost::asio::ip::udp::socket socket_;
};

}  // namespace prism::prismweb
