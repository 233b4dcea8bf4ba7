// SPDX-License-Identifier: MIT
#include "daemon/socket/rpc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "base/escape.hpp"
#include "base/hex_bytes.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "config/socket_protocol.hpp"
#include "daemon/awaiting.hpp"
#include "daemon/socket/answers.hpp"

namespace prism::socket {
namespace {

namespace asio = boost::asio;
using daemon::kUse;
using nlohmann::json;

constexpr std::size_t kMostSentBytes = 1024;
constexpr std::size_t kMaxBatch = 100;    // requests in one line
constexpr std::size_t kMaxValues = 2000;  // JSON values in one line, containers included
constexpr double kLongestWait_s = 30;

// The integer parameter, 1 to max, or `otherwise` if it is missing; nullopt if it is invalid.
std::optional<std::size_t> count_param(const json& params, const char* key, std::size_t otherwise, std::size_t max) {
  if (params.is_null() || (params.is_object() && !params.contains(key))) return otherwise;
  if (!params.is_object() || !params[key].is_number_integer()) return std::nullopt;
  const auto value = params[key].get<std::int64_t>();
  if (value < 1 || value > static_cast<std::int64_t>(max)) return std::nullopt;
  return static_cast<std::size_t>(value);
}

struct SendParams {
  std::size_t line = 0;             // 0: the gyro's; sensor lines follow
  std::vector<std::uint8_t> bytes;  // 1 to kMostSentBytes
};

// {"text": "READ?"} or {"hex": "55 AA"}, and "line" for a sensor line.
Result<SendParams> send_params(const json& params, const pipeline::Setup& setup) {
  SendParams wanted;
  const auto text_of = [&](const char* key) { return params.value(key, json("")); };
  bool good = params.is_object() && params.contains("text") != params.contains("hex");
  if (good && text_of("text").is_string() && text_of("hex").is_string()) {
    const std::string text = text_of("text");
    wanted.bytes = params.contains("text") ? std::vector<std::uint8_t>(text.begin(), text.end())
                                           : hex_bytes(text_of("hex").get<std::string>());
  }
  good = !wanted.bytes.empty() && wanted.bytes.size() <= kMostSentBytes;
  if (good && params.contains("line")) {
    const auto& lines = setup.sensor_lines;
    while (wanted.line < lines.size() && params["line"] != lines[wanted.line].name) ++wanted.line;
    good = wanted.line++ < lines.size();
  }
  if (good) return wanted;
  return make_error("send", fmt::format(R"(found {}, expected {{"text": 1 to {} bytes}} or {{"hex": "55 AA"}}, )"
                                        R"(and "line" only for a sensor line)",
                                        shortened(json_text(params)), kMostSentBytes));
}

struct RowParams {
  pipeline::RowQuery query;
  double wait_s = 0;  // longest wait for a first row
};

Result<RowParams> row_params(const json& params) {
  RowParams wanted;
  const auto wrong = [&] {
    return make_error(
        "rows",
        fmt::format(R"(found {}, expected {{"after": CURSOR, "limit": 1 to {}, "wait_s": 0 to {}, "header": true}})",
                    shown(params), pipeline::RowQuery::kMostRows, kLongestWait_s));
  };
  if (params.is_null()) return wanted;
  if (!params.is_object()) return wrong();
  if (params.contains("after")) {
    if (!params["after"].is_string()) return wrong();
    wanted.query.after = params["after"];
  }
  const auto limit = count_param(params, "limit", wanted.query.limit, pipeline::RowQuery::kMostRows);
  if (!limit) return wrong();
  wanted.query.limit = *limit;
  if (params.contains("name"))  // without it, 0.3 would read the whole log at each call
    return make_error("rows",
                      "\"name\" was removed in prism 0.4; pass the cursor of the last response as \"after\" "
                      "(prismctl rows --cursor stores it in a file)");
  if (params.contains("header") && !params["header"].is_boolean()) return wrong();
  wanted.query.header = params.value("header", false);
  if (params.contains("wait_s")) {
    if (!params["wait_s"].is_number()) return wrong();
    wanted.wait_s = params["wait_s"];
    if (!(wanted.wait_s >= 0 && wanted.wait_s <= kLongestWait_s)) return wrong();
  }
  return wanted;
}

using nlohmann::ordered_json;

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

// Returns a bit for each axis in the list "axes", all if it is missing; nullopt if it is invalid.
std::optional<std::uint32_t> axes_param(const json& params, const pipeline::Device& device) {
  if (!params.is_object() || !params.contains("axes")) return Subscription::kAllAxes;
  const json& list = params["axes"];
  if (!list.is_array() || list.empty()) return std::nullopt;
  std::uint32_t chosen = 0;
  for (const json& name : list) {
    std::size_t axis = 0;
    while (axis < device.axes.size() && name != device.axes[axis].name) ++axis;
    if (axis == device.axes.size()) return std::nullopt;
    chosen |= 1U << axis;
  }
  return chosen;
}

// Parsing 65 kB of small values would delay the line by 4 ms. Each value but the first follows one of these characters.
bool too_many_values(std::string_view line) {
  const auto begins = [](char c) { return c == ',' || c == '[' || c == '{'; };
  return static_cast<std::size_t>(std::count_if(line.begin(), line.end(), begins)) > kMaxValues;
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
  json params;
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
  void fail_count(const char* key, std::size_t most) const {
    fail(kInvalidParams, fmt::format("found {}, expected {{\"{}\": 1 to {}}}", shown(params), key, most));
  }
  /// A response up to its result, which is existing JSON text.
  std::string begin() const {
    std::string line = json_text(ordered_json{{"jsonrpc", "2.0"}, {"id", id}});
    line.pop_back();
    return line += ",\"result\":";
  }
  /// An object with the axis `name`, up to its value.
  std::string begin(const std::string& name) const { return begin() + R"({"axes":{)" + json_text(json(name)) + ":"; }
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
  json parsed = json::parse(line, nullptr, false);
  if (parsed.is_discarded())
    return refused(kParseError, "the line is not valid JSON; expected one JSON-RPC 2.0 request a line");
  std::deque<json> requests;
  if (!parsed.is_array()) {
    requests.push_back(std::move(parsed));
    return requests;
  }
  if (parsed.empty()) return refused(kInvalidRequest, "found an empty batch, expected at least one request");
  if (parsed.size() > kMaxBatch) {
    return refused(kInvalidRequest,
                   fmt::format("found a batch of {} requests, expected at most {}", parsed.size(), kMaxBatch));
  }
  for (json& request : parsed) requests.push_back(std::move(request));
  return requests;
}

void Rpc::request(const std::shared_ptr<Client>& client, std::string_view line) {
  for (json& request : take(client, line)) one(client, std::move(request));
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
  Call call{client, found, id, has_id, request.contains("params") ? std::move(request["params"]) : json()};
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
      {"send", &Rpc::send}};
  if (const auto own = kOwn.find(call.method->name); own != kOwn.end()) return (this->*own->second)(call);
  call.reply(answer(sources_, call.method->name, call.axes));
}

bool Rpc::take_axes(Call& call) {
  const std::vector<std::string> names = names_of(sources_.device);
  call.axes.resize(names.size());
  std::iota(call.axes.begin(), call.axes.end(), 0);
  const bool chooses = call.method->params.starts_with("axis") && call.params.is_object();
  if (!chooses || !call.params.contains("axis")) return true;
  const auto found = std::find(names.begin(), names.end(), call.params["axis"]);
  if (found == names.end()) {
    call.fail(kInvalidParams,
              fmt::format("found axis {}, expected one of {}", shown(call.params["axis"]), fmt::join(names, ", ")));
    return false;
  }
  call.axes = {static_cast<std::size_t>(found - names.begin())};
  return true;
}

// The JSON of rows and events was written when they occurred; here it is only joined, that of rows without a copy.
void Rpc::history(const Call& call) {
  const auto count = count_param(call.params, "seconds", 100, History::kRows);
  if (!count) return call.fail_count("seconds", History::kRows);
  std::vector<Piece> line;
  for (const std::size_t axis : call.axes) {
    const std::string& name = sources_.device.axes[axis].name;
    line.push_back({text(line.empty() ? call.begin(name) + "[" : "]," + json_text(json(name)) + ":[")});
    sources_.publisher.history(axis).append_to(line, *count);
  }
  line.push_back({text("]}}}\n")});
  call.client->answer(std::move(line));
}

void Rpc::events(const Call& call) {
  const auto count = count_param(call.params, "count", EventLog::kKept, EventLog::kKept);
  if (!count) return call.fail_count("count", EventLog::kKept);
  std::string line = call.begin() + '[';
  const auto& recent = sources_.events.recent();
  const std::size_t first = recent.size() - std::min(*count, recent.size());
  for (std::size_t i = first; i < recent.size(); ++i) (line += i > first ? "," : "") += recent[i].json;
  call.client->answer(line += "]}\n");
}

namespace {

config::SocketError code_of(pipeline::RowRefusal::Why why) {
  using Why = pipeline::RowRefusal::Why;
  if (why == Why::kGone) return kRowsGone;
  return why == Why::kForeignCursor ? kUnknownCursor : why == Why::kBadCursor ? kInvalidParams : kFailed;
}

// A result without rows.
ordered_json data_of(const pipeline::RowRefusal& refusal, const std::string& axis) {
  const ordered_json page = {
      {"log", refusal.after.log},    {"segments", json::array()},     {"first", refusal.after.total - refusal.gone + 1},
      {"last", refusal.after.total}, {"after", refusal.after.text()}, {"more", true},
      {"missing", refusal.gone}};
  return {{"axes", {{axis, page}}}};
}

}  // namespace

void Rpc::rows(const Call& call) {
  if (call.axes.size() != 1)
    return call.fail(kInvalidParams,
                     fmt::format("expected \"axis\", one of {}", fmt::join(names_of(sources_.device), ", ")));
  auto params = row_params(call.params);
  if (!params) return call.fail(kInvalidParams, params.error().text());
  if (sources_.device.axes[call.axes.front()].log == nullptr)
    return call.fail(kNoLog, "rows: no log is written, expected \"write_log\" in the configuration");
  if (std::exchange(call.client->reads_rows, true))
    return call.fail(kBusy, "rows: found a pending request of this client, expected one at a time");
  asio::co_spawn(call.client->socket().get_executor(), answer_rows(call, std::move(params->query), params->wait_s),
                 asio::detached);
}

void Rpc::synced() {
  ++syncs_;
  for (const auto& waiting : std::exchange(waiting_, {})) {
    if (const auto timer = waiting.lock()) timer->cancel();
  }
}

/// A page that the disk thread reads.
struct Reading {
  explicit Reading(const asio::any_io_executor& executor) : done(executor, asio::steady_timer::time_point::max()) {}
  asio::steady_timer done;  ///< cancelled when `page` is there
  std::optional<pipeline::RowResult> page;
};

namespace {

// The disk thread posts the page, and with it its share of `reading`, which must end on the thread of its timer.
void read_page(pipeline::RowWriter& log, const pipeline::RowQuery& query, std::shared_ptr<Reading> reading) {
  log.read(query, [reading = std::move(reading)](pipeline::RowResult page) mutable {
    const auto executor = reading->done.get_executor();
    asio::post(executor, [mine = std::exchange(reading, nullptr), page = std::move(page)]() mutable {
      mine->page = std::move(page);
      mine->done.cancel();
    });
  });
}

}  // namespace

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
    const auto reading = std::make_shared<Reading>(executor);
    read_page(log, query, reading);
    while (!reading->page) co_await reading->done.async_wait(kUse);
    page = std::move(*reading->page);
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
  call.fail(code_of(page.error().why), page.error().text, page.error().gone > 0 ? &data : nullptr);
}

void Rpc::change_subscription(const Call& call) {
  const bool on = call.method->name == "subscribe";
  Subscription wanted = call.client->subscription;
  const json streams = call.params.is_object() ? call.params.value("streams", json()) : json();
  const auto every = count_param(call.params, "every", 1, 1'000'000);
  bool known = streams.is_array() && !streams.empty() && every;
  if (streams.is_null() && every) {
    known = true;
    wanted = on ? Subscription{static_cast<std::uint32_t>(*every), true, true} : Subscription{};
  }
  const auto axes = axes_param(call.params, sources_.device);
  known = known && axes;
  for (const json& stream : streams.is_array() ? streams : json::array()) {
    if (stream == "sample") {
      wanted.sample_every = on && every ? static_cast<std::uint32_t>(*every) : 0;
    } else if (stream == "window") {
      wanted.windows = on;
    } else if (stream == "event") {
      wanted.events = on;
    } else {
      known = false;
    }
  }
  if (!known) {
    return call.fail(kInvalidParams,
                     "found " + shown(call.params) +
                         R"(, expected {"streams": ["sample", "window", "event"], "every": 1 to 1000000, "axes": )" +
                         json_text(json(names_of(sources_.device))) + "}");
  }
  wanted.axes = *axes;
  call.reply({{"sample_every", wanted.sample_every},
              {"window", wanted.windows},
              {"event", wanted.events},
              {"axes", names_of(sources_.device, wanted.axes)}});
  call.client->subscription = wanted;
  publisher_.update();
}

void Rpc::reload(const Call& call) {
  if (!call.client->privileged()) return call.fail(kNotPermitted, "reload needs root or the user that prismd runs as");
  reload_([call](Result<std::string> outcome) {
    outcome ? call.reply({{"reloaded", *outcome}}) : call.fail(kFailed, outcome.error().text());
  });
}

void Rpc::send(const Call& call) {
  if (!call.client->privileged()) return call.fail(kNotPermitted, "send needs root or the user that prismd runs as");
  const auto params = send_params(call.params, sources_.device.setup);
  if (!params) return call.fail(kInvalidParams, params.error().what);
  if (!send_) return call.fail(kFailed, "send: a replay has no device");
  if (const auto sent = send_(params->line, params->bytes); !sent) return call.fail(kFailed, sent.error().text());
  call.reply({{"sent", params->bytes.size()}});
}

}  // namespace prism::socket
