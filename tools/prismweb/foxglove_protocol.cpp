// SPDX-License-Identifier: MIT
#include "tools/prismweb/foxglove_protocol.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "compensation/log_columns.hpp"
#include "tools/prismweb/batch.hpp"
#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {
namespace {

using compensation::ColumnType;
using compensation::InSample;
using nlohmann::json;

constexpr std::string_view kTarget = "/foxglove", kTokenPart = "?token=";
constexpr double kMaxSeconds = 9e9;  // fits an int64 of nanoseconds

struct Field {
  const char *name, *type, *what;
};

constexpr std::array kEvent = {
    Field{"severity", "string", "debug, info, warning or error"},
    Field{"kind", "string", "event type, e.g. line_lost"},
    Field{"text", "string", "description of the event"},
    Field{"repeats", "integer", "suppressed repetitions of the event"},
};

json property(std::string_view type, std::string_view description) {
  return {{"type", type}, {"description", description}};
}

void put_columns(json& properties, bool is_sample) {
  for (const std::size_t i : compensation::kJsonColumns) {
    const compensation::ColumnInfo& column = compensation::kColumnInfo[i];
    if (is_sample && column.in_sample == InSample::kNo) continue;
    std::string description;
    if (!is_sample || column.in_sample != InSample::kMeasured) description = column.meaning;
    if (!column.unit.empty()) (description += description.empty() ? "" : ", ") += column.unit;
    const bool is_integer = column.type == ColumnType::kInteger || column.type == ColumnType::kUnsigned;
    properties[std::string(column.name)] = property(column.type == ColumnType::kText ? "string"
                                                    : is_integer                     ? "integer"
                                                                                     : "number",
                                                    description);
  }
}

json schema_of(const std::string& stream) {
  json properties;
  if (stream == "event") {
    properties["time_s"] = property("number", "time of the data, s");
    for (const Field& field : kEvent) properties[field.name] = property(field.type, field.what);
  } else {
    properties["axis"] = property("string", "name in the frame description");
    put_columns(properties, stream == "sample");
  }
  return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
          {"type", "object"},
          {"required", {"time_s"}},
          {"properties", properties}};
}

const char* schema_name(const std::string& stream) {
  return stream == "event" ? "prism.Event" : stream == "sample" ? "prism.Sample" : "prism.Window";
}

template <class Number>
void put_little_endian(std::string& data, Number number) {
  for (std::size_t i = 0; i < sizeof number; ++i) data += static_cast<char>((number >> (8 * i)) & 0xff);
}

}  // namespace

std::string_view foxglove_protocol_of(std::string_view offered) {
  while (!offered.empty()) {
    const std::size_t end = std::min(offered.find(','), offered.size());
    std::string_view one = offered.substr(0, end);
    offered.remove_prefix(std::min(end + 1, offered.size()));
    while (one.starts_with(' ') || one.starts_with('\t')) one.remove_prefix(1);
    while (one.ends_with(' ') || one.ends_with('\t')) one.remove_suffix(1);
    if (one == "foxglove.websocket.v1" || one == "foxglove.sdk.v1") return one;
  }
  return {};
}

bool is_foxglove(std::string_view target) { return target.substr(0, target.find('?')) == kTarget; }

std::string_view foxglove_token_of(std::string_view target) {
  const std::string_view query = target.substr(std::min(kTarget.size(), target.size()));
  return query.starts_with(kTokenPart) ? query.substr(kTokenPart.size()) : std::string_view();
}

std::string FoxgloveTopic::name() const { return "/" + instance + (axis.empty() ? "" : "/" + axis) + "/" + stream; }

void FoxgloveTopics::update_axes(const json& listing) {
  current_.clear();
  const auto add = [this](FoxgloveTopic topic) {
    const auto next = static_cast<std::uint32_t>(numbers_.size() + 1);
    const auto known = numbers_.emplace(std::move(topic), next).first;
    current_.emplace(known->second, known->first);
  };
  for (const json& one : listing) {
    const std::string instance = one.at("name");
    add({instance, "", "event"});
    for (const std::string axis : one.at("axes")) {
      for (const char* stream : {"window", "sample"}) add({instance, axis, stream});
    }
  }
}

json foxglove_server_info(const std::string& name) {
  return {{"op", "serverInfo"}, {"name", name}, {"capabilities", json::array()}, {"supportedEncodings", json::array()}};
}

json foxglove_channel(std::uint32_t number, const FoxgloveTopic& topic) {
  return {{"id", number},
          {"topic", topic.name()},
          {"encoding", "json"},
          {"schemaName", schema_name(topic.stream)},
          {"schemaEncoding", "jsonschema"},
          {"schema", json_text(schema_of(topic.stream))}};
}

json foxglove_warning(const std::string& text) {
  constexpr int kWarning = 1;
  return {{"op", "status"}, {"level", kWarning}, {"message", text}};
}

std::vector<FoxgloveRow> foxglove_rows(const std::string& text, std::uint64_t& lost) {
  std::vector<FoxgloveRow> rows;
  const Batch batch = read_batch(text);
  for (const auto& [method, params] : batch.rows) {
    if (method == "lost" && params.value("rows", json()).is_number_unsigned())
      lost += params["rows"].get<std::uint64_t>();
    const double time_s = params.value("time_s", json()).is_number() ? params["time_s"].get<double>() : kMaxSeconds;
    if (!(std::abs(time_s) < kMaxSeconds)) continue;
    const std::string axis = method == "event" ? "" : text_member(params, "axis");
    // A double of seconds is exact to microseconds.
    rows.push_back({{batch.instance, axis, method}, std::llround(time_s * 1e6) * 1000, json_text(params)});
  }
  return rows;
}

std::string foxglove_data(std::uint32_t subscription, std::int64_t time_ns, std::string_view json_text) {
  std::string data(1, '\x01');
  data.reserve(1 + sizeof subscription + sizeof time_ns + json_text.size());
  put_little_endian(data, subscription);
  put_little_endian(data, static_cast<std::uint64_t>(time_ns));
  data += json_text;
  return data;
}

}  // namespace prism::prismweb
