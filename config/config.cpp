// SPDX-License-Identifier: MIT
#include "config/config.hpp"

#include <fmt/format.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>

#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "config/axis_reader.hpp"
#include "config/line_reader.hpp"
#include "config/search_path.hpp"
#include "config/socket_path.hpp"

namespace prism::config {
namespace {

namespace fs = std::filesystem;

constexpr std::array kClocks = {"host", "device"};
constexpr std::array kFullPolicies = {"stop", "delete_oldest"};
constexpr std::array kLevels = {"debug", "info", "warning", "error"};

// A segment is named NAME-20261121T091100Z-999.pcap (docs/formats.md); file systems allow 255 bytes, paths 4095.
constexpr std::size_t kStampBytes = sizeof "-20261121T091100Z-999.pcap" - 1;
constexpr std::size_t kMaxFileNameBytes = 255, kMaxPathBytes = 4095;
constexpr std::size_t kMaxSocketPathBytes = sizeof(sockaddr_un::sun_path) - 1;

// Segments of log and capture and the socket are named after the instance. Checks the name of the file, too.
std::string read_name(Section& section, const fs::path& file) {
  std::string name = section.text("name", file.stem().string(), TextRule::kName);
  if (auto good = check_text(TextRule::kName, name, ""); !good) section.fail("name", good.error().what);
  return name;
}

/// Reads a number in large units (MiB, days) and returns it in small ones (bytes, seconds); `value` has the default.
void read_scaled(const Section& section, const char* key, Range range, double unit, std::int64_t& value) {
  value = static_cast<std::int64_t>(section.number(key, range, static_cast<double>(value) / unit) * unit);
}

std::optional<double> read_stuck(const Section& section) {
  if (!section.has("stuck_s")) return std::nullopt;
  return section.number("stuck_s", {1, 1e7});
}

SensorStatement read_rate(const Section& section) {
  return {read_range(section, "range_deg_per_s", kRateRanges, kDegPerSInDegPerH), {}, read_stuck(section)};
}

SensorStatement read_temperature(const Section& section) {
  return {read_range(section, "range_degc", kChannelRanges), read_greatest_slope(section, "greatest_slope_degc_per_s"),
          read_stuck(section)};
}

SensorStatement read_uhfo(const Section& section) {
  return {read_range(section, "range_v", kChannelRanges), {}, read_stuck(section)};
}

LogSegmentSettings read_segments(Section section, const fs::path& root, const std::string& otherwise,
                                 const std::string& name) {
  LogSegmentSettings segments;
  const fs::path directory = (root / section.text("directory", otherwise)).lexically_normal();
  segments.directory = directory.string();
  const bool too_long = std::any_of(directory.begin(), directory.end(),
                                    [](const fs::path& part) { return part.native().size() > kMaxFileNameBytes; });
  if (too_long || segments.directory.size() + 1 + name.size() + kStampBytes > kMaxPathBytes) {
    section.fail("directory",
                 fmt::format("a path of {} bytes, expected at most {} with the segment's name, each part at most {}",
                             segments.directory.size(), kMaxPathBytes, kMaxFileNameBytes));
  }
  constexpr double kMiB = 1 << 20;
  constexpr double kHour = 3600;
  read_scaled(section, "segment_mib", {0.01, 1e6}, kMiB, segments.max_bytes);
  read_scaled(section, "segment_hours", {0.01, 8784}, kHour, segments.max_age_s);
  read_scaled(section, "keep_mib", {1, 1e9}, kMiB, segments.keep_bytes);
  if (section.has("keep_days") && !section.has("keep_mib")) segments.keep_bytes = kNoByteLimit;
  segments.keep_days = section.integer("keep_days", {1, 36500}, segments.keep_days);
  segments.delete_when_full = section.choice("when_full", kFullPolicies, 0) == 1;
  return segments;
}

SocketSettings read_socket(Section section, const fs::path& base, const std::string& name) {
  SocketSettings socket;
  const std::string path = section.text("path", default_socket(name));
  if (!path.empty()) socket.path = (base / path).lexically_normal().string();
  if (socket.path.size() > kMaxSocketPathBytes) {
    section.fail("path", fmt::format("\"{}\" has {} bytes, expected at most {}", socket.path, socket.path.size(),
                                     kMaxSocketPathBytes));
  }
  const std::string mode = section.text("mode", fmt::format("{:04o}", socket.mode));
  char* end = nullptr;
  socket.mode = static_cast<int>(std::strtol(mode.c_str(), &end, 8));
  if (mode.empty() || *end != '\0' || socket.mode < 0 || socket.mode > 0777) {
    section.fail("mode", fmt::format("found \"{}\", expected an octal mode such as \"0660\"", mode));
  }
  socket.client_buffer_bytes = section.integer("client_buffer_kib", {16, 1 << 20}, socket.client_buffer_bytes >> 10)
                               << 10;
  socket.max_clients = static_cast<int>(section.integer("max_clients", {1, 10000}, socket.max_clients));
  return socket;
}

Config read_config(Section& top, const fs::path& file) {
  std::error_code error;  // no working directory: paths stay relative
  const fs::path base = fs::absolute(file, error).parent_path();
  Config config;
  config.path = file.string();
  config.name = read_name(top, file);
  const Section section = top.object("gyro");
  config.gyro_serial = section.text("serial", "", TextRule::kText);
  config.line = read_line(top.object("line"), base);
  read_sensor_lines(top, base, config);
  config.frames = find_data_file(top.text("frames", "trplg"), "frames", base);
  if (top.has("rate_hz")) config.rate_hz = top.number("rate_hz", {0.01, 100'000});
  config.device_clock = top.choice("clock", kClocks, 0) == 1;
  config.accept_clock = top.boolean("accept_clock", config.accept_clock);
  config.latitude_deg = top.object("site").number("latitude_deg", {-90, 90}, config.latitude_deg);
  read_axes(top, base, config);
  const Section plausibility = top.object("plausibility");
  config.plausibility = {read_rate(plausibility.object("rate")), read_temperature(plausibility.object("temperature")),
                         read_uhfo(plausibility.object("uhfo"))};
  // systemd sets the directory it created for this instance; the configured directory is read-only there.
  const char* made = std::getenv("LOGS_DIRECTORY");
  const bool given = made != nullptr && *made != '\0';
  const fs::path root = given ? fs::path(made) : base;
  const std::string logs = given ? made : "/var/log/prismd/" + config.name;
  if (top.boolean("write_log", true)) {
    config.log = read_segments(top.object("log"), root, logs, config.name);
  } else if (top.has("log")) {
    top.fail("log", "given although \"write_log\" is false");
  }
  if (top.has("capture")) config.capture = read_segments(top.object("capture"), root, logs + "/capture", config.name);
  config.socket = read_socket(top.object("socket"), base, config.name);
  const auto usual = std::find(kLevels.begin(), kLevels.end(), config.event_level) - kLevels.begin();
  config.event_level = kLevels[top.choice("event_level", kLevels, static_cast<std::size_t>(usual))];
  return config;
}

}  // namespace

const AxisConfig* find_axis(const Config& config, const std::string& name) {
  if (!config.by_axes) return &config.axes.front();
  if (name.empty()) return config.axes.size() == 1 ? &config.axes.front() : nullptr;
  const auto found =
      std::find_if(config.axes.begin(), config.axes.end(), [&](const AxisConfig& axis) { return axis.name == name; });
  return found == config.axes.end() ? nullptr : &*found;
}

Result<Config> parse_config(std::string_view text, const std::string& path) {
  const Result<JsonDocument> document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  Section top(*document);
  top.any("$schema");  // for editors
  std::vector<std::string> removed = top.removed(KeyFile::kPrismd);
  Config config = read_config(top, path);
  config.removed_keys = std::move(removed);
  if (auto rest = top.finish(); !rest) return tl::unexpected<Error>(rest.error());
  return config;
}

Result<Config> load_config(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_config(*text, path);
}

}  // namespace prism::config
