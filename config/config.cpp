// SPDX-License-Identifier: MIT
#include "config/config.hpp"

#include <fmt/format.h>
#include <sys/un.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "base/file.hpp"
#include "base/json_table.hpp"
#include "compensation/earth_rate.hpp"
#include "config/search_path.hpp"
#include "config/socket_path.hpp"

namespace prism::config {
namespace {

namespace fs = std::filesystem;

// A segment is named NAME-20261121T091100Z-999.pcap (docs/formats.md); file systems allow 255 bytes, paths 4095.
constexpr std::size_t kStampBytes = sizeof "-20261121T091100Z-999.pcap" - 1;
constexpr std::size_t kMaxFileNameBytes = 255, kMaxPathBytes = 4095;
constexpr std::size_t kMaxSocketPathBytes = sizeof(sockaddr_un::sun_path) - 1;

constexpr std::size_t kMostSensorLines = 8;

void resolve_models(const Section& section, const fs::path& base, AxisConfig& axis,
                    std::vector<std::string>& warnings) {
  for (std::string* model : {&axis.model, &axis.fallback_model}) {
    if (!model->empty()) *model = find_data_file(*model, "models", base);
  }
  // Value "blend" of version 0.1, after the last name.
  if (static_cast<std::size_t>(axis.engine.extrapolation) < compensation::kExtrapolationNames.size()) return;
  axis.engine.extrapolation = compensation::Extrapolation::kShrink;
  warnings.push_back(section.object("correction").where() +
                     "/extrapolation: \"blend\" was removed because it made real gyros worse; using \"shrink\"");
}

/// Of an axis that is not vertical.
void warn_of_azimuth(Config& config) {
  for (const AxisConfig& axis : config.axes) {
    if (!axis.elevation_deg || axis.azimuth_stated) continue;
    const double range = compensation::azimuth_range_deg_per_h({config.latitude_deg, *axis.elevation_deg, 0});
    if (range < compensation::kAzimuthMatters) continue;
    config.warnings.push_back(
        fmt::format("azimuth_deg{} is not stated: north (0) is assumed; the Earth rate on this axis depends on it by "
                    "up to {:.3g} deg/h",
                    axis.name.empty() ? "" : " of axis " + axis.name, range));
  }
}

void resolve_line(const Section& section, const fs::path& base, LineConfig& line) {
  if (line.network.type.empty()) {
    if (!line.device.empty()) line.device = (base / line.device).lexically_normal().string();
    return;
  }
  if (section.has("device")) section.fail(line.network.type, "given together with \"device\"; expected one of them");
  transport::Settings settings;
  settings.network = line.network;
  line.device = transport::describe(settings);
}

// A further line: present, and none of `used`, to which it is added.
void resolve_other_line(const Section& section, const fs::path& base, LineConfig& line,
                        std::vector<std::string>& used) {
  resolve_line(section, base, line);
  if (line.device.empty())
    section.fail("device", "is missing or empty, expected a serial device (or \"tcp\" or \"udp\")");
  if (std::find(used.begin(), used.end(), line.device) != used.end())
    section.fail("device", fmt::format("{} is another line of this configuration", line.device));
  used.push_back(line.device);
}

// Parts of a name with "." would be taken for LINE.SENSOR.
bool is_simple_name(const std::string& name) { return is_sensor_name(name) && name.find('.') == std::string::npos; }

void resolve_sensor_lines(const Section& top, const fs::path& base, Config& config, std::vector<std::string>& used) {
  if (top.has("sensor_lines") && !top.has("axes"))
    top.fail("sensor_lines", "given without \"axes\"; expected a configuration with \"axes\"");
  const Section lines = top.object("sensor_lines");
  for (SensorLineConfig& line : config.sensor_lines) {
    const Section section = lines.object(line.name);
    if (!is_simple_name(line.name))
      lines.fail(line.name, "invalid name, expected letters, digits and _, not T, U or dTdt");
    resolve_other_line(section, base, line.line, used);
    line.frames = find_data_file(line.frames, "frames", base);
    for (const TextColumn& column : line.text.columns) {
      if (!is_simple_name(column.sensor.name))
        section.object("columns").fail(column.sensor.name,
                                       "invalid sensor name, expected letters, digits and _, not T, U or dTdt");
    }
  }
  if (config.sensor_lines.size() > kMostSensorLines)
    top.fail("sensor_lines",
             fmt::format("found {}, expected at most {}", config.sensor_lines.size(), kMostSensorLines));
}

void resolve_outputs(const Section& top, const fs::path& base, Config& config, std::vector<std::string>& used) {
  const std::vector<Section> sections = top.objects("out", false);  // none after a fault
  for (std::size_t i = 0; i < sections.size(); ++i) {
    OutputConfig& output = config.outputs[i];
    const Section line = sections[i].object("line");
    resolve_other_line(line, base, output.line, used);
    if (output.line.network.type == "udp" && output.line.network.listens)
      line.object("udp").fail("listen", "an output has no sender to answer; expected \"address\"");
    if (output.capture && !config.capture) sections[i].fail("capture", "given without the configuration's \"capture\"");
    if (output.frames != "same" && output.frames != "prism")
      output.frames = find_data_file(output.frames, "frames", base);
  }
}

void resolve_directory(const Section& section, const fs::path& root, const std::string& otherwise,
                       const std::string& name, LogSegmentSettings& segments) {
  const fs::path directory = (root / (section.has("directory") ? segments.directory : otherwise)).lexically_normal();
  segments.directory = directory.string();
  const bool too_long = std::any_of(directory.begin(), directory.end(),
                                    [](const fs::path& part) { return part.native().size() > kMaxFileNameBytes; });
  if (too_long || segments.directory.size() + 1 + name.size() + kStampBytes > kMaxPathBytes) {
    section.fail("directory",
                 fmt::format("a path of {} bytes, expected at most {} with the segment's name, each part at most {}",
                             segments.directory.size(), kMaxPathBytes, kMaxFileNameBytes));
  }
}

void resolve_socket(const Section& section, const fs::path& base, const std::string& name, std::string& path) {
  if (!section.has("path")) path = default_socket(name);
  if (!path.empty()) path = (base / path).lexically_normal().string();
  if (path.size() > kMaxSocketPathBytes) {
    section.fail("path",
                 fmt::format("\"{}\" has {} bytes, expected at most {}", path, path.size(), kMaxSocketPathBytes));
  }
}

Config read_config(const Section& top, const fs::path& file) {
  Config config;
  config.path = file.string();
  config.name = file.stem().string();
  config.by_axes = top.has("axes");
  if (!config.by_axes) config.axes.emplace_back();
  config.log.emplace();
  config_keys().read(top, config);
  if (!top.good()) return config;

  std::error_code error;  // no working directory: paths stay relative
  const fs::path base = fs::absolute(file, error).parent_path();
  // Segments of log and capture and the socket are named after the instance. Checks the name of the file, too.
  if (auto good = check_text(TextRule::kName, config.name, ""); !good) top.fail("name", good.error().what);
  resolve_line(top.object("line"), base, config.line);
  std::vector<std::string> used = {config.line.device};
  resolve_sensor_lines(top, base, config, used);
  config.frames = find_data_file(config.frames, "frames", base);
  resolve_outputs(top, base, config, used);
  if (config.axes.empty()) top.fail("axes", "found none, expected at least one axis");
  for (AxisConfig& axis : config.axes)
    resolve_models(config.by_axes ? top.object("axes").object(axis.name) : top, base, axis, config.warnings);
  warn_of_azimuth(config);
  // systemd sets the directory it created for this instance; the configured directory is read-only there.
  const char* made = std::getenv("LOGS_DIRECTORY");
  const bool given = made != nullptr && *made != '\0';
  const fs::path root = given ? fs::path(made) : base;
  const std::string logs = given ? made : "/var/log/prismd/" + config.name;
  if (config.log) resolve_directory(top.object("log"), root, logs, config.name, *config.log);
  if (config.capture) resolve_directory(top.object("capture"), root, logs + "/capture", config.name, *config.capture);
  resolve_socket(top.object("socket"), base, config.name, config.socket.path);
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
  const Section top(*document);
  std::vector<std::string> removed = top.removed(KeyFile::kPrismd);
  Config config = read_config(top, path);
  config.removed_keys = std::move(removed);
  if (auto rest = top.finish(); !rest) return tl::unexpected<Error>(rest.error());
  return config;
}

Result<Config> load_config(const std::string& path) {
  return read_text_file(path).and_then([&](const std::string& text) { return parse_config(text, path); });
}

}  // namespace prism::config
