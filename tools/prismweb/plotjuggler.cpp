// SPDX-License-Identifier: MIT
#include "tools/prismweb/plotjuggler.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/address.hpp>

namespace prism::prismweb {
namespace {

using nlohmann::json;

json known_of(const json& params) {
  json known = json::object();
  for (const auto& [key, value] : params.items()) {
    if (!value.is_null() && key != "axis" && key != "time_s") known[key] = value;
  }
  return known;
}

}  // namespace

std::vector<std::string> plotjuggler_datagrams(const std::string& batch) {
  std::vector<std::string> datagrams;
  const json whole = json::parse(batch, nullptr, false);
  if (!whole.is_object() || !whole.contains("batch") || !whole["batch"].is_array()) return datagrams;
  const std::string instance = whole.value("instance", "");
  for (const json& notification : whole["batch"]) {
    const std::string method = notification.value("method", "");
    const json params = notification.value("params", json());
    if (!params.is_object() || !params.value("time_s", json()).is_number()) continue;
    json own = {{"timestamp", params["time_s"]}};
    if (method == "event") {
      own[instance]["event"] = params.value("text", "");
    } else {
      own[instance][params.value("axis", "-")][method] = known_of(params);
    }
    datagrams.push_back(own.dump(-1, ' ', false, json::error_handler_t::replace));
  }
  return datagrams;
}

PlotJuggler::PlotJuggler(boost::asio::io_context& io, const PlotJugglerSettings& settings)
    : settings_(settings),
      to_(boost::asio::ip::make_address(settings.address), settings.port),
      socket_(io, to_.protocol()) {
  socket_.non_blocking(true);
}

Wish PlotJuggler::wish() const {
  Wish wish;
  wish.sample_every = settings_.samples ? 1 : 0;
  wish.windows = wish.events = true;
  return wish;
}

void PlotJuggler::deliver(const std::string&, const Text& text, std::uint64_t) {
  for (const std::string& datagram : plotjuggler_datagrams(*text)) {
    boost::system::error_code ignored;  // nobody listens there, or the buffer is full: the next one may come through
    socket_.send_to(boost::asio::buffer(datagram), to_, 0, ignored);
  }
}

}  // namespace prism::prismweb
