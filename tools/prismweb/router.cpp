// SPDX-License-Identifier: MIT
#include "tools/prismweb/router.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cctype>
#include <charconv>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "config/socket_protocol.hpp"
#include "config/version.hpp"
#include "tools/metrics/families.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using client::error_member;
using client::kUse;
using nlohmann::json;

constexpr std::string_view kLibrary = "/dygraphs/";
constexpr off_t kMaxFileBytes = 16 << 20;
constexpr std::chrono::seconds kDrainTimeout{3};
// Scrapers time out after about 10 s, and would then miss the other instances, too.
constexpr std::chrono::seconds kScrapeTimeout{4};

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kTypes = {{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".txt", "text/plain; charset=utf-8"},
}};

bool is_api(std::string_view target) { return target.starts_with("/api/") || target.starts_with("/metrics"); }

// Empty if such files are not served.
std::string_view media_type(std::string_view path) {
  const auto found =
      std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& one) { return path.ends_with(one.first); });
  return found == kTypes.end() ? std::string_view() : found->second;
}

bool is_file_name(std::string_view name) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-' || c == '.'; };
  return !name.empty() && name.front() != '.' && std::all_of(name.begin(), name.end(), fits);
}

std::optional<std::string> unescape(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    if (text[i] != '%') {
      plain += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const char* const end = text.data() + i + 3;
    if (std::from_chars(text.data() + i + 1, end, value, 16).ptr != end) return std::nullopt;
    plain += static_cast<char>(value);
    i += 2;
  }
  return plain;
}

json value_of(const std::string& word) {
  const json value = json::parse(word, nullptr, false);
  return value.is_number() || value.is_boolean() ? value : json(word);
}

// Returns an error text with the allowed names if `params` has another member; otherwise an empty string.
std::string unknown_param(std::string_view method, const json& params, const std::vector<std::string_view>& allowed) {
  if (!params.is_object()) return "";
  for (const auto& [name, value] : params.items()) {
    if (std::find(allowed.begin(), allowed.end(), name) != allowed.end()) continue;
    return fmt::format("{}: found the parameter \"{}\", expected {}", method, plain_text(name, 40),
                       allowed.empty() ? "none" : fmt::format("only {}", fmt::join(allowed, ", ")));
  }
  return "";
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

std::string unknown_instance(const std::string& instance) { return "no instance \"" + plain_text(instance, 80) + "\""; }

Answer json_answer(int status, std::string body) { return {status, "application/json", std::move(body) + "\n"}; }

Answer error_answer(int status, const std::string& message) {
  return json_answer(status, json_text(json({{"error", message}})));
}

Answer answer_of(const std::string& member) {
  constexpr std::string_view kResult = R"("result":)";
  if (member.starts_with(kResult)) return json_answer(200, member.substr(kResult.size()));
  const json parsed = json::parse("{" + member + "}", nullptr, false);
  const json& error = prism::member(parsed, "error");
  const int code = static_cast<int>(number_member(error, "code"));
  const int status = code == config::kInvalidParams ? 400 : code == config::kUnknownMethod ? 404 : 503;
  return error_answer(status, text_member(error, "message", "no answer"));
}

/// A method that clients may call.
struct Method {
  std::string_view name;
  std::vector<std::string_view> params;
  bool is_long;
  /// `gyro`: nullptr only for `list`.
  asio::awaitable<std::string> (*call)(Router& router, GyroProxy* gyro, std::string method, json params);
};

asio::awaitable<std::string> list(Router& router, GyroProxy*, std::string, json) {
  co_return "\"result\":" + json_text(router.gyros().listing());
}

asio::awaitable<std::string> range(Router&, GyroProxy* gyro, std::string, json params) {
  const auto history = gyro->history(params);
  if (!history) co_return gyro->wrong_axis();
  co_return co_await history->range(std::move(params));
}

asio::awaitable<std::string> forward(Router&, GyroProxy* gyro, std::string method, json params) {
  co_return co_await gyro->call(std::move(method), std::move(params));
}

// prismweb's own, and prismd's that only read. Excludes config, which contains paths of the host, and parameters of
// `rows` that would store a cursor, or block the connection that all clients share.
const std::vector<Method>& methods() {
  static const std::vector<Method> kMethods = [] {
    std::vector<Method> all = {{"instances", {}, false, list},
                               {"range", {"axis", "from_s", "to_s", "seconds", "points"}, true, range},
                               {"rows", {"axis", "after", "limit", "header"}, true, forward}};
    for (const config::SocketMethod& method : config::kSocketMethods) {
      if (method.acts || method.is_local || method.name == "rows") continue;
      all.push_back({method.name, words_of(method.params), method.is_long, forward});
    }
    return all;
  }();
  return kMethods;
}

const Method* find_method(std::string_view name) {
  const auto found = std::ranges::find(methods(), name, &Method::name);
  return found == methods().end() ? nullptr : &*found;
}

std::string unknown_method(const std::string& method) {
  std::set<std::string_view> names;
  for (const Method& one : methods()) names.insert(one.name);
  return fmt::format("no method \"{}\"; expected one of {}; subscribe and unsubscribe require the WebSocket",
                     plain_text(method.substr(0, 40)), fmt::join(names, ", "));
}

struct Scrape {
  explicit Scrape(asio::io_context& io) : done(io, kScrapeTimeout) {}
  std::map<std::string, metrics::GyroAnswers> gyros;
  std::size_t missing = 0;
  asio::steady_timer done;
};

asio::awaitable<void> scrape(std::shared_ptr<Scrape> all, GyroProxy& gyro) {
  using Answers = metrics::GyroAnswers;
  static constexpr std::array<std::pair<const char*, json Answers::*>, 3> kRequests = {
      {{"status", &Answers::status}, {"line", &Answers::line}, {"stability", &Answers::stability}}};
  Answers& answers = all->gyros[gyro.name()];
  for (const auto& [method, member] : kRequests) {
    const std::string text = co_await gyro.call(method, nullptr);
    if (client::Response response = client::response_of_member(method, text)) answers.*member = std::move(*response);
  }
  if (--all->missing == 0) all->done.cancel();
}

}  // namespace

Answer plain(int status, const std::string& text, bool is_last) {
  Answer answer{status};
  answer.body = text + "\n";
  answer.is_last = is_last;
  return answer;
}

Result<ApiCall> parse_api(std::string_view target) {
  const auto wrong = [&] { return make_error("/api", "expected /api/instances or /api/INSTANCE/METHOD?NAME=VALUE&…"); };
  ApiCall call;
  const std::size_t query = target.find('?');
  if (query != std::string_view::npos) call.query = target.substr(query + 1);
  std::string_view path = target.substr(0, query);
  if (!path.starts_with("/api/")) return wrong();
  path.remove_prefix(5);
  if (path == "instances") {
    call.method = path;
    return call;
  }
  const std::size_t slash = path.find('/');
  if (slash == std::string_view::npos) return wrong();
  const auto instance = unescape(path.substr(0, slash));
  if (!instance || instance->empty()) return wrong();
  call.instance = *instance;
  call.method = path.substr(slash + 1);
  return call;
}

Result<json> parse_query(std::string_view query) {
  json params = json::object();
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(pair.size() + 1, query.size()));
    const std::size_t equals = pair.find('=');
    const auto name = unescape(pair.substr(0, equals));
    const auto value = unescape(equals == std::string_view::npos ? std::string_view() : pair.substr(equals + 1));
    if (!name || name->empty() || !value) return make_error("query", "expected NAME=VALUE&…, with escapes %XX");
    if (params.contains(*name))
      return make_error("query", "found the parameter \"" + plain_text(*name, 40) + "\" twice, expected it once");
    params[*name] = *name == "axis" || *name == "after" ? json(*value) : value_of(*value);
  }
  return params;
}

std::string file_of_target(std::string_view target, int folders) {
  target = target.substr(0, target.find('?'));
  if (target == "/") return "index.html";
  if (!target.starts_with('/')) return "";
  const std::string_view path = target.substr(1);
  std::string_view rest = path;
  for (; folders >= 0; --folders) {
    const std::size_t slash = rest.find('/');
    if (!is_file_name(rest.substr(0, slash))) return "";
    if (slash == std::string_view::npos) return media_type(path).empty() ? "" : std::string(path);
    rest.remove_prefix(slash + 1);
  }
  return "";
}

Answer file_answer(const std::string& folder, std::string_view target, int folders) {
  const std::string name = file_of_target(target, folders);
  const bool is_served = !name.empty() && !folder.empty();
  const Descriptor file(is_served ? ::open((folder + "/" + name).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK) : -1);
  struct stat found {};
  if (file.get() < 0 || ::fstat(file.get(), &found) != 0 || !S_ISREG(found.st_mode) || found.st_size > kMaxFileBytes)
    return plain(404, "no such file");
  Answer answer{200, std::string(media_type(name))};
  answer.body.resize(static_cast<std::size_t>(found.st_size));
  if (::pread(file.get(), answer.body.data(), answer.body.size(), 0) != found.st_size)
    return plain(404, "no such file");
  answer.etag = fmt::format("\"{:x}-{:x}-{:x}\"", found.st_ino, found.st_size,
                            found.st_mtim.tv_sec * 1'000'000'000 + found.st_mtim.tv_nsec);
  return answer;
}

bool is_long_method(std::string_view method) {
  const Method* const known = find_method(method);
  return known != nullptr && known->is_long;
}

Router::Router(asio::io_context& io, const Settings& settings, Access access)
    : io_(io),
      settings_(settings),
      access_(std::move(access)),
      disk_(0, [](const std::string& why) { fmt::print(stderr, "prismweb: disk: {}\n", why); }),
      gyros_(io, disk_, settings.instances, settings.state) {}

bool Router::finish() { return disk_.drain(kDrainTimeout); }

Admission Router::admit(const Request& request) const { return access_.admit(request, is_api(request.target)); }

asio::awaitable<Answer> Router::answer(Request request, bool is_authenticated) {
  const std::string_view target = request.target, path = target.substr(0, target.find('?'));
  if (path == "/session") co_return begin_session(request, is_authenticated);
  if (is_api(target) && request.method != "GET") co_return plain(405, "expected GET");
  if (path == "/metrics") co_return co_await metrics();
  if (is_api(target)) co_return co_await api(target);
  if (request.method != "GET" && request.method != "HEAD") co_return plain(405, "expected GET or HEAD");
  const bool is_library = target.starts_with(kLibrary);
  Answer found = is_library ? file_answer(settings_.dygraphs, target.substr(kLibrary.size() - 1), 3)
                            : file_answer(settings_.page, target);
  if (found.status == 200 && request.if_none_match == found.etag) {
    found.status = 304;
    found.media_type.clear();
    found.body.clear();
  }
  co_return found;
}

// The printed address works once. Opening it again in a browser with a session has no effect.
Answer Router::begin_session(const Request& request, bool is_authenticated) {
  if (!access_.has_tokens()) return plain(404, "this server does not use tokens");
  if (request.method != "POST") return plain(405, "expected POST");
  const auto cookie = access_.begin_session(request);
  if (!cookie && !is_authenticated)
    return plain(401, "this address was already used; \"systemctl reload prismweb\" prints a new one", true);
  Answer answer{204};
  answer.cookie = cookie.value_or("");
  return answer;
}

asio::awaitable<std::string> Router::call(std::string instance, std::string method, json params) {
  const Method* const known = find_method(method);
  if (known == nullptr) co_return error_member(config::kUnknownMethod, unknown_method(method));
  const std::string unknown = unknown_param(method, params, known->params);
  if (!unknown.empty()) co_return error_member(config::kInvalidParams, unknown);
  GyroProxy* const gyro = gyros_.find(instance);
  if (gyro == nullptr && known->call != &list)
    co_return error_member(config::kInvalidParams, unknown_instance(instance));
  co_return co_await known->call(*this, gyro, std::move(method), std::move(params));
}

asio::awaitable<Answer> Router::api(std::string_view target) {
  const Result<ApiCall> call_of = parse_api(target);
  if (!call_of) co_return error_answer(404, call_of.error().text());
  Result<json> params = parse_query(call_of->query);
  if (!params) co_return error_answer(400, params.error().text());
  const auto& [instance, method, query] = *call_of;
  if (method != "instances" && gyros_.find(instance) == nullptr)
    co_return error_answer(404, unknown_instance(instance));
  // Scripts of 0.3 send it; any other value stays, and is rejected as an unknown parameter.
  if (params->value("protocol", json()) == config::kProtocol) params->erase("protocol");
  const std::string member = co_await call(instance, method, std::move(*params));
  co_return answer_of(member);
}

// Requests status, line and stability from all instances. One that is not running has only prism_up 0.
asio::awaitable<Answer> Router::metrics() {
  const auto all = std::make_shared<Scrape>(io_);
  all->missing = gyros_.all().size();
  for (const auto& gyro : gyros_.all()) asio::co_spawn(io_, scrape(all, *gyro), asio::detached);
  if (all->missing > 0) co_await all->done.async_wait(kUse);
  metrics::Exposition exposition;
  for (const auto& [name, answers] : all->gyros) metrics::add_gyro(exposition, name, answers);
  metrics::add_relays(exposition);
  metrics::add_time(exposition);
  Answer answer{200, "text/plain; version=0.0.4; charset=utf-8"};
  answer.body = exposition.text();
  co_return answer;
}

std::string Router::greeting() const {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  const json greeting = {
      {"ready", true}, {"host", host.data()}, {"version", kVersion}, {"instances", gyros_.listing()}};
  return json_text(greeting);
}

}  // namespace prism::prismweb
