// SPDX-License-Identifier: MIT
// The instances of prismd: each with its connections, history and subscribers.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/disk_thread.hpp"
#include "tools/client/client.hpp"
#include "tools/client/instances.hpp"
#include "tools/prismweb/history.hpp"

namespace prism::prismweb {

/// A text shared by the queues of several clients.
using Text = std::shared_ptr<const std::string>;

/// Streams that a client receives from an instance.
struct Subscription {
  std::uint32_t sample_every = 0;  ///< 0: no samples
  bool windows = false, events = false;
  std::vector<std::string> axes;  ///< sorted; empty: all

  bool operator==(const Subscription&) const = default;
};

/// Applies the params of subscribe (`on`) or unsubscribe to the subscription `before`, as prismd does. Errors: other
/// members than `streams`, `every`, `axes`; an invalid value.
Result<Subscription> subscription_of(const nlohmann::json& params, bool on, Subscription before);

/// An unsolicited line of prismd: {"jsonrpc":"2.0","method":"sample","params":{"axis":"z",…}}.
struct Notification {
  std::string_view method;  ///< empty: another line
  std::string_view axis;    ///< empty: not of an axis
  std::string_view line;    ///< complete, without the newline
};
/// Parses the start of a line, in the form that prismd writes.
Notification notification_of(std::string_view line);

/// A client of the page. It must unsubscribe from all instances before its destruction.
class Subscriber {
 public:
  virtual ~Subscriber() = default;
  /// Delivers a batch of `rows` notifications. Must not change subscriptions.
  virtual void deliver(const std::string& instance, const Text& batch, std::uint64_t rows) = 0;
  /// The list of instances changed.
  virtual void announce(const Text& notification) = 0;
};

/// Notifications for one client since its last batch.
struct Batch {
  Subscription subscription;
  std::map<std::string, std::uint32_t, std::less<>> skipped;  ///< samples by axis, since the last one sent
  std::string lines;
  std::uint64_t rows = 0;

  /// Adds the notification if the subscription has it; `every`: prismd sends every n-th sample.
  void put(const Notification& notification, std::uint32_t every);
};

class GyroProxies;

/// One instance. Reconnects without end; never starts a stopped instance.
class GyroProxy {
 public:
  GyroProxy(GyroProxies& all, const client::InstanceSocket& instance);

  /// Calls a method of prismd. Returns a member of the response. Errors at once: prismd is not running, too many
  /// requests are pending, the params are too long; after 15 s: no response. Requests are sent one at a time; those
  /// with long responses have a connection of their own, so that they do not delay short ones.
  boost::asio::awaitable<std::string> call(std::string method, nlohmann::json params);

  /// Sets the subscription of a client; an empty one removes it. Rows that were put before are delivered.
  void subscribe(Subscriber* subscriber, const Subscription& subscription);
  Subscription subscription_of(Subscriber* subscriber) const;

  /// The history of the axis in params, which may omit the only one. nullptr if it does not exist: see wrong_axis().
  std::shared_ptr<History> history(const nlohmann::json& params) const;
  std::string wrong_axis() const;  ///< a member of a response

  const std::string& name() const { return short_.name(); }
  const std::vector<std::string>& axes() const { return axes_; }
  nlohmann::json listing() const;  ///< {"name","state","axes"}

  /// Delivers the batches. Returns false if all are empty.
  bool flush();

 private:
  boost::asio::awaitable<std::string> session();
  void take_notification(std::string_view line);
  bool is_running() const { return state_ == client::State::kConnected; }
  void take_axes(const nlohmann::json& status);
  std::uint32_t sample_every() const;

  GyroProxies& all_;
  client::Client short_, long_;                 ///< short_: also notifications
  client::State state_ = client::State::kGone;  ///< kConnected: also the axes are known
  std::vector<std::string> axes_;
  std::string problem_;  ///< why the last connection was rejected
  std::map<std::string, std::shared_ptr<History>, std::less<>> histories_;
  std::map<Subscriber*, Batch> batches_;
  boost::asio::steady_timer resubscribe_;
  std::uint32_t every_ = 0;  ///< that was requested from prismd
};

/// All instances served. Finds them every 2 s and delivers batches, until the context ends.
class GyroProxies {
 public:
  /// `wanted`: entries of client::list_instances(); empty: all of the host. `state`: directory of the stores.
  GyroProxies(boost::asio::io_context& io, DiskThread& disk, std::vector<std::string> wanted, std::string state);

  GyroProxy* find(std::string_view name) const;
  const std::vector<std::unique_ptr<GyroProxy>>& all() const { return proxies_; }
  nlohmann::json listing() const;

  void add(Subscriber* subscriber) { subscribers_.insert(subscriber); }
  void remove(Subscriber* subscriber);
  std::size_t subscribers() const { return subscribers_.size(); }
  /// Sends the list of instances to all subscribers.
  void announce() const;

 private:
  friend GyroProxy;
  boost::asio::awaitable<void> find_instances();
  boost::asio::awaitable<void> flush_in_turn();

  boost::asio::io_context& io_;
  DiskThread& disk_;
  const std::vector<std::string> wanted_;
  const std::string state_;
  std::vector<std::unique_ptr<GyroProxy>> proxies_;
  std::set<Subscriber*> subscribers_;
};

/// Makes a path component from a name: all characters except letters, digits, '_', '-' and '.' become %XX, as does a
/// leading '.'.
std::string path_part(const std::string& name);

}  // namespace prism::prismweb
