// SPDX-License-Identifier: MIT
#include "daemon/pipeline/storage_plan.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

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

/// The directory, or the part of its path that exists.
std::filesystem::path existing_part(const std::string& directory) {
  std::error_code error;
  std::filesystem::path place = directory;
  while (!std::filesystem::exists(place, error) && place.has_relative_path()) place = place.parent_path();
  return place.empty() ? std::filesystem::path(".") : place;
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

std::string directory_problem(const std::string& directory) {
  namespace fs = std::filesystem;
  const fs::path place = existing_part(directory);
  const bool is_there = place == fs::path(directory);
  const auto problem = [&](const std::string& why) {
    return fmt::format("{}: cannot be {}: {}", directory, is_there ? "written" : "created", why);
  };
  std::error_code error;
  if (!fs::is_directory(place, error)) {
    return error ? "" : problem(is_there ? "it is not a directory" : place.string() + " is not a directory");
  }
  if (const auto space = fs::space(place, error); !error && space.capacity == 0)
    return problem(place.string() + " is a file system without storage");
  if (::access(place.c_str(), W_OK | X_OK) == 0) return {};
  const std::string why = std::error_code(errno, std::generic_category()).message();
  return problem(errno == EACCES ? fmt::format("{} (as the user who ran this check)", why) : why);
}

std::string space_warning(const StoragePlan& plan, const std::string& directory) {
  std::error_code error;
  const auto space = std::filesystem::space(existing_part(directory), error);
  if (error || plan.bytes <= static_cast<double>(space.available)) return {};
  return fmt::format("{}: needs {:.1f} GiB, {:.1f} GiB are free", directory, plan.bytes / kGiB,
                     static_cast<double>(space.available) / kGiB);
}

}  // namespace prism::pipeline
