// SPDX-License-Identifier: MIT
#include "tools/prismweb/comparison_queue.hpp"

#include <algorithm>

namespace prism::prismweb {

void ClientAddresses::seen(const std::string& address, SteadyTime now) {
  if (const auto found = addresses_.find(address); found != addresses_.end()) {
    found->second.last_seen = now;
    return;
  }
  std::erase_if(addresses_, [&](const auto& one) { return now - one.second.last_seen >= kRemembered; });
  if (addresses_.size() >= kMaxAddresses) {
    const auto older = [](const auto& a, const auto& b) { return a.second.last_seen < b.second.last_seen; };
    addresses_.erase(std::min_element(addresses_.begin(), addresses_.end(), older));
  }
  addresses_.emplace(address, Address{now, now, 0, now});
}

void ClientAddresses::failed(const std::string& address, SteadyTime now) {
  seen(address, now);
  Address& known = addresses_.at(address);
  ++known.failures;
  known.last_failure = now;
}

void ClientAddresses::succeeded(const std::string& address) {
  if (const auto found = addresses_.find(address); found != addresses_.end()) found->second.failures = 0;
}

std::optional<ClientAddresses::Address> ClientAddresses::find(const std::string& address, SteadyTime now) const {
  const auto found = addresses_.find(address);
  if (found == addresses_.end()) return std::nullopt;
  Address known = found->second;
  if (now - known.last_failure >= kRemembered) known.failures = 0;
  return known;
}

SteadyTime ClientAddresses::not_before(const Address& address) {
  if (address.failures == 0) return address.last_seen;
  const std::chrono::seconds delay(1 << std::min(address.failures - 1, 3));
  return address.last_failure + std::min(delay, kMaxDelay);
}

namespace {

// True if `a` is compared before `b`, which was queued earlier. Both may be compared now.
bool is_before(const ClientAddresses::Address& a, const ClientAddresses::Address& b) {
  if ((a.failures == 0) != (b.failures == 0)) return a.failures == 0;
  if (a.failures == 0) return a.first_seen >= b.first_seen;
  return a.last_failure < b.last_failure;
}

}  // namespace

bool ComparisonQueue::add(const Key& key, SteadyTime now) {
  const auto is_same = [&](const Waiting& one) { return one.key.first == key.first; };
  if (std::count_if(waiting_.begin(), waiting_.end(), is_same) >= static_cast<std::ptrdiff_t>(kMaxPerAddress))
    return false;
  addresses_.seen(key.first, now);
  waiting_.push_back({key, now});
  return true;
}

// A removed address counts as new.
ClientAddresses::Address ComparisonQueue::address_of(const std::string& address, SteadyTime now) const {
  return addresses_.find(address, now).value_or(ClientAddresses::Address{now, now, 0, now});
}

std::optional<ComparisonQueue::Key> ComparisonQueue::take(SteadyTime now) {
  auto best = waiting_.end();
  std::optional<ClientAddresses::Address> best_address;
  for (auto one = waiting_.begin(); one != waiting_.end(); ++one) {
    const auto address = address_of(one->key.first, now);
    if (ClientAddresses::not_before(address) > now || (best_address && !is_before(address, *best_address))) continue;
    best = one;
    best_address = address;
  }
  if (best == waiting_.end()) return std::nullopt;
  Key key = std::move(best->key);
  waiting_.erase(best);
  return key;
}

std::vector<ComparisonQueue::Key> ComparisonQueue::take_expired(SteadyTime now) {
  std::vector<Key> expired;
  std::erase_if(waiting_, [&](const Waiting& one) {
    const bool is_expired = now - one.since >= kMaxWait;
    if (is_expired) expired.push_back(one.key);
    return is_expired;
  });
  return expired;
}

std::optional<SteadyTime> ComparisonQueue::next_time(SteadyTime now) const {
  std::optional<SteadyTime> next;
  for (const Waiting& one : waiting_) {
    const SteadyTime not_before = ClientAddresses::not_before(address_of(one.key.first, now));
    const SteadyTime time = std::min(not_before, one.since + kMaxWait);
    if (!next || time < *next) next = time;
  }
  return next;
}

}  // namespace prism::prismweb
