// SPDX-License-Identifier: MIT
// What of HTTP matters here: a request and its answer, of whatever stream.
#pragma once

#include <string>

namespace prism::prismweb {

struct Request {
  std::string method, target, host, origin, authorization, if_none_match, cookie, sec_fetch_site;
};

struct Answer {
  int status = 200;
  std::string media_type = "text/plain; charset=utf-8";
  std::string body;
  std::string etag;
  std::string challenge;    ///< of a 401: how to come in
  bool is_last = false;     ///< the connection ends with it
  std::string cookie = {};  ///< a Set-Cookie field; empty if none
};

inline Answer plain(int status, const std::string& text) {
  return {status, "text/plain; charset=utf-8", text + "\n", {}, {}};
}

/// Whether a request is answered.
struct Admission {
  int status = 0;  ///< of the refusal; 0: it is answered
  std::string challenge;
  /// The client sent a token, a cookie or a password that is right, or none is needed. A file of the page is sent
  /// without.
  bool is_authenticated = false;
};

}  // namespace prism::prismweb
