// SPDX-License-Identifier: MIT
#include "tools/prismweb/server.hpp"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

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

#include "base/time_scale.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using client::kUse;
using std::chrono::seconds;
using Stream = beast::basic_stream<asio::generic::stream_protocol>;
using Fields = http::request<http::empty_body>;
using Parser = http::request_parser<http::empty_body>;

constexpr int kBacklog = 64;
constexpr int kSendBufferBytes = 256 << 10;  // limits unread data of a client in the kernel
constexpr mode_t kSocketMode = 0660;
constexpr std::uint32_t kMaxHeaderBytes = 8 << 10;
constexpr std::size_t kMaxDiscardBytes = 1 << 20, kMaxMessageBytes = 64 << 10;
constexpr seconds kRequest{10}, kNextRequest{60}, kDiscard{2}, kTrimInterval{5};
constexpr seconds kFirstMessage{10}, kSilence{30}, kWriteTimeout{30}, kWatchInterval{5};
constexpr seconds kPausedSilence{600};  // a client that is not read cannot answer pings
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

class WsSession : public std::enable_shared_from_this<WsSession> {
 public:
  WsSession(Stream stream, std::shared_ptr<WsClient> client, std::shared_ptr<Connection> connection)
      : ws_(std::move(stream)),
        tick_(ws_.get_executor(), kFirstMessage),
        client_(std::move(client)),
        connection_(std::move(connection)) {}

  asio::awaitable<void> run(Fields request) {
    const auto self = shared_from_this();
    beast::get_lowest_layer(ws_).expires_never();
    set_silence(kSilence);
    ws_.read_message_max(kMaxMessageBytes);
    ws_.auto_fragment(false);
    ws_.text(true);
    const auto [error] = co_await ws_.async_accept(request, kUse);
    if (error) co_return;
    asio::co_spawn(ws_.get_executor(), write(self), asio::detached);
    asio::co_spawn(ws_.get_executor(), watch(self), asio::detached);
    co_await read();
    is_ended_ = true;
    tick_.cancel();
    client_->end();
  }

 private:
  asio::awaitable<void> read() {
    beast::flat_buffer buffer(kMaxMessageBytes);
    for (;;) {
      const auto [error, size] = co_await ws_.async_read(buffer, kUse);
      if (error) co_return;
      const auto data = buffer.cdata();
      const auto reason = client_->message({static_cast<const char*>(data.data()), data.size()}, ws_.got_text());
      buffer.consume(size);
      if (reason) co_return co_await close(*reason);
      if (!client_->is_paused()) continue;
      set_silence(kPausedSilence);  // requests of a client that does not read its responses stay in the kernel
      while (client_->is_paused() && !is_dropped_) co_await client_->progress();
      set_silence(kSilence);
    }
  }

  void set_silence(seconds silence) { ws_.set_option(websocket::stream_base::timeout{kFirstMessage, silence, true}); }

  asio::awaitable<void> close(CloseReason why) {
    const websocket::close_reason reason(static_cast<websocket::close_code>(why.code), why.reason);
    co_await ws_.async_close(reason, kUse);
  }

  asio::awaitable<void> write(std::shared_ptr<WsSession> self) {
    for (;;) {
      const Text text = co_await client_->next();
      if (text == nullptr || is_dropped_) co_return;
      writing_since_ = std::chrono::steady_clock::now();
      const auto buffer = asio::buffer(*text);
      const auto [error, size] = co_await ws_.async_write(buffer, kUse);
      writing_since_.reset();
      client_->sent();
      if (error) co_return self->drop();
    }
  }

  // Disconnects a client that is not admitted in time or does not read.
  asio::awaitable<void> watch(std::shared_ptr<WsSession> self) {
    co_await tick_.async_wait(kUse);
    const CloseReason late{1008, "no token received in 10 s"};
    if (!is_ended_ && !client_->is_admitted()) co_return co_await close(late);
    while (!is_ended_) {
      tick_.expires_after(kWatchInterval);
      co_await tick_.async_wait(kUse);
      const auto now = std::chrono::steady_clock::now();
      if (writing_since_ && now - *writing_since_ >= kWriteTimeout) co_return self->drop();
    }
  }

  // read() then fails and ends the session.
  void drop() {
    if (std::exchange(is_dropped_, true)) return;
    connection_->fd = -1;
    beast::get_lowest_layer(ws_).close();
    client_->end();
  }

  websocket::stream<Stream> ws_;
  asio::steady_timer tick_;  ///< of watch()
  const std::shared_ptr<WsClient> client_;
  const std::shared_ptr<Connection> connection_;
  std::optional<std::chrono::steady_clock::time_point> writing_since_;
  bool is_ended_ = false, is_dropped_ = false;
};

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
        const auto client = std::make_shared<WsClient>(router, connection, admission.is_authenticated);
        const auto session = std::make_shared<WsSession>(std::move(stream), client, connection);
        co_await session->run(fields);
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
  asio::co_spawn(io_, trim_memory(), asio::detached);
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

asio::awaitable<void> Server::trim_memory() {
  asio::steady_timer tick(io_);
  for (;;) {
    tick.expires_after(scaled(kTrimInterval));
    co_await tick.async_wait(kUse);
    connections_->trim();
  }
}

}  // namespace prism::prismweb
