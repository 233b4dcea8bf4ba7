// SPDX-License-Identifier: MIT
#include "daemon/pipeline/storage_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace prism::pipeline {
namespace {

constexpr double kDayS = 86400, kGiB = 1 << 30;
// A row with a model's columns; a sensor's column; a capture's packet with one frame, without the frame (measured).
constexpr double kRowBytes = 170, kSensorBytes = 10, kPacketBytes = 28;

StoragePlan plan_of(const config::LogSegmentSettings& settings, double bytes_per_day, double frames_per_s) {
  const auto days = static_cast<double>(settings.keep_days);
  const double kept = std::min(days, static_cast<double>(settings.keep_bytes) / bytes_per_day);
  return {kept, kept * bytes_per_day, frames_per_s, settings.keep_days};
}

}  // namespace

std::string StoragePlan::text() const {
  const std::string rate = frames_per_s > 0 ? fmt::format(" at {:g} frames/s", frames_per_s) : "";
  const bool by_bytes = days < static_cast<double>(keep_days);
  const std::string limit = by_bytes ? fmt::format("keep_mib, before keep_days {}", keep_days) : "keep_days";
  return fmt::format("{:.{}f} days{}, {:.1f} GiB ({})", days, days < 100 ? 1 : 0, rate, bytes / kGiB, limit);
}

std::optional<StoragePlan> log_plan(const Setup& setup) {
  if (!setup.config.log) return std::nullopt;
  const double row = kRowBytes + kSensorBytes * static_cast<double>(sensors_of_list(setup.sensors).size());
  return plan_of(*setup.config.log, kDayS * row * static_cast<double>(setup.axes.size()), 0);
}

std::optional<StoragePlan> capture_plan(const Setup& setup) {
  if (!setup.config.capture) return std::nullopt;
  const wire::FrameDescription& frames = *setup.frames;
  const double frame = kPacketBytes + static_cast<double>(frames.max_frame_bytes);
  return plan_of(*setup.config.capture, kDayS * frames.rate_hz * frame, frames.rate_hz);
}

std::string space_warning(const StoragePlan& plan, const std::string& directory) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path place = directory;
  while (!fs::exists(place, error) && place.has_relative_path()) place = place.parent_path();
  const auto space = fs::space(place, error);
  if (error || plan.bytes <= static_cast<double>(space.available)) return {};
  return fmt::format("{}: needs {:.1f} GiB, {:.1f} GiB are free", directory, plan.bytes / kGiB,
                     static_cast<double>(space.available) / kGiB);
}

}  // namespace prism::pipeline
