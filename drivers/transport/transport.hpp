// SPDX-License-Identifier: MIT
// A line to a device: what carries its bytes. Each kind of line is one file pair and one row of the table in
// transport.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "drivers/wire/description/wire_format.hpp"

namespace prism::transport {

/// How a line is opened.
struct Settings {
  std::string device;       ///< path of a tty; /dev/serial/by-id/… survives replugging
  wire::WireFormat format;  ///< any speed that the hardware can come within 2 % of
  bool exclusive = true;    ///< no second program may read the line at the same time
  bool low_latency = true;  ///< asks the driver to hand bytes on at once (FTDI: 1 ms instead of 16)

  bool operator==(const Settings&) const = default;
};

/// What a read gave.
struct Received {
  enum class Kind {
    kData,     ///< `bytes` of them, at least one
    kNothing,  ///< none now
    kEmpty,    ///< the line said "end of file" and is still there: wait a moment before the next read
    kLost      ///< the device is gone: `why`
  };
  Kind kind = Kind::kNothing;
  std::size_t bytes = 0;
  std::string why = {};
};

/// What the hardware counted since the driver was loaded.
struct LineCounters {
  std::int64_t received = 0;  ///< characters
  std::int64_t framing_errors = 0, parity_errors = 0, overruns = 0, breaks = 0, buffer_overruns = 0;

  std::int64_t errors() const { return framing_errors + parity_errors + overruns + breaks + buffer_overruns; }
  bool operator==(const LineCounters&) const = default;
};

/// An open line; the destructor closes it. Nothing here waits.
class Transport {
 public:
  virtual ~Transport() = default;
  /// To wait on with poll(2): readable when there is something to read. The transport closes it.
  virtual int fd() const = 0;
  virtual Received read(std::span<std::uint8_t> buffer) = 0;
  /// Sends what fits now: how many bytes that was, or why none can be sent.
  virtual Result<std::size_t> write(std::span<const std::uint8_t> bytes) = 0;
  /// True if bytes arrived that nobody has read yet.
  virtual bool has_unread() const = 0;
  /// Nothing if this kind of line does not count.
  virtual std::optional<LineCounters> counters() const = 0;
  /// What the line could not be given and can do without, one sentence each.
  virtual const std::vector<std::string>& notes() const = 0;
};

/// Opens the line of the kind that the settings ask for. Refused with the line's name and the reason.
Result<std::unique_ptr<Transport>> open(const Settings& settings);

/// The line's name, for people.
std::string describe(const Settings& settings);

/// False if there is nothing to open now: looking for it again costs nothing and needs no growing pause.
bool is_present(const Settings& settings);

}  // namespace prism::transport
