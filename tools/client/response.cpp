// SPDX-License-Identifier: MIT
#include "tools/client/response.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"

namespace prism::client {

using nlohmann::json;

Response response_of(std::string_view method, json message) {
  const auto failed = [](config::SocketError code, std::string why) {
    return Response(tl::unexpect, RequestError{code, {"prismd", std::move(why)}});
  };
  if (const json& error = member(message, "error"); !error.is_null()) {
    const json& code = member(error, "code");
    const int number = code.is_number_integer() ? code.get<int>() : config::kFailed;
    const json& page = member(error, "data");  // the deleted rows as `missing`
    if (number == config::kRowsGone && member(page, "axes").is_object()) return Response(page);
    return failed(static_cast<config::SocketError>(number), text_member(error, "message", "refused"));
  }
  json result = message.is_object() ? std::move(message["result"]) : json();
  const config::SocketMethod* const known = config::find_method(method);
  if (known != nullptr && known->of_axes && !member(result, "axes").is_object())
    return failed(config::kFailed, "found a response of protocol 1, expected 2: this prismd is older; restart it");
  return Response(std::move(result));
}

Response response_of_member(std::string_view method, std::string_view member) {
  return response_of(method, parse_json_line("{" + std::string(member) + "}").value_or(json()));
}

std::string error_member(int code, const std::string& message) {
  return R"("error":)" + json_text(json{{"code", code}, {"message", message}});
}

const json& of_axis(const json& result, const std::string& axis) {
  const json& axes = member(result, "axes");
  if (!axis.empty()) return member(axes, axis);
  static const json kNone;
  return axes.is_object() && axes.size() == 1 ? *axes.begin() : kNone;
}

json with_axis(json result, const std::string& axis) {
  const json own = of_axis(result, axis);
  result.erase("axes");
  result["axis"] = axis;
  if (!own.is_object()) return result;
  for (const auto& [key, value] : own.items()) {
    json& target = result[key];
    if (key == "log" && target.is_object() && value.is_object()) {
      target.update(value);
    } else {
      target = value;
    }
  }
  return result;
}

}  // namespace prism::client
