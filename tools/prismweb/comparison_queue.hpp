// SPDX-License-Identifier: MIT
// The order in which passwords are compared: fair between client addresses, so that many guessers keep nobody out.
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

/// What is remembered of client addresses, for ten minutes after their last request. At most 1024: then the one whose
/// last request is oldest is forgotten.
class ClientAddresses {
 public:
  static constexpr std::size_t kMaxAddresses = 1024;
  static constexpr std::chrono::minutes kRemembered{10};
  static constexpr std::chrono::seconds kMaxDelay{8};

  struct Address {
    SteadyTime first_seen, last_seen;
    int failures;  ///< wrong passwords since the last right one
    SteadyTime last_failure;
  };

  void seen(const std::string& address, SteadyTime now);
  void failed(const std::string& address, SteadyTime now);
  void succeeded(const std::string& address);
  /// Returns nullopt for an unknown address. Failures that are ten minutes old do not count.
  std::optional<Address> find(const std::string& address, SteadyTime now) const;
  /// When the next password of an address may be compared: 1, 2, 4, 8, 8, … s after its last failure.
  static SteadyTime not_before(const Address& address);
  std::size_t size() const { return addresses_.size(); }

 private:
  std::map<std::string, Address> addresses_;
};

/// Passwords that wait for the one thread that compares. Addresses without failures come first, and of these the
/// address that was seen first most recently: in a flood some clients wait long in any order, and so it is not the new
/// ones. Then addresses with failures, each after its delay, in turns: the one whose last failure is oldest.
class ComparisonQueue {
 public:
  static constexpr std::size_t kMaxPerAddress = 8;
  static constexpr std::chrono::seconds kMaxWait{10};

  /// Address of the client, digest of what it sent.
  using Key = std::pair<std::string, std::string>;

  /// Returns false if eight passwords of this address wait.
  bool add(const Key& key, SteadyTime now);
  /// Removes and returns the password to compare next, if there is one at this time.
  std::optional<Key> take(SteadyTime now);
  /// Removes and returns those that have waited 10 s.
  std::vector<Key> take_expired(SteadyTime now);
  /// When take() or take_expired() may return something; nullopt if none waits.
  std::optional<SteadyTime> next_time(SteadyTime now) const;

  ClientAddresses& addresses() { return addresses_; }

 private:
  struct Waiting {
    Key key;
    SteadyTime since;
  };
  ClientAddresses::Address address_of(const std::string& address, SteadyTime now) const;

  ClientAddresses addresses_;
  std::vector<Waiting> waiting_;  ///< in the order of their arrival
};

}  // namespace prism::prismweb
