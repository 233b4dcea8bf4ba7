// SPDX-License-Identifier: MIT
#include "daemon/socket/old_form.hpp"

#include <string>
#include <utility>

namespace prism::socket {
namespace {

using nlohmann::ordered_json;

// `log` of an axis: its members move to the log of all, with several axes below the axis's name.
void move_log(ordered_json& status) {
  ordered_json& axes = status["axes"];
  for (auto& [name, own] : axes.items()) {
    if (!own.contains("log")) continue;
    for (const auto& [key, value] : own["log"].items())
      (axes.size() > 1 ? status["log"][key][name] : status["log"][key]) = value;
    own.erase("log");
  }
}

}  // namespace

ordered_json old_form(const config::SocketMethod& method, ordered_json result) {
  if (!method.of_axes) return result;
  if (method.name == "status") move_log(result);
  if (method.name == "config") {
    for (const char* key : {"log", "capture"}) {
      if (result[key].is_object()) result[key] = ordered_json(result[key]["directory"]);
    }
    result["socket"] = ordered_json(result["socket"]["path"]);
  }
  const std::string axis = result["axes"].size() == 1 ? result["axes"].begin().key() : "";
  if (axis.empty()) return result.size() == 1 ? ordered_json(std::move(result["axes"])) : result;
  ordered_json own = std::move(result["axes"].front());
  if (result.size() == 1) return own;
  result.erase("axes");
  ordered_json& place = method.name == "config" ? result["gyro"] : result;
  place["axis"] = axis;
  for (const char* key : {"sign", "unit_scale", "temperature"}) {
    if (!own.contains(key)) continue;
    place[key] = own[key];
    own.erase(key);
  }
  result.update(own);
  return result;
}

config::SocketError old_code(config::SocketError code) {
  return code == config::kUnknownCursor ? code : config::kFailed;
}

}  // namespace prism::socket
