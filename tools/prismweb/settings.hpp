// SPDX-License-Identifier: MIT
// What a person may set of prismweb.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace prism::prismweb {

inline constexpr int kExitDone = 0, kExitFailed = 1, kExitUsage = 64, kExitBug = 70, kExitConfig = 78;

struct TlsSettings {
  std::string certificate, key;  ///< paths, PEM
};

struct PlotJugglerSettings {
  std::string address;  ///< an IP address
  std::uint16_t port = 9870;
  bool samples = false;  ///< every frame, beside one row a second
};

struct FoxgloveSettings {
  std::vector<std::string> origins;  ///< of Foxglove's page, as its browser names it
};

struct Settings {
  std::string address = "127.0.0.1";   ///< an IP address; empty: no TCP
  std::uint16_t port = 8467;           ///< 0: one that is free
  std::string unix_socket;             ///< path of a unix socket to listen on; empty: none
  std::vector<std::string> hosts;      ///< names of this server beside those that are always allowed
  std::vector<std::string> instances;  ///< names or paths of sockets; empty: all of the host
  std::string page, dygraphs;          ///< folders of files
  std::string state;                   ///< folder of the minutes and hours; empty: none are kept
  std::optional<TlsSettings> tls;
  std::optional<PlotJugglerSettings> plotjuggler;
  std::optional<FoxgloveSettings> foxglove;
  std::string passwords;  ///< path of a file NAME:BCRYPT; empty: none
};

}  // namespace prism::prismweb
