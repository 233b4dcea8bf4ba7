// SPDX-License-Identifier: MIT
#include "tools/prismweb/http_session.hpp"

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/foxglove_protocol.hpp"
#include "tools/prismweb/site.hpp"
#include "tools/prismweb/ws_session.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Fields = http::request<http::empty_body>;

constexpr std::uint32_t kMostHeaderBytes = 8 << 10;
constexpr std::chrono::seconds kRequest{10}, kNextRequest{60};

Request request_of(const Fields& fields) {
  const auto text = [&](http::field name) { return std::string(fields[name]); };
  return {std::string(fields.method_string()), std::string(fields.target()),     text(http::field::host),
          text(http::field::origin),           text(http::field::authorization), text(http::field::if_none_match)};
}

const char* reason_of(int status) {
  if (status == 401) return "expected a token (Authorization: Bearer TOKEN) or a name and its password";
  if (status == 403) return "the Origin is of another site (for Foxglove \"origins\" of the configuration names it)";
  if (status == 421) return "the Host is not one of this server's; \"hosts\" of the configuration names more";
  if (status == 503) return "too many passwords are being compared; try again in a second";
  return "refused";
}

http::response<http::string_body> response_of(const Fields& request, Answer answer) {
  http::response<http::string_body> response(static_cast<http::status>(answer.status), request.version());
  response.set("Content-Security-Policy", "default-src 'self'; frame-ancestors 'none'");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set(http::field::cache_control, answer.etag.empty() ? "no-store" : "no-cache");
  if (!answer.media_type.empty()) response.set(http::field::content_type, answer.media_type);
  if (!answer.etag.empty()) response.set(http::field::etag, answer.etag);
  if (answer.status == 401) response.set(http::field::www_authenticate, answer.challenge);
  if (answer.status == 503) response.set(http::field::retry_after, "1");
  response.keep_alive(request.keep_alive() && !answer.is_last);
  const std::size_t size = answer.body.size();
  if (request.method() != http::verb::head) response.body() = std::move(answer.body);
  if (answer.status != 304) response.content_length(size);
  return response;
}

template <class Stream>
asio::awaitable<void> serve_requests(Stream stream, Site& site, std::shared_ptr<Connection> connection) {
  beast::flat_buffer buffer(kMostHeaderBytes * 2);
  auto patience = kRequest;
  for (;;) {
    http::request_parser<http::empty_body> parser;
    parser.header_limit(kMostHeaderBytes);
    parser.body_limit(0);
    beast::get_lowest_layer(stream).expires_after(std::exchange(patience, kNextRequest));
    const auto [read_error, read_bytes] = co_await http::async_read(stream, buffer, parser, kUse);
    if (read_error) break;
    const Fields fields = parser.release();
    const Request request = request_of(fields);
    const bool upgrade = beast::websocket::is_upgrade(fields);
    const Refusal refusal = co_await site.refusal(request);
    connection->is_known = connection->is_known || (refusal.status == 0 && site.proves(request));
    Answer answer;
    if (refusal.status != 0) {
      answer = plain(refusal.status, reason_of(refusal.status));
      answer.challenge = refusal.challenge;
      answer.is_last = true;  // who was refused has no place here until his next try
    } else if (upgrade && request.target == "/ws") {
      const std::string our_own;
      co_await run_websocket(std::move(stream), fields, site, our_own, connection);
      co_return;
    } else if (upgrade && is_foxglove(request.target)) {
      const std::string protocol(foxglove_protocol_of(fields[http::field::sec_websocket_protocol]));
      std::optional<Answer> why = site.foxglove_refusal(protocol);
      if (!why) {
        co_await run_websocket(std::move(stream), fields, site, protocol, connection);
        co_return;
      }
      answer = std::move(*why);
    } else if (upgrade) {
      answer = plain(404, "the WebSocket is /ws");
    } else {
      answer = co_await site.answer(request);
    }
    const http::response<http::string_body> response = response_of(fields, std::move(answer));
    beast::get_lowest_layer(stream).expires_after(kNextRequest);
    const auto [write_error, written] = co_await http::async_write(stream, response, kUse);
    if (write_error || !response.keep_alive()) break;
  }
  boost::system::error_code ignored;
  beast::get_lowest_layer(stream).socket().shutdown(asio::socket_base::shutdown_send, ignored);
}

}  // namespace

asio::awaitable<void> serve(PlainStream stream, Site& site, std::shared_ptr<Connection> connection) {
  co_await serve_requests(std::move(stream), site, connection);
}

asio::awaitable<void> serve(TlsStream stream, Site& site, std::shared_ptr<Connection> connection) {
  beast::get_lowest_layer(stream).expires_after(kRequest);
  const auto [error] = co_await stream.async_handshake(asio::ssl::stream_base::server, kUse);
  if (error) co_return;
  co_await serve_requests(std::move(stream), site, connection);
}

}  // namespace prism::prismweb
