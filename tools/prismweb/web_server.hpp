// SPDX-License-Identifier: MIT
// The web server, independent of the stream: files, JSON API, WebSocket clients.
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
#include "tools/prismweb/http_message.hpp"
#include "tools/prismweb/instances.hpp"
#include "tools/prismweb/settings.hpp"
#include "tools/prismweb/token_access.hpp"
#include "tools/prismweb/unsent_memory.hpp"

namespace prism::prismweb {

class Archive;
class Client;

class WebServer : public std::enable_shared_from_this<WebServer> {
 public:
  /// `tokens`: null if the mode of a Unix socket controls access.
  WebServer(boost::asio::io_context& io, const Settings& settings, std::unique_ptr<TokenAccess> tokens);
  ~WebServer();

  void start();

  /// Checks Host, Origin, and token or cookie. The page's files need no token; for the WebSocket, the first message may
  /// contain it.
  Admission admit(const Request& request) const;
  /// Returns the response to an admitted request.
  boost::asio::awaitable<Answer> answer(const Request& request, bool is_authenticated);

  /// Always true without tokens.
  bool is_program_token(std::string_view given) const { return !tokens_ || tokens_->is_program_token(given); }
  TokenAccess* tokens() { return tokens_.get(); }

  /// The first message to an admitted WebSocket client.
  std::string greeting() const;

  bool has_room_for_client() const;
  static constexpr std::string_view kNoRoom = "64 clients are connected; retry later";
  void add(Client* client) { clients_.insert(client); }
  void remove(Client* client) { clients_.erase(client); }

  Instances& instances() { return instances_; }
  /// Returns the archive of an instance, or null.
  Archive* archive(const std::string& instance);
  /// Writes the stores to disk. Returns false after 3 s: the disk thread is still blocked.
  bool finish();
  boost::asio::io_context& io() { return io_; }
  const std::shared_ptr<UnsentMemory>& unsent_memory() const { return unsent_memory_; }

 private:
  void send_instances();
  Answer begin_session(const Request& request, bool is_authenticated);
  boost::asio::awaitable<void> watch_disk();
  boost::asio::awaitable<void> trim_memory();

  boost::asio::io_context& io_;
  Settings settings_;
  DiskThread disk_;  ///< must outlive the archives
  std::unique_ptr<TokenAccess> tokens_;
  std::string host_;
  HostList hosts_;
  Instances instances_;
  std::map<std::string, std::unique_ptr<Archive>> archives_;
  std::set<Client*> clients_;
  const std::shared_ptr<UnsentMemory> unsent_memory_ = std::make_shared<UnsentMemory>();
};

}  // namespace prism::prismweb
