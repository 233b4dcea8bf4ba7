// SPDX-License-Identifier: MIT
// Routes requests to files, methods and metrics: one table of methods for /api and /ws.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/disk_thread.hpp"
#include "tools/prismweb/access.hpp"
#include "tools/prismweb/gyro_proxy.hpp"
#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

/// An HTTP response.
struct Answer {
  int status = 200;
  std::string media_type = "text/plain; charset=utf-8";
  std::string body = {};
  std::string etag = {};
  std::string cookie = {};  ///< Set-Cookie field; empty: none
  bool is_last = false;     ///< closes the connection
};
/// One line of text.
Answer plain(int status, const std::string& text, bool is_last = false);

struct ApiCall {
  std::string instance, method;
  std::string_view query;  ///< part of the target
};
/// Parses "/api/gyro1/history?seconds=60", except the query. Errors: another form, an invalid escape ("%zz").
Result<ApiCall> parse_api(std::string_view target);
/// Parses "seconds=60&axis=z" to params. Errors: a repeated name, an empty name, an invalid escape.
Result<nlohmann::json> parse_query(std::string_view query);

/// Relative path of a target: "/lib/charts.js" → "lib/charts.js", "/" → "index.html". Returns an empty string if the
/// target is not served:
/// - a name begins with a dot, or has characters other than letters, digits, '_', '-' and '.'
/// - more than `folders` directories
/// - an extension without a media type
std::string file_of_target(std::string_view target, int folders = 1);

/// Reads `target` below `folder`. Status 404 also for files above 16 MiB.
Answer file_answer(const std::string& folder, std::string_view target, int folders = 1);

/// True if the response may be longer than a few KiB.
bool is_long_method(std::string_view method);

class Router {
 public:
  Router(boost::asio::io_context& io, const Settings& settings, Access access);

  Access& access() { return access_; }
  GyroProxies& gyros() { return gyros_; }
  boost::asio::io_context& io() { return io_; }
  /// Run time so far of the disk's current task.
  std::chrono::steady_clock::duration disk_busy_for() const { return disk_.busy_for(); }
  /// Writes the stores to disk. Returns false after 3 s: the disk is still blocked.
  bool finish();

  /// The page's files need no token; for the WebSocket, the first message may contain it.
  Admission admit(const Request& request) const;
  /// Returns the response to an admitted request.
  boost::asio::awaitable<Answer> answer(Request request, bool is_authenticated);
  /// Calls a method other than subscribe and unsubscribe. Returns a member of the response, `"result":…` or
  /// `"error":{…}`.
  boost::asio::awaitable<std::string> call(std::string instance, std::string method, nlohmann::json params);
  /// The first message to an admitted WebSocket client.
  std::string greeting() const;

 private:
  boost::asio::awaitable<Answer> api(std::string_view target);
  boost::asio::awaitable<Answer> metrics();
  Answer begin_session(const Request& request, bool is_authenticated);

  boost::asio::io_context& io_;
  const Settings settings_;
  Access access_;
  DiskThread disk_;  ///< must outlive the stores
  GyroProxies gyros_;
};

}  // namespace prism::prismweb
