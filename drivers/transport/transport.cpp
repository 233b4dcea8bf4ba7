// SPDX-License-Identifier: MIT
#include "drivers/transport/transport.hpp"

#include <fmt/format.h>

#include "drivers/transport/serial_line.hpp"
#include "drivers/transport/tcp_line.hpp"
#include "drivers/transport/udp_line.hpp"

namespace prism::transport {
namespace {

struct Kind {
  const char* key;  // in a configuration's section of a line; null: the serial line
  Network (*read)(const Section&);
  Result<std::unique_ptr<Transport>> (*open)(const Settings&);
  std::string (*describe)(const Settings&);
  bool (*is_present)(const Settings&);
};

// Network::type selects the row; the serial line is the last.
constexpr Kind kKinds[] = {
    {"tcp", read_tcp_line, open_tcp_line, describe_tcp_line, tcp_line_is_present},
    {"udp", read_udp_line, open_udp_line, describe_udp_line, udp_line_is_present},
    {nullptr, nullptr, open_serial_line, describe_serial_line, serial_line_is_present},
};

const Kind& kind_of(const Settings& settings) {
  const Kind* kind = kKinds;
  while (kind->key && settings.network.type != kind->key) ++kind;
  return *kind;
}

}  // namespace

Network read_network(const Section& line) {
  Network network;
  for (const Kind* kind = kKinds; kind->key; ++kind) {
    if (!line.has(kind->key)) continue;
    if (!network.type.empty())
      line.fail(kind->key, fmt::format("given together with \"{}\"; expected one of them", network.type));
    network = kind->read(line.object(kind->key));
    network.type = kind->key;
  }
  return network;
}

Result<std::unique_ptr<Transport>> open(const Settings& settings) { return kind_of(settings).open(settings); }

std::string describe(const Settings& settings) { return kind_of(settings).describe(settings); }

bool is_present(const Settings& settings) { return kind_of(settings).is_present(settings); }

}  // namespace prism::transport
