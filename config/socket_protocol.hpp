// SPDX-License-Identifier: MIT
// Methods and error codes of prismd's socket, for prismd and its clients. docs/protocol.md describes them.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace prism::config {

/// Member "protocol" of a request for a method with `of_axes`. Clients before 0.3 do not send it, and expect another
/// form.
inline constexpr int kProtocol = 2;
inline constexpr std::string_view kOlderClient =
    "expected \"protocol\": 2 in the request: this client is older than prism 0.3; upgrade it";

struct SocketMethod {
  std::string_view name, help;
  std::string_view params = {};  ///< names, separated by a blank
  bool of_axes = false;          ///< the result has an object "axes", by name
  bool is_long = false;          ///< the response is long or late: use a connection of its own
  bool acts = false;             ///< changes the client's subscription or the daemon: done also without an id
  bool is_local = false;         ///< has paths of the host or changes the daemon: prismweb does not offer it
};

inline constexpr std::array kSocketMethods = {
    SocketMethod{.name = "version", .help = "versions of prismctl and the daemon"},
    SocketMethod{.name = "status", .help = "state of the line, latest values, counters", .of_axes = true},
    SocketMethod{
        .name = "bias", .help = "current bias, its inputs and the corrected rate", .params = "axis", .of_axes = true},
    SocketMethod{.name = "stability",
                 .help = "raw and corrected bias stability since the start",
                 .params = "axis",
                 .of_axes = true},
    SocketMethod{.name = "line", .help = "serial line: frames, rejected frames, clock, hardware errors"},
    SocketMethod{.name = "model", .help = "model in use and its origin", .params = "axis", .of_axes = true},
    SocketMethod{.name = "config", .help = "configuration in use", .of_axes = true, .is_local = true},
    SocketMethod{.name = "history",
                 .help = "latest rows, one per second",
                 .params = "axis seconds",
                 .of_axes = true,
                 .is_long = true},
    SocketMethod{.name = "rows",
                 .help = "rows of the log from a cursor on",
                 .params = "axis after limit wait_s header",
                 .of_axes = true,
                 .is_long = true},
    SocketMethod{.name = "events", .help = "latest events, newest last", .params = "count", .is_long = true},
    SocketMethod{.name = "subscribe", .help = "start notifications", .params = "streams every axes", .acts = true},
    SocketMethod{.name = "unsubscribe", .help = "end notifications", .params = "streams every axes", .acts = true},
    SocketMethod{.name = "reload", .help = "reload the configuration and the models", .acts = true, .is_local = true},
    SocketMethod{.name = "offset",
                 .help = "subtract an offset besides the bias, or end it",
                 .params = "axis deg_per_h reason expires_s clear",
                 .acts = true,
                 .is_local = true},
    SocketMethod{.name = "send",
                 .help = "send bytes to the device of a line",
                 .params = "line text hex",
                 .acts = true,
                 .is_local = true}};

/// Returns nullptr for an unknown name.
constexpr const SocketMethod* find_method(std::string_view name) {
  const auto* const found = std::find_if(kSocketMethods.begin(), kSocketMethods.end(),
                                         [&](const SocketMethod& method) { return method.name == name; });
  return found == kSocketMethods.end() ? nullptr : found;
}

/// Codes of errors, also of prismweb. Programs decide by the code, never by the message.
enum SocketError : int {
  kParseError = -32700,
  kInvalidRequest = -32600,
  kUnknownMethod = -32601,
  kInvalidParams = -32602,
  kFailed = -32000,         ///< valid, but failed
  kNotPermitted = -32001,   ///< the user may not do this
  kUnknownCursor = -32002,  ///< of another log, or past the end of this one
  kGone = -32003,           ///< the instance does not run, or disconnected
  kBusy = -32004,           ///< too many connections or pending requests: retry later
  kNoLog = -32005,          ///< prismd writes no log
  kTimeout = -32006,        ///< no response in time
  kRowsGone = -32007,       ///< rows after the cursor were deleted; `data`: a result without rows, to continue
};

}  // namespace prism::config
