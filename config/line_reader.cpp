// SPDX-License-Identifier: MIT
#include "config/line_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "compensation/text_columns.hpp"
#include "config/search_path.hpp"

namespace prism::config {
namespace {

namespace fs = std::filesystem;

constexpr std::array kParities = {"none", "even", "odd"};
constexpr std::array kLineEnds = {"lf", "cr"};
constexpr std::size_t kMostSensorLines = 8;
constexpr double kMostColumns = 64;  // of a line of text

template <class T>
std::optional<T> optional_integer(const Section& section, const char* key, Range range) {
  if (!section.has(key)) return std::nullopt;
  return static_cast<T>(section.integer(key, range));
}

TextColumn read_column(const Section& section, const std::string& name) {
  TextColumn column;
  column.sensor = {name, kSensorUnitNames[section.choice("unit", kSensorUnitNames)]};
  column.column = static_cast<int>(section.integer("column", {1, kMostColumns})) - 1;
  column.min = section.number("min", kAnyNumber, column.min);
  column.max = section.number("max", kAnyNumber, column.max);
  if (column.min > column.max) section.fail("max", fmt::format("{} is below min {}", column.max, column.min));
  return column;
}

TextColumns read_columns(const Section& section) {
  TextColumns text;
  const Section columns = section.object("columns");
  for (const std::string& name : columns.names(TextRule::kSensorName)) {
    if (!is_sensor_name(name) || name.find('.') != std::string::npos)
      columns.fail(name, "invalid sensor name, expected letters, digits and _, not T, U, dTdt or lagN");
    text.columns.push_back(read_column(columns.object(name), name));
  }
  text.separators = section.raw_text("separators", text.separators);
  if (const std::string problem = separators_problem(text.separators); !problem.empty())
    section.fail("separators", problem);
  text.ends_with_cr = section.choice("line_end", kLineEnds, 0) == 1;
  text.decimal_comma = section.boolean("decimal_comma", text.decimal_comma);
  for (const char* key : {"separators", "line_end", "decimal_comma"}) {
    if (section.has(key) && text.columns.empty()) section.fail(key, "given without \"columns\"");
  }
  return text;
}

}  // namespace

LineConfig read_line(const Section& section, const fs::path& base, LineConfig defaults) {
  LineConfig line = std::move(defaults);
  line.device = section.text("device", "");
  if (!line.device.empty()) line.device = (base / line.device).lexically_normal().string();
  line.network = transport::read_network(section);
  if (!line.network.type.empty()) {
    if (section.has("device")) section.fail(line.network.type, "given together with \"device\"; expected one of them");
    transport::Settings settings;
    settings.network = line.network;
    line.device = transport::describe(settings);
  }
  line.baud = optional_integer<int>(section, "baud", {50, 20e6});
  line.data_bits = optional_integer<int>(section, "data_bits", {5, 8});
  if (section.has("parity")) line.parity = kParities[section.choice("parity", kParities)];
  line.stop_bits = optional_integer<int>(section, "stop_bits", {1, 2});
  line.silence_s = section.number("silence_s", {0.1, 3600}, line.silence_s);
  line.retry_min_s = section.number("retry_min_s", {0.01, 60}, line.retry_min_s);
  line.retry_max_s =
      section.number("retry_max_s", {line.retry_min_s, 600}, std::max(line.retry_max_s, line.retry_min_s));
  line.commands = wire::read_commands(section);
  line.allow_send = section.boolean("allow_send", line.allow_send);
  return line;
}

void read_sensor_lines(const Section& top, const fs::path& base, Config& config) {
  if (!top.has("sensor_lines")) return;
  if (!top.has("axes")) top.fail("sensor_lines", "given without \"axes\"; expected a configuration with \"axes\"");
  const Section lines = top.object("sensor_lines");
  for (const std::string& name : lines.names(TextRule::kSensorName)) {
    const Section section = lines.object(name);
    if (!is_sensor_name(name) || name.find('.') != std::string::npos)
      lines.fail(name, "invalid name, expected letters, digits and _, not T, U, dTdt or lagN");
    SensorLineConfig line;
    line.name = name;
    line.stale_after_s = section.number("stale_after_s", {0.1, 3600}, line.stale_after_s);
    LineConfig preset;
    preset.silence_s = line.stale_after_s;
    line.line = read_line(section, base, preset);
    if (line.line.device.empty())
      section.fail("device", "is missing or empty, expected a serial device (or \"tcp\" or \"udp\")");
    if (line.line.device == config.line.device && !line.line.device.empty())
      section.fail("device", fmt::format("{} is the gyro's line", line.line.device));
    line.frames = find_data_file(section.text("frames", "ascii-columns"), "frames", base);
    line.text = read_columns(section);
    config.sensor_lines.push_back(std::move(line));
  }
  if (config.sensor_lines.size() > kMostSensorLines)
    top.fail("sensor_lines",
             fmt::format("found {}, expected at most {}", config.sensor_lines.size(), kMostSensorLines));
}

}  // namespace prism::config
