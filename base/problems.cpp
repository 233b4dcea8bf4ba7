// SPDX-License-Identifier: MIT
#include "base/problems.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/host_time.hpp"
#include "base/text_number.hpp"

namespace prism {

std::string Problem::shown() const {
  return count == 0 ? text : fmt::format("{} ({} {} since {})", text, count, unit, utc_text(since_s));
}

void Problems::set(const std::string& key, Problem found) {
  std::unique_lock lock(mutex_);
  const auto [place, is_new] = problems_.try_emplace(key);
  Problem& problem = place->second;
  found.count += problem.count;
  found.calm = 0;
  found.since_s = is_new ? host_time_ns() / 1'000'000'000 : problem.since_s;
  problem = found;
  lock.unlock();
  if (is_new) tell_(true, found.kind, found.text);
}

void Problems::clear(std::string_view key, std::string_view text, int calls) {
  std::unique_lock lock(mutex_);
  const auto known = problems_.find(key);
  if (known == problems_.end() || ++known->second.calm < calls) return;
  const std::string kind = known->second.kind;
  problems_.erase(known);
  lock.unlock();
  tell_(false, kind, std::string(text));
}

void Problems::clear_all(const std::string& kind, const std::string& prefix) {
  std::vector<std::string> texts;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(problems_, [&](const auto& each) {
      if (each.second.kind == kind) texts.push_back(prefix + each.second.text);
      return each.second.kind == kind;
    });
  }
  for (const std::string& text : texts) tell_(false, kind, text);
}

void Problems::forget(std::string_view key) {
  const std::lock_guard lock(mutex_);
  if (const auto known = problems_.find(key); known != problems_.end()) problems_.erase(known);
}

void Problems::add(std::string_view key, std::uint64_t count) {
  const std::lock_guard lock(mutex_);
  const auto known = problems_.find(key);
  if (known == problems_.end()) return;
  known->second.count += count;
  known->second.calm = 0;
}

Problem Problems::find(std::string_view key) const {
  const std::lock_guard lock(mutex_);
  const auto known = problems_.find(key);
  return known == problems_.end() ? Problem() : known->second;
}

std::vector<Problem> Problems::list() const {
  std::vector<Problem> all;
  const std::lock_guard lock(mutex_);
  for (const auto& [key, problem] : problems_) {
    if (problem.calm == 0) all.push_back(problem);
  }
  std::stable_partition(all.begin(), all.end(), [](const Problem& p) { return p.level == Problem::Level::kFailed; });
  return all;
}

}  // namespace prism
