// SPDX-License-Identifier: MIT
#include "daemon/pipeline/storage.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

namespace prism::pipeline {
namespace {

constexpr double kDayS = 86400;
// A row with a model's columns; a sensor's column; a capture's packet with one frame, without the frame (measured).
constexpr double kRowBytes = 170, kSensorBytes = 10, kPacketBytes = 28;

/// The directory, or the part of its path that exists.
std::filesystem::path existing_part(const std::string& directory) {
  std::error_code error;
  std::filesystem::path place = directory;
  while (!std::filesystem::exists(place, error) && place.has_relative_path()) place = place.parent_path();
  return place.empty() ? std::filesystem::path(".") : place;
}

}  // namespace

double log_bytes_per_day(const Setup& setup) {
  if (!setup.config.log) return 0;
  const double row = kRowBytes + kSensorBytes * static_cast<double>(sensors_of_list(setup.sensors).size());
  return kDayS * row * static_cast<double>(setup.axes.size());
}

double capture_bytes_per_day(const Setup& setup) {
  if (!setup.config.capture) return 0;
  const wire::FrameDescription& frames = *setup.frames;
  return kDayS * frames.rate_hz * (kPacketBytes + static_cast<double>(frames.max_frame_bytes));
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

}  // namespace prism::pipeline
