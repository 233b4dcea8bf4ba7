// SPDX-License-Identifier: MIT
// What of HTTP matters here: a request and its answer, of whatever stream.
#pragma once

#include <string>

namespace prism::prismweb {

struct Request {
  std::string method, target, host, origin, authorization, if_none_match;
};

struct Answer {
  int status = 200;
  std::string media_type = "text/plain; charset=utf-8";
  std::string body;
  std::string etag;
  std::string challenge;  ///< of a 401: how to come in
  bool is_last = false;   ///< the connection ends with it
};

inline Answer plain(int status, const std::string& text) {
  return {status, "text/plain; charset=utf-8", text + "\n", {}, {}};
}

/// Why a request is not answered; status 0: it is.
struct Refusal {
  int status = 0;
  std::string challenge;
};

}  // namespace prism::prismweb
