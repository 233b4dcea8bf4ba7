// SPDX-License-Identifier: MIT
#include "tools/prismweb/plotjuggler.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/address.hpp>
#include <utility>

#include "tools/prismweb/batch.hpp"
#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

std::string datagram_of(const std::string& instance, BatchRow row) {
  json datagram;
  const json time_s = row.params["time_s"];
  if (row.method == "event") {
    datagram[instance]["event"] = text_member(row.params, "text");
  } else {
    const std::string axis = text_member(row.params, "axis");
    row.params.erase("axis");
    row.params.erase("time_s");
    datagram[instance][axis][row.method] = std::move(row.params);
  }
  datagram["timestamp"] = time_s;  // last, in case an instance has this name
  return json_text(datagram);
}

}  // namespace

std::vector<std::string> plotjuggler_datagrams(const std::string& text) {
  std::vector<std::string> datagrams;
  Batch batch = read_batch(text);
  for (BatchRow& row : batch.rows) {
    if (row.params.value("time_s", json()).is_number())
      datagrams.push_back(datagram_of(batch.instance, std::move(row)));
  }
  return datagrams;
}

PlotJuggler::PlotJuggler(boost::asio::io_context& io, const PlotJugglerSettings& settings)
    : settings_(settings),
      to_(boost::asio::ip::make_address(settings.address), settings.port),
      socket_(io, to_.protocol()) {
  socket_.non_blocking(true);
}

Subscription PlotJuggler::subscribe() const {
  Subscription subscription;
  subscription.sample_every = settings_.samples ? 1 : 0;
  subscription.windows = subscription.events = true;
  return subscription;
}

void PlotJuggler::deliver(const std::string&, const Text& text, std::uint64_t) {
  for (const std::string& datagram : plotjuggler_datagrams(*text)) {
    boost::system::error_code ignored;  // no receiver, or a full buffer: later ones may arrive
    socket_.send_to(boost::asio::buffer(datagram), to_, 0, ignored);
  }
}

}  // namespace prism::prismweb
