// SPDX-License-Identifier: MIT
// Sessions of browsers that opened an address with a token. Memory and disk have only the SHA-256 of each cookie.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace prism::prismweb {

class SessionList {
 public:
  static constexpr std::size_t kMaxSessions = 32;
  static constexpr std::chrono::hours kLifetime{30 * 24};

  /// Parses text(): lines "SHA256 SECONDS", oldest first. Skips invalid lines.
  static SessionList parse(std::string_view text);
  std::string text() const;

  /// Adds a session that begins at `now_s` (seconds since 1970). If there are 32, removes the oldest.
  void add(std::string_view cookie, std::int64_t now_s);
  /// True if a session with this cookie began within the last 30 days.
  bool contains(std::string_view cookie, std::int64_t now_s) const;

 private:
  struct Session {
    std::string digest;
    std::int64_t begin_s;
  };
  std::vector<Session> sessions_;
};

}  // namespace prism::prismweb
