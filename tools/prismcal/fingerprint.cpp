// SPDX-License-Identifier: MIT
#include "tools/prismcal/fingerprint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "tools/prismcal/findings.hpp"

namespace prism::recordings {
namespace {

using nlohmann::json;

constexpr std::size_t kSeconds = 32;
constexpr double kLogRounding_deg_per_h = 2e-6;

struct Shared {
  std::size_t files = 0, seconds = 0, compared = 0;
  /// Two equal seconds may be chance if the rate is coarse; shared data has most of them.
  bool convincing() const { return seconds >= 2 && 2 * seconds >= compared; }
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

struct Point {
  std::int64_t second;
  double rate_deg_per_h;
};

std::vector<Point> points_in(const json& fingerprint) {
  std::vector<Point> points;
  for (const json& point : fingerprint) {
    if (point.is_array() && point.size() == 2 && point[0].is_number() && point[1].is_number())
      points.push_back({point[0].get<std::int64_t>(), point[1].get<double>()});
  }
  return points;
}

/// Compares with the seconds of the table that are `later` seconds after the points.
Shared equal_seconds(const std::vector<Point>& points, const BlockTable& table, std::int64_t later, double tolerance) {
  Shared shared;
  for (const Point& point : points) {
    const auto rate = value_at(table.seconds, point.second + later);
    if (!rate) continue;
    ++shared.compared;
    shared.seconds += std::abs(*rate - point.rate_deg_per_h) <= tolerance;
  }
  return shared;
}

/// Of the rate from second to second, at these points.
double noise_deg_per_h(const std::vector<Point>& points, const BlockTable& table, std::int64_t later) {
  double squares = 0, count = 0;
  for (const Point& point : points) {
    const auto rate = value_at(table.seconds, point.second + later),
               next = value_at(table.seconds, point.second + later + 1);
    if (!rate || !next) continue;
    squares += (*next - *rate) * (*next - *rate) / 2;
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

Shared compare_seconds(const std::vector<Point>& points, const BlockTable& table) {
  constexpr std::size_t kEnough = 8;
  constexpr std::int64_t kLostAtStart_s = 5;
  const Shared exact = equal_seconds(points, table, 0, kLogRounding_deg_per_h);
  if (exact.convincing()) return exact;
  // Another program may have rounded the rates, and written times of another zone or from 0.
  const std::vector<Point> own = points_in(fingerprint_json(table));
  if (points.empty() || own.empty()) return exact;
  std::vector<std::int64_t> shifts = {0};
  for (std::int64_t lost = -kLostAtStart_s; lost <= kLostAtStart_s; ++lost)
    shifts.push_back(own.front().second - points.front().second + lost);
  for (const std::int64_t later : shifts) {
    const Shared near = equal_seconds(points, table, later, noise_deg_per_h(points, table, later) / 10);
    if (near.seconds >= kEnough && 10 * near.seconds >= 9 * near.compared) return near;
  }
  return exact;
}

}  // namespace

nlohmann::ordered_json fingerprint_json(const BlockTable& table) {
  std::size_t known = 0;
  for_each_known(table.seconds, [&](std::int64_t, double) { ++known; });
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  const std::size_t count = std::min(kSeconds, known);
  std::size_t at = 0;
  for_each_known(table.seconds, [&](std::int64_t second, double rate) {
    // Rounded twice, as in the models of version 0.2.
    if (points.size() < count && at++ == points.size() * known / count)
      points.push_back({second, rate - table.earth_rate_deg_per_h + table.earth_rate_deg_per_h});
  });
  return points;
}

std::string overlap_text(const std::string& provenance_json, const Recording& recording, const BlockTable& table) {
  const json provenance = json::parse(provenance_json, nullptr, false);
  const bool coarse = rounding_step(table.seconds) > 0;  // two days with the same profile have equal seconds
  Shared shared;
  for (const json& facts : member(provenance, "recordings")) {
    shared.files += shared_files(facts, recording);
    if (coarse) continue;
    const Shared same = compare_seconds(points_in(member(facts, "fingerprint")), table);
    shared.seconds += same.seconds;
    shared.compared += same.compared;
  }
  if (shared.files > 0 && recording.files.size() == 1) return "the model was trained on this file (same SHA-256)";
  if (shared.files > 0)
    return fmt::format("the model was trained on {} of these {} files (same SHA-256)", shared.files,
                       recording.files.size());
  if (!shared.convincing()) return {};
  return fmt::format("the model was trained on data of this recording ({} of {} compared seconds have the same rate)",
                     shared.seconds, shared.compared);
}

}  // namespace prism::recordings
