// SPDX-License-Identifier: MIT
// Batches prismd's notifications: one text per distinct subscription, shared by its clients.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace prism::prismweb {

/// A text shared by the queues of several clients.
using Text = std::shared_ptr<const std::string>;

/// Streams that a client receives from an instance.
struct Subscription {
  std::uint32_t sample_every = 0;  ///< 0: no samples
  bool windows = false, events = false;
  std::vector<std::string> axes;  ///< empty: all

  bool any() const { return sample_every > 0 || windows || events; }
  bool operator==(const Subscription&) const = default;
};

/// An unsolicited line of prismd: {"jsonrpc":"2.0","method":"sample","params":{"axis":"z",…}}. Views of the text that
/// was parsed.
struct Notification {
  std::string_view method;
  std::string_view axis;  ///< empty: not of an axis
  std::string_view line;  ///< complete, without the newline
};

/// Parses the start of a line, in the form that prismd writes. `method` is empty for any other line. The result is
/// valid as long as the text of `line`.
Notification notification_of(std::string_view line);

class Subscriber {
 public:
  virtual ~Subscriber() = default;
  /// Delivers a batch of `rows` notifications. Within SubscriptionTable::flush() it may end subscriptions and destroy
  /// subscribers, also itself; within set() it must not destroy the subscriber.
  virtual void deliver(const std::string& instance, const Text& text, std::uint64_t rows) = 0;
};

/// The subscriptions to one instance. Does not own the subscribers: each must unsubscribe before its destruction.
class SubscriptionTable {
 public:
  explicit SubscriptionTable(std::string instance) : instance_(std::move(instance)) {}

  /// Replaces the subscription of `subscriber`. If it changed, first delivers the subscriber's pending batch, so that
  /// notifications are neither lost nor repeated. An empty subscription removes the subscriber and discards its batch.
  void set(Subscriber* subscriber, const Subscription& subscription);
  Subscription subscription_of(const Subscriber* subscriber) const;

  /// Greatest common divisor of the subscribers' sample_every; 0 without sample subscribers.
  std::uint32_t sample_every() const;

  /// Adds a notification to the batches: samples and windows by axis, events to all that want events, other methods
  /// ("lost") to all subscribers. prismd must be subscribed with `every` = sample_every().
  void put(const Notification& notification);
  bool pending() const;
  /// Delivers the batches {"instance":…,"batch":[…]}, serialised once per distinct subscription.
  void flush();

 private:
  struct Listener {
    Subscriber* subscriber;
    std::size_t from = 0;  ///< skip `lines` before this offset: added before it subscribed
    std::uint64_t from_rows = 0;
  };
  struct Group {
    Subscription subscription;
    std::vector<Listener> listeners;
    std::map<std::string, std::uint32_t, std::less<>> remaining;  ///< by axis: samples until the next to send
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
