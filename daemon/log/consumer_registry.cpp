// SPDX-License-Identifier: MIT
#include "daemon/log/consumer_registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::log {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kFormat = "prism-followers";

template <class T>
T number_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_integer() ? found->get<T>() : T{};
}

}  // namespace

ConsumerRegistry::ConsumerRegistry(std::string path, std::vector<std::string> keep_for, pipeline::Tell tell)
    : path_(std::move(path)), keep_for_(std::move(keep_for)), tell_(std::move(tell)) {}

// A missing or invalid file means no consumers.
void ConsumerRegistry::load() {
  if (std::exchange(loaded_, true)) return;
  const Result<std::string> text = read_text_file(path_);
  const json file = text ? json::parse(*text, nullptr, false) : json();
  if (!file.is_object() || file.value("format", json()) != kFormat || !file.contains("followers")) return;
  for (const auto& [name, own] : file["followers"].items()) {
    if (!own.is_object() || !own.value("after", json()).is_string() || followers_.size() >= kMost) continue;
    const auto after = RowCursor::parse(own["after"].get<std::string>());
    if (after)
      followers_[name] = {number_of<std::uint32_t>(own, "user"), *after, number_of<std::int64_t>(own, "time_s"),
                          number_of<std::uint64_t>(own, "lost_rows")};
  }
}

Result<std::optional<RowCursor>> ConsumerRegistry::find(const std::string& name, std::uint32_t user) {
  const std::lock_guard lock(mutex_);
  load();
  const auto found = followers_.find(name);
  if (found == followers_.end()) {
    if (followers_.size() < kMost) return std::nullopt;
    return make_error(
        "rows",
        fmt::format("found a new name, but this log has {} followers already (the maximum); use one of their names",
                    kMost));
  }
  if (user != 0 && user != found->second.user)
    return make_error("rows", fmt::format("found user {2}, expected user {1}, owner of the follower \"{0}\"", name,
                                          found->second.user, user));
  return found->second.after;
}

void ConsumerRegistry::remember(const std::string& name, std::uint32_t user, const RowCursor& after,
                                std::int64_t time_s) {
  const std::lock_guard lock(mutex_);
  const auto [place, is_new] = followers_.try_emplace(name);
  FollowerStatus& follower = place->second;
  if (is_new) follower.user = user;
  changed_ = changed_ || is_new || !(follower.after == after);
  follower.after = after;
  follower.time_s = time_s;
}

void ConsumerRegistry::save() {
  ordered_json file = {{"format", kFormat}, {"version", 1}, {"followers", ordered_json::object()}};
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(changed_, false)) return;
    for (const auto& [name, follower] : followers_) {
      file["followers"][name] = {{"user", follower.user},
                                 {"after", follower.after.text()},
                                 {"time_s", follower.time_s},
                                 {"lost_rows", follower.lost_rows}};
    }
  }
  if (write_text_file(path_, json_text(file, 2) + "\n")) return;
  const std::lock_guard lock(mutex_);
  changed_ = true;  // e.g. disk full, which the log reports; retried at the next sync
}

std::uint64_t ConsumerRegistry::unfetched(const FollowerStatus& follower, std::uint64_t segment,
                                          std::uint64_t rows) const {
  if (follower.after.segment > segment) return 0;
  return follower.after.segment == segment ? rows - std::min(rows, follower.after.row) : rows;
}

// A name in keep_for without a request so far has fetched no rows.
std::optional<Hold> ConsumerRegistry::holder(std::uint64_t segment, std::uint64_t rows) {
  const std::lock_guard lock(mutex_);
  load();
  for (const std::string& name : keep_for_) {
    const auto found = followers_.find(name);
    if (found == followers_.end() || unfetched(found->second, segment, rows) > 0) return Hold{name, false};
  }
  for (const auto& [name, follower] : followers_)
    if (unfetched(follower, segment, rows) > 0) return Hold{name};
  return std::nullopt;
}

void ConsumerRegistry::deleted(std::uint64_t segment, std::uint64_t rows) {
  const std::lock_guard lock(mutex_);
  load();
  for (auto& [name, follower] : followers_) {
    const std::uint64_t lost = unfetched(follower, segment, rows);
    if (lost == 0) continue;
    follower.lost_rows += lost;
    changed_ = true;
    if (tell_)
      tell_(pipeline::Severity::kWarning, "disk",
            fmt::format("log: {} rows of segment {} were deleted that \"{}\" had not fetched", lost, segment, name));
  }
}

std::map<std::string, FollowerStatus> ConsumerRegistry::status() const {
  const std::lock_guard lock(mutex_);
  return followers_;
}

}  // namespace prism::log
