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
#include <utility>

#include "base/disk_thread.hpp"
#include "tools/prismweb/access.hpp"
#include "tools/prismweb/foxglove_protocol.hpp"
#include "tools/prismweb/http_message.hpp"
#include "tools/prismweb/instances.hpp"
#include "tools/prismweb/password_authenticator.hpp"
#include "tools/prismweb/send_queue.hpp"
#include "tools/prismweb/settings.hpp"
#include "tools/prismweb/token_access.hpp"

namespace prism::prismweb {

class Archive;
class Client;
class PlotJuggler;

class WebServer : public std::enable_shared_from_this<WebServer> {
 public:
  /// `tokens`: null if passwords or the mode of a unix socket decide who may connect.
  WebServer(boost::asio::io_context& io, const Settings& settings, std::unique_ptr<TokenAccess> tokens,
            PasswordHashes hashes);
  ~WebServer();

  void start();

  /// Checks Host, Origin, and password, token or cookie. The page's files need no token, and the WebSocket's first
  /// message may have it.
  boost::asio::awaitable<Admission> admit(const Request& request, std::shared_ptr<Connection> connection);
  /// The answer to a request that was admitted.
  boost::asio::awaitable<Answer> answer(const Request& request, bool is_authenticated);

  /// True if there are no tokens.
  bool is_program_token(std::string_view given) const { return !tokens_ || tokens_->is_program_token(given); }
  TokenAccess* tokens() { return tokens_.get(); }
  /// Uses these passwords from now on; returns the names whose sessions must end (PasswordAuthenticator::replace()).
  std::set<std::string> replace_passwords(PasswordHashes hashes) { return passwords_.replace(std::move(hashes)); }
  bool has_failures(const std::string& address) { return passwords_.has_failures(address); }

  /// The first line of a client that was let in.
  std::string greeting() const;

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
  const std::shared_ptr<AnswerMemory>& answer_memory() const { return answer_memory_; }

 private:
  void send_instances();
  bool allows_origin(const Request& request) const;
  bool has_token(const Request& request) const;
  Answer begin_session(const Request& request, bool is_authenticated);
  boost::asio::awaitable<void> watch_disk();

  boost::asio::io_context& io_;
  Settings settings_;
  DiskThread disk_;  ///< outlives the archives
  std::unique_ptr<TokenAccess> tokens_;
  std::string host_;
  HostList hosts_;
  PasswordAuthenticator passwords_;
  std::unique_ptr<PlotJuggler> plotjuggler_;  ///< outlives the instances that it listens to
  Instances instances_;
  std::map<std::string, std::unique_ptr<Archive>> archives_;
  FoxgloveTopics foxglove_topics_;
  std::set<Client*> clients_;
  const std::shared_ptr<AnswerMemory> answer_memory_ = std::make_shared<AnswerMemory>();
};

}  // namespace prism::prismweb
