// SPDX-License-Identifier: MIT
// What is served, whatever stream it is served on: files, plain JSON, and the clients of the WebSocket.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "base/disk_thread.hpp"
#include "tools/prismweb/access.hpp"
#include "tools/prismweb/foxglove_protocol.hpp"
#include "tools/prismweb/gate.hpp"
#include "tools/prismweb/http_message.hpp"
#include "tools/prismweb/instances.hpp"
#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

class Archive;
class Client;
class PlotJuggler;

class Site : public std::enable_shared_from_this<Site> {
 public:
  Site(boost::asio::io_context& io, const Settings& settings, std::string token, PasswordHashes hashes);
  ~Site();

  void start();

  /// What every request must pass. Files of the page need no token, and the WebSocket's first message brings it.
  boost::asio::awaitable<Refusal> refusal(const Request& request);
  /// The answer to a request that passed.
  boost::asio::awaitable<Answer> answer(const Request& request);

  bool is_token(std::string_view given) const { return token_.empty() || is_secret(given, token_); }
  /// The first line of a client that was let in.
  std::string greeting() const;

  /// Whether a request that was not refused has shown who is there: a page's files need no token.
  bool proves(const Request& request) const;

  bool has_room_for_client() const;
  static constexpr std::string_view kNoRoom = "64 clients are connected, expected fewer";
  void add(Client* client) { clients_.insert(client); }
  void remove(Client* client) { clients_.erase(client); }

  /// Why a request for /foxglove that passed is not served all the same. `protocol`: that was chosen; empty: none.
  std::optional<Answer> foxglove_refusal(std::string_view protocol) const;
  const FoxgloveTopics& foxglove_topics() const { return foxglove_topics_; }
  const std::string& host() const { return host_; }

  Instances& instances() { return instances_; }
  /// The series of an instance; none where there is no such instance.
  Archive* archive(const std::string& instance);
  /// Keeps what is to outlast the program. False: the disk did not take it in time, and its thread still waits.
  bool finish();
  boost::asio::io_context& io() { return io_; }

 private:
  void tell_instances();
  bool allows_origin(const Request& request) const;
  bool has_token(const Request& request) const;
  boost::asio::awaitable<void> watch_disk();

  boost::asio::io_context& io_;
  Settings settings_;
  DiskThread disk_;  ///< outlives the archives
  std::string token_;
  std::string host_;
  HostList hosts_;
  Gate gate_;
  std::unique_ptr<PlotJuggler> plotjuggler_;  ///< outlives the instances that it listens to
  Instances instances_;
  std::map<std::string, std::unique_ptr<Archive>> archives_;
  FoxgloveTopics foxglove_topics_;
  std::set<Client*> clients_;
};

}  // namespace prism::prismweb
