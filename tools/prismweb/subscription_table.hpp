// SPDX-License-Identifier: MIT
// What prismd sends by itself, gathered: a text for each different wish, however many clients have it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace prism::prismweb {

/// A text that queues of several clients share.
using Text = std::shared_ptr<const std::string>;

/// What a client wants of an instance.
struct Subscription {
  std::uint32_t sample_every = 0;  ///< 0: no samples
  bool windows = false, events = false;
  std::vector<std::string> axes;  ///< empty: all

  bool any() const { return sample_every > 0 || windows || events; }
  bool operator==(const Subscription&) const = default;
};

/// A line of prismd that answers nobody: {"jsonrpc":"2.0","method":"sample","params":{"axis":"z",…}}.
struct Notification {
  std::string_view method;
  std::string_view axis;  ///< empty: of no axis
  std::string_view line;  ///< whole, without its line end
};

/// Reads a line that begins as prismd writes it; method stays empty where it is something else.
Notification notification_of(std::string_view line);

class Subscriber {
 public:
  virtual ~Subscriber() = default;
  /// A batch of `instance` with so many notifications in it.
  virtual void deliver(const std::string& instance, const Text& text, std::uint64_t rows) = 0;
};

/// The wishes at one instance.
class SubscriptionTable {
 public:
  explicit SubscriptionTable(std::string instance) : instance_(std::move(instance)) {}

  /// Replaces what `who` wanted; nothing any more where the wish is empty. What was gathered for it is handed over
  /// first, so that a wish that grows loses nothing and brings nothing twice.
  void set(Subscriber* subscriber, const Subscription& subscription);
  Subscription subscription_of(const Subscriber* subscriber) const;

  /// The wishes joined: the greatest common divisor of their sample_every; 0 where nobody wants samples.
  std::uint32_t sample_every() const;

  /// One of those that arrive when each sample_every()-th sample is subscribed to.
  void put(const Notification& notification);
  bool pending() const;
  /// Hands what was gathered to those who want it: {"instance":…,"batch":[…]}, serialised once for each wish.
  void flush();

 private:
  struct Listener {
    Subscriber* subscriber;
    std::size_t from = 0;  ///< what lies in `lines` already is not for it
    std::uint64_t from_rows = 0;
  };
  struct Group {
    Subscription subscription;
    std::vector<Listener> listeners;
    std::map<std::string, std::uint32_t, std::less<>> seen;  ///< samples of each axis since the last that was taken
    std::string lines;
    std::uint64_t rows = 0;
  };
  const Group* group_of(const Subscriber* subscriber) const;
  void deliver_pending(Subscriber* subscriber) const;
  Text batch_of(const Group& group, std::size_t from) const;
  bool wants(Group& group, const Notification& notification, std::uint32_t every) const;

  std::string instance_;
  std::vector<Group> subscriptions_;
};

}  // namespace prism::prismweb
