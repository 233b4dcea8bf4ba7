// SPDX-License-Identifier: MIT
#include "tools/prismweb/web_server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/time_scale.hpp"
#include "config/version.hpp"
#include "tools/prismweb/api.hpp"
#include "tools/prismweb/archive.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/client.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/metrics_page.hpp"
#include "tools/prismweb/static_files.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using nlohmann::json;

constexpr std::size_t kMaxClients = 64;
constexpr std::string_view kLibrary = "/dygraphs";

constexpr std::chrono::seconds kDrainTimeout{3}, kTrimInterval{5};

void log_disk(const std::string& what) { fmt::print(stderr, "prismweb: the disk {}\n", what); }

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

Answer file_answer(const Settings& settings, const Request& request) {
  if (request.method != "GET" && request.method != "HEAD") return plain(405, "expected GET or HEAD");
  const std::string_view target = request.target;
  const bool library = target.starts_with(std::string(kLibrary) + "/");
  StaticFile file =
      library ? read_static(settings.dygraphs, target.substr(kLibrary.size()), 3) : read_static(settings.page, target);
  if (file.status != 200) return plain(404, "no such file");
  if (request.if_none_match == file.etag) return {304, {}, {}, std::move(file.etag), {}};
  return {200, std::move(file.media_type), std::move(file.body), std::move(file.etag), {}};
}

}  // namespace

WebServer::WebServer(asio::io_context& io, const Settings& settings, std::unique_ptr<TokenAccess> tokens)
    : io_(io),
      settings_(settings),
      disk_(0, [](const std::string& why) { fmt::print(stderr, "prismweb: disk: {}\n", why); }),
      tokens_(std::move(tokens)),
      host_(host_name()),
      hosts_(settings.address, settings.hosts),
      instances_(io, settings.instances) {
  instances_.on_change = [this] { send_instances(); };
  instances_.on_new = [this](InstanceProxy& proxy) {
    Archive& archive = *(archives_[proxy.name()] = std::make_unique<Archive>(io_, proxy, disk_, settings_.state));
    proxy.on_connect = [&archive] { archive.connected(); };
    proxy.on_notification = [&archive](const Notification& notification) { archive.notified(notification); };
  };
}

WebServer::~WebServer() = default;

Archive* WebServer::archive(const std::string& instance) {
  const auto found = archives_.find(instance);
  return found == archives_.end() ? nullptr : found->second.get();
}

void WebServer::start() {
  instances_.start();
  asio::co_spawn(io_, watch_disk(), asio::detached);
  asio::co_spawn(io_, trim_memory(), asio::detached);
}

bool WebServer::finish() {
  for (const auto& [name, archive] : archives_) archive->finish();
  return disk_.drain(kDrainTimeout);
}

// A blocked disk returns no error, so it is polled.
asio::awaitable<void> WebServer::watch_disk() {
  asio::steady_timer tick(io_);
  for (bool is_blocked = false;;) {
    tick.expires_after(std::chrono::seconds(1));
    co_await tick.async_wait(kUse);
    const bool was_blocked = std::exchange(is_blocked, disk_.busy_for() >= kDiskTimeout);
    if (is_blocked && !was_blocked)
      log_disk(fmt::format("has not answered for {} s; minutes and hours are delayed", kDiskTimeout.count()));
    if (was_blocked && !is_blocked) log_disk("answers again");
  }
}

asio::awaitable<void> WebServer::trim_memory() {
  asio::steady_timer tick(io_);
  for (;;) {
    tick.expires_after(scaled(kTrimInterval));
    co_await tick.async_wait(kUse);
    unsent_memory_->trim();
  }
}

Admission WebServer::admit(const Request& request) const {
  if (!hosts_.allows_host(request.host)) return {421};
  if (!hosts_.allows_origin(request.origin)) return {403};
  const bool is_authenticated = !tokens_ || tokens_->is_authenticated(request);
  return {is_api(request.target) && !is_authenticated ? 401 : 0, is_authenticated};
}

// The printed address works once. Opening it again in a browser with a session has no effect.
Answer WebServer::begin_session(const Request& request, bool is_authenticated) {
  if (!tokens_) return plain(404, "this server does not use tokens");
  if (request.method != "POST") return plain(405, "expected POST");
  Answer answer = plain(204, "");
  answer.body.clear();
  const auto cookie = tokens_->begin_session(bearer_of(request.authorization));
  if (cookie) answer.cookie = *cookie;
  if (cookie || is_authenticated) return answer;
  answer = plain(401, "this address was already used; \"systemctl reload prismweb\" prints a new one");
  answer.is_last = true;
  return answer;
}

asio::awaitable<Answer> WebServer::answer(const Request& request, bool is_authenticated) {
  if (request.target == "/session") co_return begin_session(request, is_authenticated);
  if (is_api(request.target)) {
    if (request.method != "GET") co_return plain(405, "expected GET");
    Answer answer;
    if (request.target == "/metrics" || request.target.starts_with("/metrics?")) {
      answer = co_await metrics_answer(*this);
    } else {
      answer = co_await api_answer(*this, request.target);
    }
    co_return answer;
  }
  co_return file_answer(settings_, request);
}

std::string WebServer::greeting() const {
  return json_text({{"ready", true}, {"host", host_}, {"version", kVersion}, {"instances", instances_.listing()}});
}

bool WebServer::has_room_for_client() const { return clients_.size() < kMaxClients; }

void WebServer::send_instances() {
  const json list = {{"jsonrpc", "2.0"}, {"method", "instances"}, {"params", instances_.listing()}};
  const auto text = std::make_shared<const std::string>(json_text(list));
  for (Client* client : std::set(clients_)) {
    if (clients_.contains(client)) client->instances_changed(text);
  }
}

}  // namespace prism::prismweb
