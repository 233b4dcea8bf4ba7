// SPDX-License-Identifier: MIT
#include "tools/prismweb/methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "base/json_section.hpp"
#include "base/plain_text.hpp"
#include "tools/prismweb/archive.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/site.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

// Those that only tell. Never reload; never config, which has paths of the host.
constexpr std::array<std::string_view, 9> kPassed = {"version", "status",  "bias", "stability", "line",
                                                     "model",   "history", "rows", "events"};

// More than any device has; each row is held against a client's list.
constexpr std::size_t kMostAxes = 64;

std::string unknown_method(const std::string& method) {
  return fmt::format(
      "no method \"{}\"; expected one of instances, range, {}; subscribe and unsubscribe by the WebSocket",
      plain_text(method.substr(0, 40)), fmt::join(kPassed, ", "));
}

std::string unknown_instance(const std::string& instance) {
  return error_member(kWrongParams, "no instance \"" + plain_text(instance, 80) + "\"");
}

}  // namespace

void call_method(Site& site, const std::string& instance, const std::string& method, const json& params,
                 const Hub::Answer& answer) {
  if (method == "instances") return answer("\"result\":" + json_text(site.instances().listing()));
  if (method == "range") {
    Archive* const archive = site.archive(instance);
    return archive != nullptr ? archive->range(params, answer) : answer(unknown_instance(instance));
  }
  const bool passed = std::find(kPassed.begin(), kPassed.end(), method) != kPassed.end();
  if (!passed) return answer(error_member(kNoMethod, unknown_method(method)));
  Hub* const hub = site.instances().find(instance);
  if (hub == nullptr) return answer(unknown_instance(instance));
  if (!params.is_null() && !params.is_object())
    return answer(error_member(kWrongParams, "found params that are no object, expected one"));
  if (method == "rows" && params.is_object() && (params.contains("name") || params.contains("wait_s")))
    return answer(error_member(kWrongParams, "rows: found \"name\" or \"wait_s\", expected neither here"));
  hub->ask(method, params, answer);
}

std::optional<Wish> wish_of_params(const json& params, bool on, const Wish& before) {
  Wish wish = before;
  const json empty = json::object();
  const json& given = params.is_null() ? empty : params;
  if (!given.is_object()) return std::nullopt;
  std::uint32_t every = 1;
  if (given.contains("every")) {
    const json& value = given["every"];
    if (!value.is_number_integer() || value < 1 || value > 1'000'000) return std::nullopt;
    every = value;
  }
  wish.axes.clear();
  if (given.contains("axes")) {
    if (!given["axes"].is_array() || given["axes"].empty() || given["axes"].size() > kMostAxes) return std::nullopt;
    for (const json& axis : given["axes"]) {
      if (!axis.is_string()) return std::nullopt;
      wish.axes.push_back(axis);
    }
    std::sort(wish.axes.begin(), wish.axes.end());
  }
  if (!given.contains("streams")) {
    wish.sample_every = on ? every : 0;
    wish.windows = wish.events = on;
    return wish;
  }
  if (!given["streams"].is_array() || given["streams"].empty()) return std::nullopt;
  for (const json& stream : given["streams"]) {
    if (stream == "sample") {
      wish.sample_every = on ? every : 0;
    } else if (stream == "window") {
      wish.windows = on;
    } else if (stream == "event") {
      wish.events = on;
    } else {
      return std::nullopt;
    }
  }
  return wish;
}

json wish_json(const Wish& wish, const std::vector<std::string>& axes) {
  return {{"sample_every", wish.sample_every},
          {"window", wish.windows},
          {"event", wish.events},
          {"axes", wish.axes.empty() ? axes : wish.axes}};
}

}  // namespace prism::prismweb
