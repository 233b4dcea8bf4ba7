// SPDX-License-Identifier: MIT
#include "config/config.hpp"

#include <fmt/format.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>

#include "compensation/json_section.hpp"
#include "config/search_path.hpp"
#include "config/socket_place.hpp"
#include "config/text_file.hpp"

namespace prism::config {
namespace {

namespace fs = std::filesystem;

constexpr std::array kParities = {"none", "even", "odd"};
constexpr std::array kClocks = {"host", "device"};
constexpr std::array kFullPolicies = {"stop", "delete_oldest"};
constexpr std::array kLevels = {"debug", "info", "warning", "error"};

// A segment is called NAME-20261121T091100Z-999.pcap (docs/formats.md); file systems take 255 bytes, paths 4095.
constexpr std::size_t kStampBytes = sizeof "-20261121T091100Z-999.pcap" - 1;
constexpr std::size_t kMaxFileNameBytes = 255, kMaxPathBytes = 4095;
constexpr std::size_t kMaxSocketPathBytes = sizeof(sockaddr_un::sun_path) - 1;

template <class T>
std::optional<T> optional_integer(Section& section, const char* key, Range range) {
  if (!section.has(key)) return std::nullopt;
  return static_cast<T>(section.integer(key, range));
}

// It stands in a line of the log's metadata, which a newline or NUL would make unreadable.
std::string one_line(Section& section, const char* key, const std::string& otherwise) {
  std::string text = section.text(key, otherwise);
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  if (std::any_of(text.begin(), text.end(), is_control)) {
    section.fail(key, fmt::format("found {}, expected a text without control characters", shown(Json(text))));
  }
  return text;
}

std::string read_name(Section& section, const fs::path& file) {
  std::string name = one_line(section, "name", file.stem().string());
  if (name.empty() || name.find('/') != std::string::npos) {
    section.fail("name", fmt::format("found \"{}\", expected a name without '/'", name));
  }
  if (name.size() > kMaxFileNameBytes - kStampBytes) {
    section.fail("name",
                 fmt::format("has {} bytes, expected at most {}: segments of log and capture are named after it",
                             name.size(), kMaxFileNameBytes - kStampBytes));
  }
  return name;
}

/// A number of units as a whole number of their parts; `value` has the default.
void read_scaled(const Section& section, const char* key, Range range, double unit, std::int64_t& value) {
  value = static_cast<std::int64_t>(section.number(key, range, static_cast<double>(value) / unit) * unit);
}

GyroSettings read_gyro(Section section) {
  GyroSettings gyro;
  gyro.serial = one_line(section, "serial", "");
  gyro.axis = section.text("axis", "");
  const auto sign = section.integer("sign", {-1, 1}, static_cast<std::int64_t>(gyro.sign));
  if (sign == 0) section.fail("sign", "found 0, expected 1 or -1");
  gyro.sign = static_cast<double>(sign);
  if (section.has("scale_factor_arcsec_per_pulse")) {
    gyro.scale_factor_arcsec_per_pulse = section.number("scale_factor_arcsec_per_pulse", {1e-9, 1e6});
  }
  return gyro;
}

LineConfig read_line(Section section, const fs::path& base) {
  LineConfig line;
  line.device = section.text("device", "");
  if (!line.device.empty()) line.device = (base / line.device).lexically_normal().string();
  line.baud = optional_integer<int>(section, "baud", {50, 20e6});
  line.data_bits = optional_integer<int>(section, "data_bits", {5, 8});
  if (section.has("parity")) line.parity = kParities[section.choice("parity", kParities)];
  line.stop_bits = optional_integer<int>(section, "stop_bits", {1, 2});
  line.silence_s = section.number("silence_s", {0.1, 3600}, line.silence_s);
  line.retry_min_s = section.number("retry_min_s", {0.01, 60}, line.retry_min_s);
  line.retry_max_s =
      section.number("retry_max_s", {line.retry_min_s, 600}, std::max(line.retry_max_s, line.retry_min_s));
  return line;
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

void read_slew(const Section& correction, compensation::SlewSettings& slew) {
  slew.limited = correction.boolean("slew_limit", slew.limited);
  if (!correction.has("max_slew_deg_per_h_per_s")) return;
  if (!slew.limited) correction.fail("max_slew_deg_per_h_per_s", "given although \"slew_limit\" is false");
  slew.max_slew_deg_per_h_per_s = correction.number("max_slew_deg_per_h_per_s", {1e-9, 1e6});
}

SiteSettings read_site(Section section) {
  SiteSettings site;
  site.latitude_deg = section.number("latitude_deg", {-90, 90}, site.latitude_deg);
  if (section.has("elevation_deg")) site.elevation_deg = section.number("elevation_deg", {-90, 90});
  site.azimuth_deg = section.number("azimuth_deg", {-360, 360}, site.azimuth_deg);
  return site;
}

SegmentSettings read_segments(Section section, const fs::path& root, const std::string& otherwise,
                              const std::string& name) {
  SegmentSettings segments;
  const fs::path directory = (root / section.text("directory", otherwise)).lexically_normal();
  segments.directory = directory.string();
  const bool too_long = std::any_of(directory.begin(), directory.end(),
                                    [](const fs::path& part) { return part.native().size() > kMaxFileNameBytes; });
  if (too_long || segments.directory.size() + 1 + name.size() + kStampBytes > kMaxPathBytes) {
    section.fail("directory", fmt::format("a path of {} bytes, expected its segments within {}, each part within {}",
                                          segments.directory.size(), kMaxPathBytes, kMaxFileNameBytes));
  }
  constexpr double kMiB = 1 << 20;
  constexpr double kHour = 3600;
  read_scaled(section, "segment_mib", {0.01, 1e6}, kMiB, segments.max_bytes);
  read_scaled(section, "segment_hours", {0.01, 8784}, kHour, segments.max_age_s);
  read_scaled(section, "keep_mib", {1, 1e9}, kMiB, segments.keep_bytes);
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

// Version 0.1 blended towards a line off the data.
compensation::Extrapolation read_extrapolation(Section& correction, Config& config) {
  constexpr auto& kNames = compensation::kExtrapolationNames;
  std::vector<const char*> names(kNames.begin(), kNames.end());
  names.push_back("blend");
  const std::size_t chosen =
      correction.choice("extrapolation", names, static_cast<std::size_t>(config.engine.extrapolation));
  if (chosen < kNames.size()) return static_cast<compensation::Extrapolation>(chosen);
  config.warnings.push_back(
      config.path + ":/correction/extrapolation: \"blend\" made real gyros worse and is gone; served by \"shrink\"");
  return compensation::Extrapolation::kShrink;
}

Config read_config(Section& top, const fs::path& file) {
  std::error_code error;  // no working folder: paths stay relative
  const fs::path base = fs::absolute(file, error).parent_path();
  Config config;
  config.path = file.string();
  config.name = read_name(top, file);
  config.gyro = read_gyro(top.object("gyro"));
  config.line = read_line(top.object("line"), base);
  config.frames = find_data_file(top.text("frames", "trplg"), "frames", base);
  config.device_clock = top.choice("clock", kClocks, 0) == 1;
  config.site = read_site(top.object("site"));
  if (const std::string model = top.text("model", ""); !model.empty())
    config.model = find_data_file(model, "models", base);
  if (const std::string model = top.text("fallback_model", ""); !model.empty()) {
    config.fallback_model = find_data_file(model, "models", base);
  }
  Section correction = top.object("correction");
  config.engine.max_bias_deg_per_h =
      correction.number("max_bias_deg_per_h", {1e-6, 1e6}, config.engine.max_bias_deg_per_h);
  config.engine.extrapolation = read_extrapolation(correction, config);
  read_slew(correction, config.engine.slew);
  const Section plausibility = top.object("plausibility");
  config.plausibility = {read_rate(plausibility.object("rate")), read_temperature(plausibility.object("temperature")),
                         read_uhfo(plausibility.object("uhfo"))};
  // systemd names the folder it made for this instance; the configuration's own is read-only there.
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

Result<Config> parse_config(std::string_view text, const std::string& path) {
  const Result<JsonDocument> document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  Section top(*document);
  top.any("$schema");  // for editors
  Config config = read_config(top, path);
  if (auto rest = top.finish(); !rest) return tl::unexpected<Error>(rest.error());
  return config;
}

Result<Config> load_config(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_config(*text, path);
}

}  // namespace prism::config
