// SPDX-License-Identifier: MIT
#include "tools/prismweb/session_list.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "tools/prismweb/access.hpp"

namespace prism::prismweb {
namespace {

constexpr std::size_t kDigestLetters = 64;

}  // namespace

SessionList SessionList::parse(std::string_view text) {
  SessionList list;
  while (!text.empty() && list.sessions_.size() < kMaxSessions) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (line.size() <= kDigestLetters || line[kDigestLetters] != ' ') continue;
    const std::string_view digest = line.substr(0, kDigestLetters), number = line.substr(kDigestLetters + 1);
    const auto begin_s = parse_number<std::int64_t>(number);
    if (!begin_s) continue;
    if (digest.find_first_not_of("0123456789abcdef") != std::string_view::npos) continue;
    list.sessions_.push_back({std::string(digest), *begin_s});
  }
  return list;
}

std::string SessionList::text() const {
  std::string text;
  for (const Session& session : sessions_) text += fmt::format("{} {}\n", session.digest, session.begin_s);
  return text;
}

void SessionList::add(std::string_view cookie, std::int64_t now_s) {
  std::erase_if(sessions_,
                [&](const Session& one) { return now_s - one.begin_s >= std::chrono::seconds(kLifetime).count(); });
  if (sessions_.size() >= kMaxSessions) sessions_.erase(sessions_.begin());
  sessions_.push_back({sha256_hex(cookie), now_s});
}

bool SessionList::contains(std::string_view cookie, std::int64_t now_s) const {
  const std::string digest = sha256_hex(cookie);
  return std::any_of(sessions_.begin(), sessions_.end(), [&](const Session& one) {
    return is_secret(digest, one.digest) && now_s - one.begin_s < std::chrono::seconds(kLifetime).count();
  });
}

}  // namespace prism::prismweb
