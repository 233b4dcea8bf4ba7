// SPDX-License-Identifier: MIT
#include "drivers/transport/transport.hpp"

#include "drivers/transport/serial_line.hpp"

namespace prism::transport {
namespace {

struct Kind {
  bool (*fits)(const Settings&);
  Result<std::unique_ptr<Transport>> (*open)(const Settings&);
  std::string (*describe)(const Settings&);
  bool (*is_present)(const Settings&);
};

// Uses the first row that matches; the serial line always matches.
constexpr Kind kKinds[] = {
    {[](const Settings&) { return true; }, open_serial_line, describe_serial_line, serial_line_is_present},
};

const Kind& kind_of(const Settings& settings) {
  const Kind* kind = kKinds;
  while (!kind->fits(settings)) ++kind;
  return *kind;
}

}  // namespace

Result<std::unique_ptr<Transport>> open(const Settings& settings) { return kind_of(settings).open(settings); }

std::string describe(const Settings& settings) { return kind_of(settings).describe(settings); }

bool is_present(const Settings& settings) { return kind_of(settings).is_present(settings); }

}  // namespace prism::transport
