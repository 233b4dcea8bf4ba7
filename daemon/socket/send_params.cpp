// SPDX-License-Identifier: MIT
#include "daemon/socket/send_params.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "base/escape.hpp"
#include "base/hex_bytes.hpp"

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

Result<SendParams> send_params(const json& params, const pipeline::Setup& setup) {
  std::vector<std::uint8_t> bytes = bytes_param(params);
  const auto line = line_param(params, setup);
  if (!bytes.empty() && line) return SendParams{*line, std::move(bytes)};
  return make_error("send", fmt::format(R"(found {}, expected {{"text": 1 to {} bytes}} or {{"hex": "55 AA"}}, )"
                                        R"(and "line" only for a sensor line)",
                                        shortened(json_text(params)), kMostSentBytes));
}

}  // namespace prism::socket
