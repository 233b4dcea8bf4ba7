// SPDX-License-Identifier: MIT
// The texts of Foxglove's WebSocket protocol ("foxglove.websocket.v1" and, the same under another name,
// "foxglove.sdk.v1"; its specification: foxglove/ws-protocol, docs/spec.md), as far as a server needs them that only
// tells.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace prism::prismweb {

/// The protocol of a Sec-WebSocket-Protocol field that this server speaks; empty: none of those offered.
std::string_view foxglove_protocol_of(std::string_view offered);

/// The target "/foxglove" or "/foxglove?token=TOKEN".
bool is_foxglove(std::string_view target);
/// Its token, without escapes (tokens have none); empty where it has none.
std::string_view foxglove_token_of(std::string_view target);

/// What an instance says of an axis ("window", "sample"), or of itself ("event", no axis).
struct FoxgloveTopic {
  std::string instance, axis, stream;
  auto operator<=>(const FoxgloveTopic&) const = default;
  /// "/gyro1/z/window", "/gyro1/event".
  std::string name() const;
};

/// The topics of all instances, each with a number that it keeps as long as the program runs.
class FoxgloveTopics {
 public:
  /// `listing`: a list of {"name", "axes"}. What is not in it any more has no number until it comes again.
  void update_axes(const nlohmann::json& listing);
  const std::map<std::uint32_t, FoxgloveTopic>& all() const { return there_; }

 private:
  std::map<FoxgloveTopic, std::uint32_t> numbers_;
  std::map<std::uint32_t, FoxgloveTopic> there_;
};

nlohmann::json foxglove_server_info(const std::string& name);
/// {"id", "topic", "encoding": "json", "schemaName", "schemaEncoding": "jsonschema", "schema"}. Foxglove's parser takes
/// plain types only: what is not known is left out of a message, not null.
nlohmann::json foxglove_channel(std::uint32_t number, const FoxgloveTopic& topic);
/// A status of level 1.
nlohmann::json foxglove_warning(const std::string& text);

/// A row of a batch, for the subscribers of its topic.
struct FoxgloveRow {
  FoxgloveTopic topic;
  std::int64_t time_ns = 0;
  std::string json;
};
/// Those of a batch {"instance":…,"batch":[…]} that have a time. `lost` is what prismd says it left out.
std::vector<FoxgloveRow> foxglove_rows(const std::string& text, std::uint64_t& lost);
/// Opcode 1, subscription and time (little-endian), the JSON.
std::string foxglove_data(std::uint32_t subscription, std::int64_t time_ns, std::string_view json);

}  // namespace prism::prismweb
