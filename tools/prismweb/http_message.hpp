// SPDX-License-Identifier: MIT
// HTTP requests and responses, independent of the stream.
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
  bool is_last = false;     ///< closes the connection
  std::string cookie = {};  ///< Set-Cookie field; empty: none
};

inline Answer plain(int status, const std::string& text) {
  return {status, "text/plain; charset=utf-8", text + "\n", {}, {}};
}

/// Result of the access checks.
struct Admission {
  int status = 0;  ///< HTTP status of the error; 0: admitted
  /// The client sent a valid token or cookie, or none is required. The page's files are also sent without.
  bool is_authenticated = false;
};

}  // namespace prism::prismweb
