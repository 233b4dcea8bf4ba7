// SPDX-License-Identifier: MIT
#include "daemon/socket/rpc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/experimental/concurrent_channel.hpp>
#include <boost/asio/this_coro.hpp>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <utility>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/json_document.hpp"
#include "base/json_member.hpp"
#include "base/json_section.hpp"
#include "base/outside_text.hpp"
#include "daemon/awaiting.hpp"

namespace prism::socket {
namespace {

namespace asio = boost::asio;
using daemon::kUse;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::size_t kMostSentBytes = 1024;
constexpr std::size_t kMaxBatch = 100;    // requests in one line
constexpr std::size_t kMaxValues = 2000;  // JSON values in one line, containers included

std::string method_names() {
  std::string names;
  for (const config::SocketMethod& method : config::kSocketMethods)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", method.name);
  return names;
}

Text text(std::string line) { return std::make_shared<const std::string>(std::move(line)); }

// Responses are valid UTF-8 even if the request was not.
std::string line_of(const ordered_json& message) { return json_text(message) + "\n"; }

// Names of the axes whose bit is set in `chosen`.
std::vector<std::string> names_of(const pipeline::Device& device, std::uint32_t chosen = Subscription::kAllAxes) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < device.axes.size(); ++i) {
    if (chosen >> i & 1) names.push_back(device.axes[i].name);
  }
  return names;
}

/// The position of a name in the names of all axes, or their count.
std::size_t position_of(const Json& name, const std::vector<std::string>& names) {
  std::size_t i = 0;
  while (i < names.size() && name != names[i]) ++i;
  return i;
}

// One bit for each of these names in an array; 0 if the key is absent or null.
std::uint32_t chosen(const Section& params, const char* key, const std::vector<std::string>& names) {
  const Json list = params.any(key);
  bool fits = list.is_null() || (list.is_array() && !list.empty());
  std::uint32_t bits = 0;
  for (const Json& name : list) {
    const std::size_t at = position_of(name, names);
    fits = fits && at < names.size();
    bits |= 1U << at;
  }
  if (!fits)
    params.fail(key,
                fmt::format("found {}, expected an array of one or more of {}", shown(list), fmt::join(names, ", ")));
  return bits;
}

// Parsing 65 kB of small values would delay the line by 4 ms. Each value but the first follows one of these characters.
bool too_many_values(std::string_view line) {
  const auto begins = [](char c) { return c == ',' || c == '[' || c == '{'; };
  return static_cast<std::size_t>(std::count_if(line.begin(), line.end(), begins)) > kMaxValues;
}

// A result without rows.
ordered_json data_of(const pipeline::RowRefusal& refusal, const std::string& axis) {
  const ordered_json page = {
      {"log", refusal.after.log},    {"segments", json::array()},     {"first", refusal.after.total - refusal.gone + 1},
      {"last", refusal.after.total}, {"after", refusal.after.text()}, {"more", true},
      {"missing", refusal.gone}};
  return {{"axes", {{axis, page}}}};
}

using Pages = asio::experimental::concurrent_channel<void(boost::system::error_code, pipeline::RowResult)>;

// The disk thread sends the page.
void read_page(pipeline::RowWriter& log, const pipeline::RowQuery& query, const std::shared_ptr<Pages>& pages) {
  log.read(query, [pages](pipeline::RowResult page) { pages->try_send(boost::system::error_code(), std::move(page)); });
}

}  // namespace

std::string rpc_error(const json& id, int code, const std::string& message, const ordered_json* data) {
  ordered_json error = {{"code", code}, {"message", message}};
  if (data != nullptr) error["data"] = *data;
  return line_of({{"jsonrpc", "2.0"}, {"id", id}, {"error", std::move(error)}});
}

struct Rpc::Call {
  std::shared_ptr<Client> client;
  const config::SocketMethod* method;
  json id;
  bool wants_answer;
  JsonDocument params;
  std::vector<std::size_t> axes = {};  ///< for a method with the parameter "axis"

  void reply(const ordered_json& result) const {
    if (!wants_answer) return;
    const std::string text = json_text(result);
    std::string line = begin();
    line.reserve(line.size() + text.size() + 2);  // it may wait long for its client
    client->answer(line.append(text) += "}\n");
  }
  void fail(int code, const std::string& message, const ordered_json* data = nullptr) const {
    if (wants_answer) client->answer(rpc_error(id, code, message, data));
  }
  /// If a parameter that was read is invalid, sends an error and returns false. Others are ignored.
  bool accepts(const Section& read) const {
    if (!params.value.is_object()) read.fail("", fmt::format("found {}, expected an object", shown(params.value)));
    if (!read.good()) fail(kInvalidParams, read.finish().error().text());
    return read.good();
  }
  /// A response up to its result, which is existing JSON text.
  std::string begin() const {
    std::string line = json_text(ordered_json{{"jsonrpc", "2.0"}, {"id", id}});
    line.pop_back();
    return line += ",\"result\":";
  }
  /// The start of an object with axes, up to the value of the first.
  std::string begin(const std::string& axis) const { return begin() + R"({"axes":{)" + json_text(json(axis)) + ":"; }
};

std::deque<json> Rpc::take(const std::shared_ptr<Client>& client, std::string_view line) {
  const auto refused = [&client](int code, const std::string& why) {
    client->answer(rpc_error(nullptr, code, why));
    return std::deque<json>();
  };
  if (too_many_values(line)) {
    return refused(kInvalidRequest, fmt::format("found more than {} values in a line, expected at most {} requests",
                                                kMaxValues, kMaxBatch));
  }
  std::optional<json> parsed = parse_json_line(line);
  if (!parsed) {
    return refused(
        kParseError,
        fmt::format("the line is not valid JSON of at most {} levels; expected one JSON-RPC 2.0 request a line",
                    kMostJsonLevels));
  }
  std::deque<json> requests;
  if (!parsed->is_array()) {
    requests.push_back(std::move(*parsed));
    return requests;
  }
  if (parsed->empty()) return refused(kInvalidRequest, "found an empty batch, expected at least one request");
  if (parsed->size() > kMaxBatch) {
    return refused(kInvalidRequest,
                   fmt::format("found a batch of {} requests, expected at most {}", parsed->size(), kMaxBatch));
  }
  for (json& request : *parsed) requests.push_back(std::move(request));
  return requests;
}

void Rpc::one(const std::shared_ptr<Client>& client, json request) {
  const auto invalid = [&](const json& id, const std::string& message) {
    client->answer(rpc_error(id, kInvalidRequest, message));
  };
  if (!request.is_object()) return invalid(nullptr, "found " + shown(request) + ", expected a request object");
  const bool has_id = request.contains("id");
  const json id = has_id ? request["id"] : json();
  if (has_id && !id.is_string() && !id.is_number() && !id.is_null()) {
    return invalid(nullptr, "found id " + shown(id) + ", expected a text, a number or null");
  }
  if (request.value("jsonrpc", json()) != "2.0") return invalid(id, "expected \"jsonrpc\": \"2.0\"");
  const json method = request.value("method", json());
  if (!method.is_string()) return invalid(id, "found method " + shown(method) + ", expected a text");
  const json protocol = request.value("protocol", json(1));  // clients before 0.3 do not send it
  if (protocol != 1 && protocol != config::kProtocol)
    return invalid(id, fmt::format("found protocol {}, expected {}", shown(protocol), config::kProtocol));
  client->asked();
  const auto name = method.get<std::string>();
  const config::SocketMethod* const found = config::find_method(name);
  if (!has_id && (found == nullptr || !found->acts)) return;  // a notification needs no response
  const bool has_params = request.contains("params") && !request["params"].is_null();
  Call call{client, found, id, has_id, {has_params ? Json(request["params"]) : Json::object(), "params", {}}};
  if (found == nullptr)
    return call.fail(kUnknownMethod, fmt::format("no method \"{:.40}\"; expected one of {}", name, method_names()));
  if (found->of_axes && protocol != config::kProtocol)
    return call.fail(kInvalidRequest, std::string(config::kOlderClient));
  if (take_axes(call)) dispatch(std::move(call));
}

void Rpc::dispatch(Call call) {
  static const std::map<std::string_view, void (Rpc::*)(const Call&)> kOwn = {
      {"history", &Rpc::history},
      {"rows", &Rpc::rows},
      {"events", &Rpc::events},
      {"subscribe", &Rpc::change_subscription},
      {"unsubscribe", &Rpc::change_subscription},
      {"reload", &Rpc::reload},
      {"offset", &Rpc::offset},
      {"send", &Rpc::send}};
  if (const auto own = kOwn.find(call.method->name); own != kOwn.end()) return (this->*own->second)(call);
  call.reply(answer(sources_, call.method->name, call.axes));
}

bool Rpc::take_axes(Call& call) {
  const std::vector<std::string> names = names_of(sources_.device);
  call.axes.resize(names.size());
  std::iota(call.axes.begin(), call.axes.end(), 0);
  if (!call.method->params.starts_with("axis") || !call.params.value.contains("axis")) return true;
  const Json& axis = call.params.value["axis"];
  const std::size_t found = position_of(axis, names);
  if (found == names.size()) {
    call.fail(kInvalidParams, fmt::format("found axis {}, expected one of {}", shown(axis), fmt::join(names, ", ")));
    return false;
  }
  call.axes = {found};
  return true;
}

// The JSON of rows and events was written when they occurred; here it is only joined, that of rows without a copy.
void Rpc::history(const Call& call) {
  const Section params(call.params);
  const auto count = static_cast<std::size_t>(params.integer("seconds", {1, History::kRows}, 100));
  if (!call.accepts(params)) return;
  std::vector<Piece> line;
  for (const std::size_t axis : call.axes) {
    const std::string& name = sources_.device.axes[axis].name;
    line.push_back({text(line.empty() ? call.begin(name) + "[" : "]," + json_text(json(name)) + ":[")});
    sources_.publisher.history(axis).append_to(line, count);
  }
  line.push_back({text("]}}}\n")});
  call.client->answer(std::move(line));
}

void Rpc::events(const Call& call) {
  const Section params(call.params);
  const auto count = static_cast<std::size_t>(params.integer("count", {1, EventLog::kKept}, EventLog::kKept));
  if (!call.accepts(params)) return;
  std::string line = call.begin() + '[';
  const auto& recent = sources_.events.recent();
  const std::size_t first = recent.size() - std::min(count, recent.size());
  for (std::size_t i = first; i < recent.size(); ++i) (line += i > first ? "," : "") += recent[i].json;
  call.client->answer(line += "]}\n");
}

void Rpc::rows(const Call& call) {
  if (call.axes.size() != 1)
    return call.fail(kInvalidParams,
                     fmt::format("expected \"axis\", one of {}", fmt::join(names_of(sources_.device), ", ")));
  const Section params(call.params);
  if (params.has("name"))  // without it, 0.3 would read the whole log at each call
    params.fail("name",
                "was removed in prism 0.4; pass the cursor of the last response as \"after\" (prismctl rows "
                "--cursor stores it in a file)");
  pipeline::RowQuery query;
  query.after = params.raw_text("after", "");
  const auto usual = static_cast<std::int64_t>(query.limit);
  query.limit = static_cast<std::size_t>(params.integer("limit", {1, pipeline::RowQuery::kMostRows}, usual));
  query.header = params.boolean("header", false);
  const double wait_s = params.number("wait_s", {0, 30}, 0.0);  // longest wait for a first row
  if (!call.accepts(params)) return;
  if (sources_.device.axes[call.axes.front()].log == nullptr)
    return call.fail(kNoLog, "rows: no log is written, expected \"write_log\" in the configuration");
  if (std::exchange(call.client->reads_rows, true))
    return call.fail(kBusy, "rows: found a pending request of this client, expected one at a time");
  asio::co_spawn(call.client->socket().get_executor(), answer_rows(call, std::move(query), wait_s), asio::detached);
}

void Rpc::synced() {
  ++syncs_;
  for (const auto& waiting : std::exchange(waiting_, {})) {
    if (const auto timer = waiting.lock()) timer->cancel();
  }
}

// A request at the end of the log waits for a sync, after which there may be new rows, up to wait_s.
asio::awaitable<void> Rpc::answer_rows(Call call, pipeline::RowQuery query, double wait_s) {
  const std::string axis = sources_.device.axes[call.axes.front()].name;  // a reload may rename it
  pipeline::RowWriter& log = *sources_.device.axes[call.axes.front()].log;
  const auto executor = co_await asio::this_coro::executor;
  const auto wait = std::chrono::duration_cast<Client::Clock::duration>(std::chrono::duration<double>(wait_s));
  const auto until = Client::Clock::now() + wait;
  pipeline::RowResult page;
  for (;;) {
    const std::uint64_t seen = syncs_;
    const auto pages = std::make_shared<Pages>(executor, 1);
    read_page(log, query, pages);
    auto [closed, read] = co_await pages->async_receive(kUse);
    page = std::move(read);
    const bool found = !page || page->rows > 0 || page->missing > 0;
    if (found || Client::Clock::now() >= until || !call.client->open()) break;
    if (syncs_ != seen) continue;
    const auto next = std::make_shared<asio::steady_timer>(executor, until);
    waiting_.push_back(next);
    co_await next->async_wait(kUse);
  }
  call.client->reads_rows = false;
  if (page) {
    std::vector<Piece> line = {{text(call.begin(axis))}};
    line.push_back({text(std::move(page->json))});
    line.push_back({text("}}}}\n")});
    call.client->answer(std::move(line));
    co_return;
  }
  const ordered_json data = data_of(page.error(), axis);
  call.fail(page.error().code, page.error().text, page.error().gone > 0 ? &data : nullptr);
}

void Rpc::change_subscription(const Call& call) {
  const bool on = call.method->name == "subscribe";
  const Section params(call.params);
  const auto every = static_cast<std::uint32_t>(params.integer("every", {1, 1'000'000}, 1));
  const std::uint32_t streams = chosen(params, "streams", {"sample", "window", "event"});
  const std::uint32_t axes = chosen(params, "axes", names_of(sources_.device));
  if (!call.accepts(params)) return;
  Subscription wanted = call.client->subscription;
  if (streams & 1) wanted.sample_every = on ? every : 0;
  if (streams & 2) wanted.windows = on;
  if (streams & 4) wanted.events = on;
  if (streams == 0) wanted = on ? Subscription{every, true, true} : Subscription{};
  wanted.axes = axes == 0 ? Subscription::kAllAxes : axes;
  call.reply({{"sample_every", wanted.sample_every},
              {"window", wanted.windows},
              {"event", wanted.events},
              {"axes", names_of(sources_.device, wanted.axes)}});
  call.client->subscription = wanted;
  sources_.publisher.update();
}

void Rpc::reload(const Call& call) {
  if (!call.client->privileged()) return call.fail(kNotPermitted, "reload needs root or the user that prismd runs as");
  actions_.reload([call](Result<std::string> outcome) {
    outcome ? call.reply({{"reloaded", *outcome}}) : call.fail(kFailed, outcome.error().text());
  });
}

void Rpc::offset(const Call& call) {
  constexpr double kLongest_s = 366 * 86'400;
  if (!call.client->privileged()) return call.fail(kNotPermitted, "offset needs root or the user that prismd runs as");
  if (call.axes.size() != 1)
    return call.fail(kInvalidParams,
                     fmt::format("expected \"axis\", one of {}", fmt::join(names_of(sources_.device), ", ")));
  const Section params(call.params);
  const bool clear = params.boolean("clear", false);
  pipeline::Offset offset;
  offset.deg_per_h = params.number("deg_per_h", kAnyNumber, 0.0);
  offset.reason = params.text("reason", "", TextRule::kText);
  const std::int64_t for_s = params.integer("expires_s", {1, kLongest_s}, 0);
  if (clear == params.has("deg_per_h") || clear != offset.reason.empty())
    params.fail("", fmt::format("found {}, expected \"deg_per_h\" and \"reason\", or \"clear\": true",
                                shown(call.params.value)));
  if (!call.accepts(params)) return;
  if (!actions_.set_offset) return call.fail(kFailed, "offset: a replay has none");
  offset.set_s = host_time_ns() / 1'000'000'000;
  offset.expires_s = for_s > 0 ? offset.set_s + for_s : 0;
  const std::size_t axis = call.axes.front();
  actions_.set_offset(axis, clear ? std::nullopt : std::optional(std::move(offset)),
                      [call](Result<std::string> outcome) {
                        outcome ? call.reply({{"offset", *outcome}}) : call.fail(kFailed, outcome.error().text());
                      });
}

void Rpc::send(const Call& call) {
  if (!call.client->privileged()) return call.fail(kNotPermitted, "send needs root or the user that prismd runs as");
  std::vector<std::string> names;
  for (const auto& line : sources_.device.setup.sensor_lines) names.push_back(line.name);
  const Section params(call.params);
  std::string bytes = params.raw_text("text", "");
  const std::vector<std::uint8_t> hex = params.bytes("hex", false);
  bytes.append(hex.begin(), hex.end());
  const Json name = params.any("line");
  const std::size_t line = name.is_null() ? 0 : 1 + position_of(name, names);  // 0: the gyro's; sensor lines follow
  if (line > names.size())
    params.fail("line", fmt::format("found {}, expected a sensor line ({})", shown(name),
                                    names.empty() ? "none is configured" : fmt::to_string(fmt::join(names, ", "))));
  if (bytes.empty() || bytes.size() > kMostSentBytes || (params.has("text") && params.has("hex")))
    params.fail("", fmt::format(R"(found {}, expected {{"text": 1 to {} bytes}} or {{"hex": "55 AA"}})",
                                shown(call.params.value), kMostSentBytes));
  if (!call.accepts(params)) return;
  if (!actions_.send) return call.fail(kFailed, "send: a replay has no device");
  const auto sent = actions_.send(line, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (!sent) return call.fail(kFailed, sent.error().text());
  call.reply({{"sent", bytes.size()}});
}

}  // namespace prism::socket
