// SPDX-License-Identifier: MIT
#include "tools/prismweb/api.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <charconv>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/plain_text.hpp"
#include "tools/prismweb/archive.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/methods.hpp"
#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using nlohmann::json;

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
  double number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  const bool is_number = error == std::errc() && end == word.data() + word.size();
  const json value = is_number ? json::parse(word, nullptr, false) : json(json::value_t::discarded);
  return value.is_number() ? value : json(word);
}

std::string error_body(const std::string& message) { return json_text({{"error", message}}) + "\n"; }

int status_of(int code) {
  if (code == kInvalidParams) return 400;
  if (code == kUnknownMethod) return 404;
  return 503;
}

Answer answer_of(const std::string& member) {
  constexpr std::string_view kResult = R"("result":)";
  if (member.starts_with(kResult)) return {200, "application/json", member.substr(kResult.size()) + "\n", {}, {}};
  const json parsed = json::parse("{" + member + "}", nullptr, false);
  const json error = parsed.is_object() ? parsed.value("error", json::object()) : json::object();
  return {
      status_of(error.value("code", 0)), "application/json", error_body(error.value("message", "no answer")), {}, {}};
}

}  // namespace

bool is_api(std::string_view target) { return target.starts_with("/api/") || target.starts_with("/metrics"); }

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

asio::awaitable<Answer> api_answer(WebServer& server, std::string_view target) {
  const Result<ApiCall> call = parse_api(target);
  if (!call) co_return Answer{404, "application/json", error_body(call.error().text()), {}, {}};
  Result<json> params = parse_query(call->query);
  if (!params) co_return Answer{400, "application/json", error_body(params.error().text()), {}, {}};
  // Scripts of 0.3 send it; any other value stays, and is rejected as an unknown parameter.
  if (params->value("protocol", json()) == config::kProtocol) params->erase("protocol");
  auto member = std::make_shared<std::string>();
  auto done = std::make_shared<asio::steady_timer>(server.io(), asio::steady_timer::time_point::max());
  const InstanceProxy::Answer take_answer = [member, done](std::string_view text) {
    *member = text;
    done->cancel();
  };
  Archive* const archive = call->method == "rows" ? server.archive(call->instance) : nullptr;
  if (archive != nullptr) {
    archive->rows(*params, take_answer);
  } else {
    call_method(server, call->instance, call->method, *params, take_answer);
  }
  if (member->empty()) co_await done->async_wait(kUse);
  if (call->method == "instances" || server.instances().find(call->instance) != nullptr) co_return answer_of(*member);
  co_return Answer{404, "application/json", error_body("no instance \"" + call->instance + "\""), {}, {}};
}

}  // namespace prism::prismweb
