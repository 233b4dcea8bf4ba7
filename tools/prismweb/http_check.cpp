// SPDX-License-Identifier: MIT
#include "tools/prismweb/http_check.hpp"

#include <fmt/format.h>

#include <boost/beast/http/error.hpp>
#include <boost/beast/http/field.hpp>
#include <iterator>
#include <string>

namespace prism::prismweb {
namespace {

namespace http = boost::beast::http;

// A proxy may check another one of two equal fields than prismweb.
constexpr http::field kSingleFields[] = {http::field::host, http::field::origin, http::field::authorization,
                                         http::field::cookie, http::field::sec_fetch_site};
constexpr const char* kNoBody = "found a body, expected none";

Answer rejection(int status, const std::string& text) {
  Answer answer = plain(status, text);
  answer.is_last = true;
  return answer;
}

}  // namespace

void set_limits(RequestParser& parser) {
  parser.header_limit(kMaxHeaderBytes);
  parser.body_limit(0);
}

std::optional<Answer> rejection_of(const RequestParser& parser, const boost::system::error_code& error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return rejection(431, fmt::format("the header is too long, expected at most {} bytes", kMaxHeaderBytes));
  if (error == http::error::body_limit) return rejection(400, kNoBody);
  if (error == http::error::end_of_stream || error == http::error::partial_message) return std::nullopt;
  if (error && error.category() == make_error_code(http::error::bad_value).category())
    return rejection(400, "invalid HTTP request: " + error.message());
  if (error) return std::nullopt;
  const auto& fields = parser.get();
  for (const http::field field : kSingleFields) {
    const auto [first, end] = fields.equal_range(field);
    if (std::distance(first, end) > 1)
      return rejection(400, fmt::format("found {} fields \"{}\", expected one", std::distance(first, end),
                                        std::string(to_string(field))));
  }
  if (fields.count(http::field::transfer_encoding) > 0 || !parser.is_done()) return rejection(400, kNoBody);
  return std::nullopt;
}

}  // namespace prism::prismweb
