// SPDX-License-Identifier: MIT
// Browsers that came in by an address with a token. Each has a cookie; here and on the disk is only its SHA-256.
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

  /// Lines "SHA256 SECONDS" of text(), oldest first; other lines are skipped.
  static SessionList parse(std::string_view text);
  std::string text() const;

  /// Adds the session with this cookie, begun at `now_s` (seconds since 1970). Of 32 the oldest one ends.
  void add(std::string_view cookie, std::int64_t now_s);
  /// True if a session has this cookie and began within 30 days.
  bool contains(std::string_view cookie, std::int64_t now_s) const;

 private:
  struct Session {
    std::string digest;
    std::int64_t begin_s;
  };
  std::vector<Session> sessions_;
};

}  // namespace prism::prismweb
