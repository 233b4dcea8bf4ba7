// SPDX-License-Identifier: MIT
// Opens a serial line the way a measuring instrument needs it: any speed, raw, alone, and read back.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "drivers/wire/description/wire_format.hpp"

namespace prism::drivers {

struct LineSettings {
  std::string device;  ///< path of a tty; /dev/serial/by-id/… survives replugging
  int baud = 921600;   ///< any integer the hardware can come within 2 % of
  int data_bits = 8;   ///< 5 to 8
  wire::Parity parity = wire::Parity::kNone;
  int stop_bits = 1;        ///< 1 or 2
  bool exclusive = true;    ///< no second program may read the line at the same time
  bool low_latency = true;  ///< asks the driver to hand bytes on at once (FTDI: 1 ms instead of 16)

  bool operator==(const LineSettings&) const = default;
};

/// An open line; closes it when destroyed.
class SerialLine {
 public:
  SerialLine(int fd, std::vector<std::string> notes) : fd_(fd), notes_(std::move(notes)) {}
  SerialLine(SerialLine&& other) noexcept : fd_(other.release()), notes_(std::move(other.notes_)) {}
  SerialLine& operator=(SerialLine&& other) noexcept;
  ~SerialLine();

  int fd() const { return fd_; }
  /// The descriptor, which the caller closes from now on; -1 the second time.
  int release() { return std::exchange(fd_, -1); }
  /// What the line could not be given and can be lived without, one sentence each: for the log.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  int fd_ = -1;
  std::vector<std::string> notes_;
};

/// Opens, locks and sets the line; reads the settings back and compares. The descriptor does not block and is not
/// inherited. What stood in the input before is thrown away: nobody knows when it arrived. Refused with the device's
/// name: not there, no tty, held by another program, no permission, or a speed or a character format that the device
/// does not take. A pseudo-terminal has no parity and no speed: what it ignores becomes a note.
Result<SerialLine> open_serial_line(const LineSettings& settings);

/// True where the device behind an open descriptor was unplugged or hung up: read() then gives 0 for ever. An idle
/// line that gave an empty read is not gone.
bool line_is_gone(int fd);

/// What the hardware counted since the driver was loaded.
struct LineCounters {
  std::int64_t received = 0;  ///< characters
  std::int64_t framing_errors = 0, parity_errors = 0, overruns = 0, breaks = 0, buffer_overruns = 0;
  bool operator==(const LineCounters&) const = default;
};

/// Nothing where the driver does not count (pseudo-terminals, some USB adapters).
std::optional<LineCounters> read_line_counters(int fd);

}  // namespace prism::drivers
