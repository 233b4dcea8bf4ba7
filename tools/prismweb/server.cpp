// SPDX-License-Identifier: MIT
#include "tools/prismweb/server.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <exception>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "config/socket_protocol.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using client::error_member;
using client::kUse;
using nlohmann::json;
using std::chrono::seconds;
using Stream = beast::basic_stream<asio::generic::stream_protocol>;
using Fields = http::request<http::empty_body>;
using Parser = http::request_parser<http::empty_body>;

constexpr int kBacklog = 64;
constexpr int kSendBufferBytes = 256 << 10;  // limits unread data of a client in the kernel
constexpr mode_t kSocketMode = 0660;
constexpr std::uint32_t kMaxHeaderBytes = 8 << 10;
constexpr std::size_t kMaxDiscardBytes = 1 << 20, kMaxMessageBytes = 64 << 10;
constexpr seconds kRequest{10}, kNextRequest{60}, kDiscard{2};
constexpr seconds kFirstMessage{10}, kSilence{30}, kWriteTimeout{30}, kWatchInterval{5};
constexpr seconds kPausedSilence{600};  // a client that is not read cannot answer pings
constexpr int kMaxPendingRequests = 32, kMaxLevels = 32;
constexpr std::size_t kMaxClients = 64, kMaxIdBytes = 64, kMinTrimBytes = 1 << 20;
constexpr const char* kNoBody = "found a body, expected none";
// A proxy may check another one of two equal fields than prismweb.
constexpr http::field kSingleFields[] = {http::field::host, http::field::origin, http::field::authorization,
                                         http::field::cookie, http::field::sec_fetch_site};

// The response to a request whose header was read with `error`, if it must be rejected. The connection must then be
// closed, because the start of the next request is unknown.
std::optional<Answer> rejection_of(const Parser& parser, const boost::system::error_code& error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return plain(431, fmt::format("the header is too long, expected at most {} bytes", kMaxHeaderBytes), true);
  if (error == http::error::body_limit) return plain(400, kNoBody, true);
  if (error == http::error::end_of_stream || error == http::error::partial_message) return std::nullopt;
  if (error && error.category() == make_error_code(http::error::bad_value).category())
    return plain(400, "invalid HTTP request: " + error.message(), true);
  if (error) return std::nullopt;
  const auto& fields = parser.get();
  for (const http::field field : kSingleFields) {
    const auto [first, end] = fields.equal_range(field);
    const auto count = std::distance(first, end);
    const std::string name(to_string(field));
    if (count > 1) return plain(400, fmt::format("found {} fields \"{}\", expected one", count, name), true);
  }
  const bool has_body = fields.count(http::field::transfer_encoding) > 0 || !parser.is_done();
  return has_body ? std::optional(plain(400, kNoBody, true)) : std::nullopt;
}

Request request_of(const Fields& fields) {
  const auto text = [&](std::string_view name) { return std::string(fields[name]); };
  return {.method = fields.method_string(),
          .target = fields.target(),
          .host = text("Host"),
          .origin = text("Origin"),
          .authorization = text("Authorization"),
          .if_none_match = text("If-None-Match"),
          .cookie = text("Cookie"),
          .sec_fetch_site = text("Sec-Fetch-Site")};
}

const char* reason_of(int status) {
  if (status == 401) return "expected the token of the token file (Authorization: Bearer TOKEN)";
  if (status == 403) return "the Origin is another site";
  return "the Host is not a name of this server; add it to \"hosts\" in the configuration";
}

http::response<http::string_body> response_of(const Fields& request, Answer answer) {
  http::response<http::string_body> response(static_cast<http::status>(answer.status), request.version());
  response.set("Content-Security-Policy", "default-src 'self'; frame-ancestors 'none'");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  if (!answer.cookie.empty()) response.set(http::field::set_cookie, answer.cookie);
  response.set(http::field::cache_control, answer.etag.empty() ? "no-store" : "no-cache");
  if (!answer.media_type.empty()) response.set(http::field::content_type, answer.media_type);
  if (!answer.etag.empty()) response.set(http::field::etag, answer.etag);
  if (answer.status == 401) response.set(http::field::www_authenticate, "Bearer");
  if (answer.status == 503) response.set(http::field::retry_after, "1");
  response.keep_alive(request.keep_alive() && !answer.is_last);
  const std::size_t size = answer.body.size();
  if (request.method() != http::verb::head) response.body() = std::move(answer.body);
  if (answer.status != 304 && answer.status != 204) response.content_length(size);
  return response;
}

// If the connection is closed with unread data, the kernel resets it and the client may lose the response.
asio::awaitable<void> discard_input(Stream& stream) {
  std::vector<char> buffer(4096);
  const auto space = asio::buffer(buffer);
  stream.expires_after(kDiscard);
  for (std::size_t discarded = 0; discarded < kMaxDiscardBytes;) {
    const auto [error, size] = co_await stream.async_read_some(space, kUse);
    if (error) co_return;
    discarded += size;
  }
}

// Returns false if the connection must be closed.
asio::awaitable<bool> send(Stream& stream, Connection& connection, const Fields& request, Answer& answer) {
  const http::response<http::string_body> response = response_of(request, std::move(answer));
  connection.add_unsent(response.body().size());
  stream.expires_after(kNextRequest);
  const auto [error, size] = co_await http::async_write(stream, response, kUse);
  connection.remove_unsent(response.body().size());
  co_return !error && response.keep_alive();
}

Text text_of(std::string text) { return std::make_shared<const std::string>(std::move(text)); }

/// A client of /ws.
class WsClient final : public Subscriber, public std::enable_shared_from_this<WsClient> {
 public:
  /// `is_authenticated`: by the HTTP request; the first message needs no token.
  WsClient(Stream stream, std::shared_ptr<Router> router, std::shared_ptr<Connection> connection, bool is_authenticated)
      : ws_(std::move(stream)),
        router_(std::move(router)),
        connection_(std::move(connection)),
        is_authenticated_(is_authenticated),
        queue_(connection_),
        long_turn_(router_->io(), 1),
        changed_(router_->io(), asio::steady_timer::time_point::max()),
        tick_(router_->io(), kFirstMessage) {}

  asio::awaitable<void> run(Fields request);

  void deliver(const std::string& instance, const Text& batch, std::uint64_t rows) override {
    queue_.put_batch(instance, batch, rows);
    changed_.cancel();
  }
  void announce(const Text& notification) override { put(notification, SendQueue::kList); }

 private:
  asio::awaitable<void> read();
  asio::awaitable<void> write(std::shared_ptr<WsClient> self);
  asio::awaitable<void> watch(std::shared_ptr<WsClient> self);
  std::optional<websocket::close_reason> message(std::string_view text);
  void request(const json& request);
  void subscribe(const std::string& id, const std::string& instance, const json& params, bool on);
  asio::awaitable<void> respond(std::string id, std::string instance, std::string method, json params);
  void answer(const std::string& id, const std::string& instance, const std::string& member,
              SendQueue::Kind kind = SendQueue::kResponse);
  void put(Text text, SendQueue::Kind kind);
  void set_silence(seconds silence) { ws_.set_option(websocket::stream_base::timeout{kFirstMessage, silence, true}); }
  void drop();
  void end();

  websocket::stream<Stream> ws_;
  const std::shared_ptr<Router> router_;
  const std::shared_ptr<Connection> connection_;
  const bool is_authenticated_;
  bool is_admitted_ = false, is_ended_ = false;
  int pending_requests_ = 0;
  SendQueue queue_;
  Turns long_turn_;
  asio::steady_timer changed_;  ///< cancelled if the queue changed
  asio::steady_timer tick_;     ///< of watch()
  std::optional<std::chrono::steady_clock::time_point> writing_since_;
};

asio::awaitable<void> WsClient::run(Fields request) {
  const auto self = shared_from_this();
  beast::get_lowest_layer(ws_).expires_never();
  set_silence(kSilence);
  ws_.read_message_max(kMaxMessageBytes);
  ws_.auto_fragment(false);
  ws_.text(true);
  const auto [error] = co_await ws_.async_accept(request, kUse);
  if (error) co_return;
  asio::co_spawn(router_->io(), write(self), asio::detached);
  asio::co_spawn(router_->io(), watch(self), asio::detached);
  co_await read();
  end();
}

asio::awaitable<void> WsClient::read() {
  beast::flat_buffer buffer(kMaxMessageBytes);
  for (;;) {
    const auto [error, size] = co_await ws_.async_read(buffer, kUse);
    if (error) co_return;
    const auto data = buffer.cdata();
    const auto reason = message({static_cast<const char*>(data.data()), data.size()});
    buffer.consume(size);
    if (reason) {
      co_await ws_.async_close(*reason, kUse);
      co_return;
    }
    if (!queue_.is_paused()) continue;
    set_silence(kPausedSilence);  // requests of a client that does not read its responses stay in the kernel
    while (queue_.is_paused() && !is_ended_) co_await changed_.async_wait(kUse);
    set_silence(kSilence);
  }
}

asio::awaitable<void> WsClient::write(std::shared_ptr<WsClient> self) {
  for (;;) {
    while (queue_.empty() && !is_ended_) co_await changed_.async_wait(kUse);
    if (is_ended_) co_return;
    const Text text = queue_.front();
    writing_since_ = std::chrono::steady_clock::now();
    const auto buffer = asio::buffer(*text);
    const auto [error, size] = co_await ws_.async_write(buffer, kUse);
    writing_since_.reset();
    queue_.pop();
    changed_.cancel();
    if (error) co_return self->drop();
  }
}

// Disconnects a client that is not admitted in time or does not read.
asio::awaitable<void> WsClient::watch(std::shared_ptr<WsClient> self) {
  co_await tick_.async_wait(kUse);
  const websocket::close_reason late(websocket::close_code::policy_error, "no token received in 10 s");
  if (!is_ended_ && !is_admitted_) co_await ws_.async_close(late, kUse);
  while (!is_ended_) {
    tick_.expires_after(kWatchInterval);
    co_await tick_.async_wait(kUse);
    const auto now = std::chrono::steady_clock::now();
    if (writing_since_ && now - *writing_since_ >= kWriteTimeout) co_return self->drop();
  }
}

// read() then fails.
void WsClient::drop() {
  if (is_ended_) return;
  connection_->fd = -1;
  beast::get_lowest_layer(ws_).close();
  end();
}

void WsClient::end() {
  is_ended_ = true;
  router_->gyros().remove(this);
  queue_.clear();
  changed_.cancel();
  tick_.cancel();
}

// Returns a reason if the client must be disconnected.
std::optional<websocket::close_reason> WsClient::message(std::string_view text) {
  using Reason = websocket::close_reason;
  using enum websocket::close_code;
  if (!ws_.got_text()) return Reason(unknown_data, "found binary data, expected text");
  const json message = parse_json_line(text, kMaxLevels).value_or(json());
  if (is_admitted_) {
    request(message);
    return std::nullopt;
  }
  if (!message.is_object()) return Reason(policy_error, R"(expected {"token": "…"} first)");
  const std::string token = text_member(message, "token");
  const bool is_right = token.empty() ? is_authenticated_ : router_->access().is_program_token(token);
  if (!is_right) return Reason(policy_error, token.empty() ? "found no token" : "wrong token");
  if (router_->gyros().subscribers() >= kMaxClients)
    return Reason(try_again_later, "64 clients are connected; retry later");
  is_admitted_ = connection_->is_known = true;
  announce(text_of(router_->greeting()));
  router_->gyros().add(this);
  return std::nullopt;
}

void WsClient::request(const json& request) {
  const json& id = member(request, "id");
  const std::string id_text = json_text(id);
  const std::size_t id_bytes = id.is_string() ? id.get_ref<const std::string&>().size() : id_text.size();
  if (!(id.is_number() || id.is_string()) || id_bytes > kMaxIdBytes)
    return answer("null", "",
                  error_member(config::kInvalidRequest,
                               request.is_object() ? "expected \"id\", a number or a string of at most 64 bytes"
                                                   : "expected a request, a JSON object"));
  const std::string instance = text_member(request, "instance"), method = text_member(request, "method");
  const json& params = member(request, "params");
  if (method == "subscribe" || method == "unsubscribe")
    return subscribe(id_text, instance, params, method == "subscribe");
  const config::SocketMethod* const known = config::find_method(method);
  if (known != nullptr && known->of_axes && member(request, "protocol") != config::kProtocol)
    return answer(id_text, instance, error_member(config::kInvalidRequest, std::string(config::kOlderClient)));
  if (pending_requests_ >= kMaxPendingRequests)
    return answer(id_text, instance, error_member(config::kBusy, "32 requests are pending; wait for a response"));
  ++pending_requests_;
  asio::co_spawn(router_->io(), respond(id_text, instance, method, params), asio::detached);
}

// A long response is sent before the next one is requested, so that one client cannot queue many.
asio::awaitable<void> WsClient::respond(std::string id, std::string instance, std::string method, json params) {
  const auto self = shared_from_this();
  const bool is_long = is_long_method(method);
  std::shared_ptr<void> turn;
  if (is_long) turn = co_await long_turn_.take();
  std::string member = error_member(config::kGone, "");
  if (!is_ended_) member = co_await router_->call(instance, std::move(method), std::move(params));
  --pending_requests_;
  if (is_long && member.size() > SendQueue::kMaxResponseBytes)
    member = error_member(config::kFailed, fmt::format("the response has {} bytes, expected at most {}; request one "
                                                       "axis, or less",
                                                       member.size(), SendQueue::kMaxResponseBytes));
  answer(id, instance, member, is_long ? SendQueue::kLong : SendQueue::kResponse);
  while (is_long && queue_.is_sending_long()) co_await changed_.async_wait(kUse);
}

void WsClient::subscribe(const std::string& id, const std::string& instance, const json& params, bool on) {
  const auto refuse = [&](const std::string& why) { answer(id, instance, error_member(config::kInvalidParams, why)); };
  GyroProxy* const gyro = router_->gyros().find(instance);
  if (gyro == nullptr) return refuse("no such instance");
  const auto subscription = subscription_of(params, on, gyro->subscription_of(this));
  if (!subscription) return refuse(subscription.error().text());
  const auto& axes = gyro->axes();
  for (const std::string& axis : subscription->axes) {  // the axes are unknown before the first connection
    if (axes.empty() || std::find(axes.begin(), axes.end(), axis) != axes.end()) continue;
    return refuse(fmt::format("found the axis \"{}\", expected one of {}", plain_text(axis.substr(0, 40)),
                              fmt::join(axes, ", ")));
  }
  gyro->subscribe(this, *subscription);
  const json result = {{"sample_every", subscription->sample_every},
                       {"window", subscription->windows},
                       {"event", subscription->events},
                       {"axes", subscription->axes.empty() ? axes : subscription->axes}};
  answer(id, instance, "\"result\":" + json_text(result));
}

void WsClient::answer(const std::string& id, const std::string& instance, const std::string& member,
                      SendQueue::Kind kind) {
  const std::string of = instance.empty() ? "" : R"(,"instance":)" + json_text(json(instance));
  if (!is_ended_) put(text_of(R"({"jsonrpc":"2.0","id":)" + id + "," + member + of + "}"), kind);
}

void WsClient::put(Text text, SendQueue::Kind kind) {
  queue_.put(std::move(text), kind);
  changed_.cancel();
}

// Serves one connection until it closes.
asio::awaitable<void> serve_one(Stream stream, std::shared_ptr<Router> router, std::shared_ptr<Connection> connection) {
  beast::flat_buffer buffer(kMaxHeaderBytes * 2);
  seconds timeout = kRequest;
  bool is_rejected = false;
  for (bool is_open = true; is_open;) {
    Parser parser;
    parser.header_limit(kMaxHeaderBytes);
    parser.body_limit(0);
    stream.expires_after(std::exchange(timeout, kNextRequest));
    const auto [read_error, read_bytes] = co_await http::async_read_header(stream, buffer, parser, kUse);
    std::optional<Answer> rejection = rejection_of(parser, read_error);
    if (read_error && !rejection) break;
    const Fields fields = parser.release();
    is_rejected = rejection.has_value();
    Answer answer;
    if (rejection) {
      answer = std::move(*rejection);
    } else {
      const Request request = request_of(fields);
      const bool is_upgrade = websocket::is_upgrade(fields);
      const Admission admission = router->admit(request);
      connection->is_known = connection->is_known || admission.is_authenticated;
      if (admission.status != 0) {
        answer = plain(admission.status, reason_of(admission.status), true);  // frees its slot
      } else if (is_upgrade && request.target == "/ws") {
        const auto client =
            std::make_shared<WsClient>(std::move(stream), router, connection, admission.is_authenticated);
        co_await client->run(fields);
        co_return;
      } else if (is_upgrade) {
        answer = plain(404, "the WebSocket is at /ws");
      } else {
        answer = co_await router->answer(request, admission.is_authenticated);
      }
    }
    is_open = co_await send(stream, *connection, fields, answer);
  }
  boost::system::error_code ignored;
  stream.socket().shutdown(asio::socket_base::shutdown_send, ignored);
  if (is_rejected) co_await discard_input(stream);
}

void ignore_exception(std::exception_ptr) {}  // of one connection; the others continue

}  // namespace

Connection::Connection(std::shared_ptr<Connections> all, int descriptor)
    : fd(descriptor), all_(std::move(all)), at_(all_->all_.insert(all_->all_.end(), this)) {}

Connection::~Connection() {
  remove_unsent(unsent_bytes_);
  all_->all_.erase(at_);
}

void Connection::add_unsent(std::size_t bytes) {
  if (is_ending_) return;
  unsent_bytes_ += bytes;
  all_->unsent_bytes_ += bytes;
  all_->peak_unsent_bytes_ = std::max(all_->peak_unsent_bytes_, all_->unsent_bytes_);
  const auto less = [](const Connection* a, const Connection* b) { return a->unsent_bytes_ < b->unsent_bytes_; };
  while (all_->unsent_bytes_ > Connections::kMaxUnsentBytes)
    (*std::max_element(all_->all_.begin(), all_->all_.end(), less))->close();
}

void Connection::remove_unsent(std::size_t bytes) {
  if (is_ending_) return;
  unsent_bytes_ -= bytes;
  all_->unsent_bytes_ -= bytes;
}

// The session then fails to read and to write, and frees its data.
void Connection::close() {
  all_->unsent_bytes_ -= std::exchange(unsent_bytes_, 0);
  is_ending_ = true;
  if (fd >= 0) ::shutdown(fd, SHUT_RDWR);
}

bool Connections::make_room() {
  const auto is_ending = [](const Connection* one) { return one->is_ending_; };
  const auto ending = static_cast<std::size_t>(std::count_if(all_.begin(), all_.end(), is_ending));
  if (all_.size() - ending < kMaxConnections) return ending < kMaxConnections;
  const auto is_unknown = [](const Connection* one) { return !one->is_known && !one->is_ending_; };
  const auto oldest = std::find_if(all_.begin(), all_.end(), is_unknown);
  if (oldest != all_.end()) (*oldest)->close();
  return oldest != all_.end();
}

void Connections::trim() {
  if (peak_unsent_bytes_ < unsent_bytes_ + kMinTrimBytes) return;
  peak_unsent_bytes_ = unsent_bytes_;
  ::malloc_trim(0);
}

void SendQueue::count(const Waiting& one, bool is_added) {
  const std::size_t bytes = one.text->size() + kTextBytes;
  if (is_added) connection_->add_unsent(bytes);
  if (!is_added) connection_->remove_unsent(bytes);
  bytes_[one.kind] += is_added ? bytes : -bytes;
}

void SendQueue::put(Text text, Kind kind) {
  const auto not_begun = waiting_.begin() + (waiting_.empty() ? 0 : 1);
  const auto older = std::find_if(not_begun, waiting_.end(), [](const Waiting& one) { return one.kind == kList; });
  if (kind == kList && older != waiting_.end()) {
    count(*older, false);
    waiting_.erase(older);
  }
  waiting_.push_back({std::move(text), kind});
  count(waiting_.back(), true);
}

void SendQueue::put_batch(const std::string& instance, Text text, std::uint64_t rows) {
  is_losing_ = is_losing_ || (bytes_[kBatch] > 0 && bytes_[kBatch] + text->size() > kMaxBatchBytes);
  if (!is_losing_) return put(std::move(text), kBatch);
  lost_[instance].rows += rows;
  lost_[instance].rows_total += rows;
}

void SendQueue::pop() {
  if (waiting_.empty()) return;
  count(waiting_.front(), false);
  waiting_.pop_front();
  if (bytes_[kBatch] > 0 || !std::exchange(is_losing_, false)) return;
  for (auto& [instance, lost] : lost_) {
    if (lost.rows == 0) continue;
    const json params = {{"instance", instance}, {"rows", lost.rows}, {"rows_total", lost.rows_total}};
    put(text_of(json_text(json({{"jsonrpc", "2.0"}, {"method", "lost"}, {"params", params}}))), kBatch);
    lost.rows = 0;
  }
}

void SendQueue::clear() {
  connection_->remove_unsent(bytes());
  waiting_.clear();
  bytes_ = {};
}

Result<std::unique_ptr<Server>> Server::open(asio::io_context& io, const Settings& settings) {
  std::unique_ptr<Server> server(new Server(io));
  if (!settings.unix_socket.empty()) {
    auto socket = listen_unix(settings.unix_socket, kSocketMode);
    if (!socket) return tl::unexpected<Error>(socket.error());
    server->own_.emplace(settings.unix_socket);
    server->acceptor_.assign(Protocol(AF_UNIX, 0), socket->release());
    return server;
  }
  boost::system::error_code error;
  const asio::ip::tcp::endpoint here(asio::ip::make_address(settings.address, error), settings.port);
  asio::ip::tcp::acceptor listening(io);
  if (!error) listening.open(here.protocol(), error);
  if (!error) listening.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) listening.bind(here, error);
  if (!error) listening.listen(kBacklog, error);
  if (error)
    return make_error(fmt::format("{}:{}", settings.address, settings.port), "cannot listen: " + error.message());
  server->port_ = listening.local_endpoint().port();
  server->acceptor_.assign(Protocol(here.protocol().family(), IPPROTO_TCP), listening.release());
  return server;
}

asio::awaitable<void> Server::serve(std::shared_ptr<Router> router) {
  asio::steady_timer pause(io_);
  for (;;) {
    Protocol::socket socket(io_);
    const auto [error] = co_await acceptor_.async_accept(socket, kUse);
    if (error == asio::error::operation_aborted) co_return;
    if (error) {  // no free descriptor: retry
      pause.expires_after(std::chrono::milliseconds(100));
      co_await pause.async_wait(kUse);
      continue;
    }
    if (!connections_->make_room()) continue;
    const int fd = socket.native_handle(), on = 1, buffer = kSendBufferBytes;
    ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
    if (!own_) ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    asio::co_spawn(io_, serve_one(Stream(std::move(socket)), router, std::make_shared<Connection>(connections_, fd)),
                   ignore_exception);
  }
}

}  // namespace prism::prismweb
