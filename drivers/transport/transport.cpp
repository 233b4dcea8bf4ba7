// SPDX-License-Identifier: MIT
#include "drivers/transport/transport.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <functional>

#include "base/json_table.hpp"
#include "drivers/transport/network_line.hpp"
#include "drivers/transport/serial_line.hpp"

namespace prism::transport {
namespace {

struct Kind {
  const char* key;  // in a configuration's section of a line; null: the serial line
  const char *help, *listen, *from, *address;
  bool connects;  // to its address; else it listens, and its address is that of an output
  Result<std::unique_ptr<Transport>> (*open)(boost::asio::io_context&, const Settings&);
};

// Network::type selects the row; the serial line is the last.
constexpr Kind kKinds[] = {
    {"tcp", "A line through TCP, instead of device: address or listen. Needs the unit prismd-net@.",
     "HOST:PORT of this host; the device connects to it.", "IP address of the only host that may connect.",
     "HOST:PORT of a device server or a device; prismd connects to it.", true, open_tcp_line},
    {"udp", "A line through UDP, instead of device.", "HOST:PORT of this host; the device sends its datagrams to it.",
     "IP address of the only accepted sender, also with a port; commands are sent to this port.",
     "IP address and port of the far end: for an output.", false, open_udp_line},
    {nullptr, nullptr, nullptr, nullptr, nullptr, false, open_serial_line},
};

void check_addresses(const Section& section, const Kind& kind, Network& network) {
  network.listens = section.has("listen") || (!kind.connects && !section.has("address"));
  const char* const key = network.listens ? "listen" : "address";
  section.require(key);
  if (network.listens && section.has("address"))
    section.fail("address", "given together with \"listen\"; expected one of them");
  const bool is_name = network.listens || kind.connects;
  const auto end = is_name ? parse_endpoint(network.address) : parse_numeric_endpoint(network.address);
  if (!end) return section.fail(key, end.error());
  if (end->port == 0) section.fail(key, "has no port");
  if (!section.has("from")) return;
  if (!network.listens) section.fail("from", "given with \"address\"; expected \"listen\"");
  const auto from = parse_numeric_endpoint(network.from);
  if (!from) return section.fail("from", from.error());
  if (kind.connects && from->port != 0)
    section.fail("from", "has a port, which a peer that connects chooses itself; expected an address");
}

JsonTable<Network> keys_of(const Kind& kind) {
  return JsonTable<Network>()
      .text("address", &Network::address, kind.address)
      .print_if([](const Network& network) { return !network.listens; })
      .text("listen", &Network::address, kind.listen)
      .print_if([](const Network& network) { return network.listens; })
      .text("from", &Network::from, kind.from)
      .print_if([](const Network& network) { return !network.from.empty(); })
      .then([&kind](const Section& section, Network& network) { check_addresses(section, kind, network); });
}

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
      all.object(kind->key, keys_of(*kind), std::identity(), kind->help)
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
