// SPDX-License-Identifier: MIT
// Sends notifications to PlotJuggler's "UDP Server" (protocol JSON, field "timestamp").
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/prismweb/settings.hpp"
#include "tools/prismweb/subscription_table.hpp"

namespace prism::prismweb {

/// Returns one datagram per notification of a batch {"instance":…,"batch":[…]} that has a time:
/// {"timestamp": s, INSTANCE: {AXIS: {"window" or "sample": {…}}}}, or {"timestamp": s, INSTANCE: {"event": TEXT}}.
/// PlotJuggler makes one curve per number, named by its path in the object. Unknown values are omitted.
std::vector<std::string> plotjuggler_datagrams(const std::string& text);

/// Sends datagrams without blocking; send errors are ignored, because PlotJuggler need not be running.
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
