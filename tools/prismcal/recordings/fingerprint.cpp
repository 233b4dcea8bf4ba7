// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/fingerprint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace prism::recordings {
namespace {

using nlohmann::json;

constexpr std::size_t kSeconds = 32;
constexpr double kLogRounding_deg_per_h = 2e-6;

struct Shared {
  std::size_t files = 0, seconds = 0, compared = 0;
};

// Provenance may be edited by hand: returns null if `object` is not an object or has no such member.
json member(const json& object, const char* key) { return object.is_object() ? object.value(key, json()) : json(); }

std::size_t shared_files(const json& facts, const Recording& recording) {
  std::set<std::string> trained;
  for (const json& file : member(facts, "files")) {
    if (const json sha256 = member(file, "sha256"); sha256.is_string()) trained.insert(sha256.get<std::string>());
  }
  return static_cast<std::size_t>(std::count_if(recording.files.begin(), recording.files.end(),
                                                [&](const SourceFile& file) { return trained.contains(file.sha256); }));
}

void compare_seconds(const json& facts, const BlockTable& table, Shared& shared) {
  for (const json& point : member(facts, "fingerprint")) {
    if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number()) continue;
    const auto second = point[0].get<std::int64_t>();
    const auto at = table.seconds.find(second);
    if (!at) continue;
    ++shared.compared;
    const double rate = table.seconds.rate(*at) - table.earth_rate_deg_per_h + table.earth_rate_deg_per_h;
    shared.seconds += std::abs(rate - point[1].get<double>()) <= kLogRounding_deg_per_h;
  }
}

}  // namespace

nlohmann::ordered_json fingerprint_json(const BlockTable& table) {
  std::size_t known = 0;
  table.seconds.for_each([&](std::int64_t, double rate) { known += std::isfinite(rate); });
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  const std::size_t count = std::min(kSeconds, known);
  std::size_t at = 0;
  table.seconds.for_each([&](std::int64_t second, double rate) {
    if (!std::isfinite(rate)) return;
    // Rounded twice, as in the models of version 0.2.
    if (points.size() < count && at++ == points.size() * known / count)
      points.push_back({second, rate - table.earth_rate_deg_per_h + table.earth_rate_deg_per_h});
  });
  return points;
}

std::string overlap_text(const std::string& provenance_json, const Recording& recording, const BlockTable& table) {
  const json provenance = json::parse(provenance_json, nullptr, false);
  Shared shared;
  for (const json& facts : member(provenance, "recordings")) {
    shared.files += shared_files(facts, recording);
    compare_seconds(facts, table, shared);
  }
  if (shared.files > 0 && recording.files.size() == 1) return "the model was trained on this file (same SHA-256)";
  if (shared.files > 0)
    return fmt::format("the model was trained on {} of these {} files (same SHA-256)", shared.files,
                       recording.files.size());
  // Two equal seconds may be chance if the rate is coarse; shared data has most of them.
  if (shared.seconds < 2 || 2 * shared.seconds < shared.compared) return {};
  return fmt::format("the model was trained on data of this recording ({} of {} compared seconds have the same rate)",
                     shared.seconds, shared.compared);
}

}  // namespace prism::recordings
