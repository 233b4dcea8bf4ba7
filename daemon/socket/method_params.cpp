// SPDX-License-Identifier: MIT
#include "daemon/socket/method_params.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "base/escape.hpp"
#include "base/hex_bytes.hpp"
#include "base/json_document.hpp"
#include "daemon/socket/row_requests.hpp"

namespace prism::socket {
namespace {

using nlohmann::json;

constexpr std::size_t kMostSentBytes = 1024;

// "text", or "hex": "55 AA"; empty if the parameters are invalid.
std::vector<std::uint8_t> bytes_param(const json& params) {
  std::vector<std::uint8_t> bytes;
  if (!params.is_object() || params.contains("text") == params.contains("hex")) return bytes;
  const json& given = params.contains("text") ? params["text"] : params["hex"];
  if (!given.is_string()) return bytes;
  const auto& text = given.get_ref<const std::string&>();
  if (params.contains("text")) bytes.assign(text.begin(), text.end());
  if (params.contains("hex")) bytes = hex_bytes(text);
  if (bytes.size() > kMostSentBytes) bytes.clear();
  return bytes;
}

// 0 without "line"; nullopt: no such sensor line.
std::optional<std::size_t> line_param(const json& params, const pipeline::Setup& setup) {
  if (!params.is_object() || !params.contains("line")) return 0;
  for (std::size_t i = 0; i < setup.sensor_lines.size(); ++i) {
    if (params["line"] == setup.sensor_lines[i].name) return i + 1;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::size_t> count_param(const json& params, const char* key, std::size_t otherwise, std::size_t max) {
  if (params.is_null() || (params.is_object() && !params.contains(key))) return otherwise;
  if (!params.is_object() || !params[key].is_number_integer()) return std::nullopt;
  const auto value = params[key].get<std::int64_t>();
  if (value < 1 || value > static_cast<std::int64_t>(max)) return std::nullopt;
  return static_cast<std::size_t>(value);
}

Result<SendParams> send_params(const json& params, const pipeline::Setup& setup) {
  std::vector<std::uint8_t> bytes = bytes_param(params);
  const auto line = line_param(params, setup);
  if (!bytes.empty() && line) return SendParams{*line, std::move(bytes)};
  return make_error("send", fmt::format(R"(found {}, expected {{"text": 1 to {} bytes}} or {{"hex": "55 AA"}}, )"
                                        R"(and "line" only for a sensor line)",
                                        shortened(json_text(params)), kMostSentBytes));
}

Result<RowParams> row_params(const json& params) {
  RowParams wanted;
  const auto wrong = [&] {
    return make_error(
        "rows",
        fmt::format(R"(found {}, expected {{"after": CURSOR, "limit": 1 to {}, "wait_s": 0 to {}, "header": true}})",
                    shown(params), pipeline::RowQuery::kMostRows, RowRequests::kLongestWait_s));
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
    if (!(wanted.wait_s >= 0 && wanted.wait_s <= RowRequests::kLongestWait_s)) return wrong();
  }
  return wanted;
}

}  // namespace prism::socket
