// SPDX-License-Identifier: MIT
#include "daemon/socket/retention_answer.hpp"

#include <algorithm>
#include <array>

#include "base/host_time.hpp"
#include "config/config.hpp"
#include "daemon/socket/answer_json.hpp"

namespace prism::socket {

using nlohmann::ordered_json;

namespace {

const char* why_text(pipeline::NextDeletion::Why why) {
  constexpr std::array kNames{"bytes", "age", "disk_full"};
  return kNames[static_cast<std::size_t>(why)];
}

}  // namespace

ordered_json retention_json(const pipeline::RetentionStatus& status) {
  ordered_json json = {
      {"segments", status.segments},
      {"bytes", status.bytes},
      {"keep_bytes", status.keep_bytes < config::kNoByteLimit ? ordered_json(status.keep_bytes) : ordered_json()},
      {"keep_s", status.keep_s},
      {"deleted_segments", status.deleted_segments},
      {"deleted_rows", status.deleted_rows},
      {"next", nullptr}};
  if (!status.next) return json;
  const pipeline::NextDeletion& next = *status.next;
  json["next"] = {{"file", next.file}, {"rows", next.rows}, {"bytes", next.bytes}, {"why", why_text(next.why)}};
  const std::int64_t passed_s = uptime_s() - status.uptime_s;
  const std::int64_t in_s = std::max<std::int64_t>(next.in_s - passed_s, 0);
  json["next"]["in_s"] = in_s;
  json["next"]["time_s"] = host_time_ns() / 1'000'000'000 + in_s;
  return json;
}

}  // namespace prism::socket
