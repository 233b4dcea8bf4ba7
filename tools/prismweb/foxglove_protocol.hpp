// SPDX-License-Identifier: MIT
// Messages of Foxglove's WebSocket protocol for a read-only server. Its names are "foxglove.websocket.v1" and
// "foxglove.sdk.v1" (identical). Specification: foxglove/ws-protocol, docs/spec.md.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace prism::prismweb {

/// Returns the first supported protocol of a Sec-WebSocket-Protocol field, or an empty string.
std::string_view foxglove_protocol_of(std::string_view offered);

/// True for "/foxglove" and "/foxglove?…".
bool is_foxglove(std::string_view target);
/// Returns TOKEN of "/foxglove?token=TOKEN", or an empty string. Tokens need no escapes.
std::string_view foxglove_token_of(std::string_view target);

/// Stream of an axis ("window", "sample") or of an instance ("event", no axis).
struct FoxgloveTopic {
  std::string instance, axis, stream;
  auto operator<=>(const FoxgloveTopic&) const = default;
  /// "/gyro1/z/window", "/gyro1/event".
  std::string name() const;
};

/// Topics of all instances. The number of a topic does not change while prismweb runs.
class FoxgloveTopics {
 public:
  /// `listing`: a list of {"name", "axes"}. Topics not in it are removed from all() until they return.
  void update_axes(const nlohmann::json& listing);
  const std::map<std::uint32_t, FoxgloveTopic>& all() const { return current_; }

 private:
  std::map<FoxgloveTopic, std::uint32_t> numbers_;
  std::map<std::uint32_t, FoxgloveTopic> current_;
};

nlohmann::json foxglove_server_info(const std::string& name);
/// {"id", "topic", "encoding": "json", "schemaName", "schemaEncoding": "jsonschema", "schema"}. Foxglove's parser does
/// not accept nullable types, so messages omit unknown values.
nlohmann::json foxglove_channel(std::uint32_t number, const FoxgloveTopic& topic);
/// A status message of level 1 (warning).
nlohmann::json foxglove_warning(const std::string& text);

struct FoxgloveRow {
  FoxgloveTopic topic;
  std::int64_t time_ns = 0;
  std::string json;
};
/// Returns the rows of a batch {"instance":…,"batch":[…]} that have a time. Adds the rows that prismd dropped to
/// `lost`.
std::vector<FoxgloveRow> foxglove_rows(const std::string& text, std::uint64_t& lost);
/// Binary message: opcode 1, subscription and time (little-endian), JSON.
std::string foxglove_data(std::uint32_t subscription, std::int64_t time_ns, std::string_view json);

}  // namespace prism::prismweb
