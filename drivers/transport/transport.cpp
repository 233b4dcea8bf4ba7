// SPDX-License-Identifier: MIT
#include "drivers/transport/transport.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <functional>

#include "base/json_table.hpp"
#include "drivers/transport/serial_line.hpp"
#include "drivers/transport/tcp_line.hpp"
#include "drivers/transport/udp_line.hpp"

namespace prism::transport {
namespace {

struct Kind {
  const char* key;  // in a configuration's section of a line; null: the serial line
  const char* help;
  const JsonTable<Network>& (*keys)();
  Result<std::unique_ptr<Transport>> (*open)(boost::asio::io_context&, const Settings&);
};

// Network::type selects the row; the serial line is the last.
constexpr Kind kKinds[] = {
    {"tcp", "A line through TCP, instead of device: address or listen. Needs the unit prismd-net@.", tcp_keys,
     open_tcp_line},
    {"udp", "A line through UDP, instead of device.", udp_keys, open_udp_line},
    {nullptr, nullptr, nullptr, open_serial_line},
};

const Kind& kind_of(const Settings& settings) {
  const Kind* kind = kKinds;
  while (kind->key && settings.network.type != kind->key) ++kind;
  return *kind;
}

}  // namespace

const JsonTable<Network>& network_keys() {
  static const JsonTable<Network> keys = [] {
    JsonTable<Network> all;
    for (const Kind* kind = kKinds; kind->key; ++kind) {
      all.object(kind->key, kind->keys(), std::identity(), kind->help)
          .print_if([kind](const Network& network) { return network.type == kind->key; })
          .then([kind](const Section& line, Network& network) {
            if (!line.has(kind->key)) return;
            if (!network.type.empty())
              line.fail(kind->key, fmt::format("given together with \"{}\"; expected one of them", network.type));
            network.type = kind->key;
          });
    }
    return all;
  }();
  return keys;
}

Result<std::unique_ptr<Transport>> open(boost::asio::io_context& io, const Settings& settings) {
  return kind_of(settings).open(io, settings);
}

std::string describe(const Settings& settings) {
  const Network& network = settings.network;
  if (network.type.empty()) return settings.device;
  return network.type + (network.type == "tcp" && network.listens ? " listening on " : " ") + network.address;
}

bool is_present(const Settings& settings) {
  if (needs_network(settings)) return !settings.network.listens;
  return ::access(settings.device.c_str(), F_OK) == 0;
}

}  // namespace prism::transport
