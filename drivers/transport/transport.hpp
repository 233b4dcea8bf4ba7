// SPDX-License-Identifier: MIT
// A line to a device: carries its bytes. Each type of line has its own pair of files and one row of the table in
// transport.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/json_section.hpp"
#include "base/result.hpp"
#include "drivers/wire/description/wire_format.hpp"

namespace boost::asio {
class io_context;
}
namespace boost::system {
class error_code;
}

namespace prism::transport {

/// Where a line through a network begins. With an empty `type` the line is a serial device.
struct Network {
  std::string type;      ///< key of a row of the table in transport.cpp: "tcp", "udp"
  std::string address;   ///< HOST:PORT
  bool listens = false;  ///< waits at the address for the device, instead of connecting to it
  std::string from;      ///< of a line that listens: address of the only accepted peer or sender; empty: any

  bool operator==(const Network&) const = default;
};

/// Settings to open a line.
struct Settings {
  std::string device;       ///< path of a tty; /dev/serial/by-id/… survives replugging
  wire::WireFormat format;  ///< any speed that the hardware meets within 2 %
  Network network = {};     ///< instead of the device

  bool operator==(const Settings&) const = default;
};

/// Result of a read.
struct Received {
  enum class Kind {
    kData,     ///< `bytes` bytes, at least one
    kNothing,  ///< no data now
    kEmpty,    ///< end of file, but the line still exists: wait before the next read
    kLost      ///< the device is disconnected; see `why`
  };
  Kind kind = Kind::kNothing;
  std::size_t bytes = 0;
  std::string why = {};
};

/// Counters of the hardware since the driver was loaded.
struct LineCounters {
  std::int64_t received = 0;  ///< characters
  std::int64_t framing_errors = 0, parity_errors = 0, overruns = 0, breaks = 0, buffer_overruns = 0;

  std::int64_t errors() const { return framing_errors + parity_errors + overruns + breaks + buffer_overruns; }
  bool operator==(const LineCounters&) const = default;
};

/// A line that is open or being opened; the destructor closes it. No function waits.
class Transport {
 public:
  /// Without an error: call read() now. After the destructor: with an error.
  using Ready = std::function<void(const boost::system::error_code&)>;

  virtual ~Transport() = default;
  /// Calls `ready` when data are available or when the opening can proceed; while it opens, perhaps more than once.
  virtual void wait(Ready ready) = 0;
  /// For poll(2), if the line is open: readable when data are available. The transport closes it.
  virtual int fd() = 0;
  /// Empty if the line is open, else what it waits for: "connecting to 192.0.2.7:4001". Then read() opens it further
  /// and returns kNothing, or kLost if that failed.
  virtual std::string opening() const { return {}; }
  virtual Received read(std::span<std::uint8_t> buffer) = 0;
  /// Sends as many bytes as fit now; returns their number, or an error.
  virtual Result<std::size_t> write(std::span<const std::uint8_t> bytes) = 0;
  /// True if unread bytes are waiting.
  virtual bool has_unread() const = 0;
  /// Returns nullopt if this type of line has no counters.
  virtual std::optional<LineCounters> counters() const { return std::nullopt; }
  /// Of a line that listens: the host that is connected; empty: none, or not known.
  virtual std::string peer() const { return {}; }
  /// Turns away the hosts that connect meanwhile. Returns the last one; empty: none since the last call.
  virtual std::string turn_away() { return {}; }
  /// Optional settings that the line does not support, one sentence each.
  virtual std::vector<std::string> notes() const { return {}; }
};

/// The keys "tcp", "udp" … of a line in a configuration; at most one of them may be given.
const JsonTable<Network>& network_keys();

/// Opens a line of the type that the settings select, or begins to open it. `io` must outlive it; wait() needs it to
/// run. Errors: the line's name and the reason.
Result<std::unique_ptr<Transport>> open(boost::asio::io_context& io, const Settings& settings);

/// Human-readable name of the line.
std::string describe(const Settings& settings);

/// Returns false if the device does not exist now, or for a line that listens: opening it again costs little, disturbs
/// no other host, and needs no growing pause.
bool is_present(const Settings& settings);

/// Returns true if the line goes through a network.
inline bool needs_network(const Settings& settings) { return !settings.network.type.empty(); }

}  // namespace prism::transport
