// SPDX-License-Identifier: MIT
#include "tools/prismweb/http_session.hpp"

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/connection.hpp"
#include "tools/prismweb/http_check.hpp"
#include "tools/prismweb/unsent_memory.hpp"
#include "tools/prismweb/web_server.hpp"
#include "tools/prismweb/ws_session.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Fields = http::request<http::empty_body>;

constexpr std::chrono::seconds kRequest{10}, kNextRequest{60}, kDiscard{2};
constexpr std::size_t kMaxDiscardBytes = 1 << 20;

Request request_of(const Fields& fields) {
  const auto text = [&](std::string_view name) { return std::string(fields[name]); };
  Request request;
  request.method = fields.method_string();
  request.target = fields.target();
  request.host = text("Host");
  request.origin = text("Origin");
  request.authorization = text("Authorization");
  request.if_none_match = text("If-None-Match");
  request.cookie = text("Cookie");
  request.sec_fetch_site = text("Sec-Fetch-Site");
  return request;
}

const char* reason_of(int status) {
  if (status == 401) return "expected the token of the token file (Authorization: Bearer TOKEN)";
  if (status == 403) return "the Origin is another site";
  if (status == 421) return "the Host is not a name of this server; add it to \"hosts\" in the configuration";
  return "rejected";
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
asio::awaitable<bool> send(Stream& stream, WebServer& server, Connection& connection, const Fields& request,
                           Answer& answer) {
  const http::response<http::string_body> response = response_of(request, std::move(answer));
  UnsentMemory::Part unsent(server.unsent_memory(), [&stream, &connection] {
    connection.fd = -1;
    stream.close();
  });
  unsent.add(response.body().size());
  stream.expires_after(kNextRequest);
  const auto [error, size] = co_await http::async_write(stream, response, kUse);
  co_return !error && response.keep_alive();
}

}  // namespace

asio::awaitable<void> serve(Stream stream, WebServer& server, std::shared_ptr<Connection> connection) {
  beast::flat_buffer buffer(kMaxHeaderBytes * 2);
  auto timeout = kRequest;
  bool is_rejected = false;
  for (;;) {
    RequestParser parser;
    set_limits(parser);
    stream.expires_after(std::exchange(timeout, kNextRequest));
    const auto [read_error, read_bytes] = co_await http::async_read_header(stream, buffer, parser, kUse);
    std::optional<Answer> rejection = rejection_of(parser, read_error);
    if (read_error && !rejection) break;
    const Fields fields = parser.release();
    if (rejection) {
      co_await send(stream, server, *connection, fields, *rejection);
      is_rejected = true;
      break;
    }
    const Request request = request_of(fields);
    const bool upgrade = beast::websocket::is_upgrade(fields);
    const Admission admission = server.admit(request);
    connection->is_known = connection->is_known || admission.is_authenticated;
    Answer answer;
    if (admission.status != 0) {
      answer = plain(admission.status, reason_of(admission.status));
      answer.is_last = true;  // frees its slot until the client's next request
    } else if (upgrade && request.target == "/ws") {
      co_await run_websocket(std::move(stream), fields, server, admission.is_authenticated, connection);
      co_return;
    } else if (upgrade) {
      answer = plain(404, "the WebSocket is at /ws");
    } else {
      answer = co_await server.answer(request, admission.is_authenticated);
    }
    const bool is_open = co_await send(stream, server, *connection, fields, answer);
    if (!is_open) break;
  }
  boost::system::error_code ignored;
  stream.socket().shutdown(asio::socket_base::shutdown_send, ignored);
  if (is_rejected) co_await discard_input(stream);
}

}  // namespace prism::prismweb
