// SPDX-License-Identifier: MIT
// Order of password comparisons: fair between client addresses, so that many guessers do not block other users.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace prism::prismweb {

using SteadyTime = std::chrono::steady_clock::time_point;

/// Client addresses and their failures, kept for ten minutes after the last request. At most 1024; then the one with
/// the oldest last request is removed.
class ClientAddresses {
 public:
  static constexpr std::size_t kMaxAddresses = 1024;
  static constexpr std::chrono::minutes kRemembered{10};
  static constexpr std::chrono::seconds kMaxDelay{8};

  struct Address {
    SteadyTime first_seen, last_seen;
    int failures;  ///< wrong passwords since the last correct one
    SteadyTime last_failure;
  };

  void seen(const std::string& address, SteadyTime now);
  void failed(const std::string& address, SteadyTime now);
  void succeeded(const std::string& address);
  /// Returns nullopt for an unknown address. Ignores failures older than ten minutes.
  std::optional<Address> find(const std::string& address, SteadyTime now) const;
  /// Earliest time to compare the address's next password: 1, 2, 4, 8, 8, … s after its last failure.
  static SteadyTime not_before(const Address& address);
  std::size_t size() const { return addresses_.size(); }

 private:
  std::map<std::string, Address> addresses_;
};

/// Passwords that wait for the comparing thread. Order:
/// 1. addresses without failures, the newest address first: in a flood some clients must wait long, and this order
///    spares new ones
/// 2. addresses with failures, each after its delay, the one with the oldest last failure first
class ComparisonQueue {
 public:
  static constexpr std::size_t kMaxPerAddress = 8;
  static constexpr std::chrono::seconds kMaxWait{10};

  /// Address of the client, digest of its Authorization field.
  using Key = std::pair<std::string, std::string>;

  /// Returns false if eight passwords of this address are waiting.
  bool add(const Key& key, SteadyTime now);
  /// Removes and returns the next password; nullopt if none may be compared now.
  std::optional<Key> take(SteadyTime now);
  /// Removes and returns the passwords that have waited 10 s.
  std::vector<Key> take_expired(SteadyTime now);
  /// Earliest time at which take() or take_expired() may return a password; nullopt if the queue is empty.
  std::optional<SteadyTime> next_time(SteadyTime now) const;

  ClientAddresses& addresses() { return addresses_; }

 private:
  struct Waiting {
    Key key;
    SteadyTime since;
  };
  ClientAddresses::Address address_of(const std::string& address, SteadyTime now) const;

  ClientAddresses addresses_;
  std::vector<Waiting> waiting_;  ///< oldest first
};

}  // namespace prism::prismweb
