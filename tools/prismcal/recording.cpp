// SPDX-License-Identifier: MIT
#include "tools/prismcal/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "compensation/earth_rate.hpp"
#include "config/config.hpp"
#include "daemon/pipeline/captures.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/stream_watch.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/shown_bytes.hpp"
#include "tools/prismcal/plain_table.hpp"

namespace prism::recordings {
namespace {

Result<compensation::AxisPlacement> site_of(const Recording& recording) {
  compensation::AxisPlacement placement;
  const std::string site = recording.value("site");
  if (std::sscanf(site.c_str(), "latitude_deg %lf elevation_deg %lf azimuth_deg %lf", &placement.latitude_deg,
                  &placement.elevation_deg, &placement.azimuth_deg) != 3) {
    return make_error(recording.name,
                      "found no site in its log, expected --latitude and --elevation, or --no-earth-rate");
  }
  const auto within = [](double angle, double most) { return std::fabs(angle) <= most; };  // not NaN
  if (!within(placement.latitude_deg, 90) || !within(placement.elevation_deg, 90) ||
      !within(placement.azimuth_deg, 360))
    return make_error(recording.name, fmt::format("found the site \"{}\", expected a latitude and an elevation within "
                                                  "-90 to 90 and an azimuth within -360 to 360",
                                                  site));
  return placement;
}

/// A file that is not a log of prismd.
bool is_foreign(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && !begins_a_log(path);
}

/// Advice for a table of another program. If its header states a rate, it is a command line to copy.
Error without_map(const std::string& path, const SourceOptions& options) {
  const auto table = tables::PlainTable::open(path, options.table);
  if (!table) return table.error();
  if (rate_column(*table))
    return {path, fmt::format("not a log of prismd; its header fits: {} ({})", train_command(*table, options.table),
                              kSiteAdvice)};
  return {path, fmt::format("not a log of prismd: found columns {}; prismcal reads any table with --map "
                            "rate=COLUMN:UNIT,temperature=COLUMN:UNIT,time=COLUMN:UNIT; see prismcal inspect {}",
                            table->names_text(), shell_word(path))};
}

// A capture, through the same pipeline as prismd.

Result<std::vector<std::string>> axes_of_capture(const SourceOptions& options) {
  if (options.config.empty()) return std::vector<std::string>();
  const auto config = config::load_config(options.config);
  if (!config) return tl::unexpected<Error>(config.error());
  std::vector<std::string> names;
  for (const config::AxisConfig& axis : config->axes) names.push_back(axis.name);
  return names;
}

/// Reads a capture or raw bytes with the frame description of options.config.
Result<void> read_capture(const std::string& path, const SourceOptions& options, SecondFeed& feed) {
  pipeline::Overrides overrides;
  overrides.without_models = true;
  auto setup = pipeline::load_setup(options.config, overrides);
  if (!setup) return tl::unexpected<Error>(setup.error());
  auto reader = pipeline::open_capture(path, *setup->frames);
  if (!reader) return tl::unexpected<Error>(reader.error());
  if (auto used = pipeline::use_time_of(*reader, path, *setup); !used) return tl::unexpected<Error>(used.error());
  std::vector<std::string> names;
  for (const wire::AxisRule& rule : setup->frames->axes) names.push_back(rule.name);
  const auto axis = choose_axis(names, options.axis, setup->config.path);
  if (!axis) return tl::unexpected<Error>(axis.error());
  Recording& recording = feed.recording();
  recording.is_date = true;
  std::istringstream metadata(pipeline::log_metadata(*setup, *axis));
  for (std::string line; std::getline(metadata, line);) recording.add(line);
  add_remarks(recording.findings, "configuration", setup->config.removed_keys);
  add_remarks(recording.findings, "configuration", setup->config.warnings);
  pipeline::Pipeline pipeline(*setup);
  std::optional<std::int64_t> session_ns;
  Result<void> fed;
  const auto add = [&](const pipeline::Rows& rows) {
    for (const auto& window : rows.windows) {
      if (window.axis != *axis || !fed) continue;
      const bool begins = session_ns != window.session_ns;
      session_ns = window.session_ns;
      fed = feed.push(window.row.window.second_mean, begins);
    }
  };
  auto sensors = pipeline::SensorCaptures::open(*setup, pipeline::sensor_files_beside(*setup, path));
  if (!sensors) return tl::unexpected<Error>(sensors.error());
  const auto feed_sensor = [&](std::size_t line, const drivers::CapturePacket& packet) {
    if (packet.event == drivers::CaptureEvent::kOpened) pipeline.begin_sensor_session(line, packet.time_ns);
    if (packet.event == drivers::CaptureEvent::kData) pipeline.feed_sensors(line, packet.bytes, packet.time_ns);
  };
  std::size_t packets = 0;
  for (; const auto packet = reader->next(); ++packets) {
    sensors->until(*packet, feed_sensor);
    if (packet->event == drivers::CaptureEvent::kOpened) add(pipeline.begin_session(packet->time_ns));
    if (packet->event == drivers::CaptureEvent::kData) add(pipeline.feed(packet->bytes, packet->time_ns));
    if (!fed) return fed;
  }
  add(pipeline.finish());
  if (!fed) return fed;
  const std::string clocks = pipeline::clocks_text(*setup->frames, pipeline.clock().rate_check());
  if (!clocks.empty())
    return make_error(path, clocks + "; correct rate_hz, or accept it with \"accept_clock\" in the configuration");
  if (recording.seconds == 0 && options.leave_out.empty())
    return make_error(path, "found no frame of " + setup->config.frames);
  feed.finish();
  add_remarks(recording.findings, "file", sensors->notes());
  add_remarks(recording.findings, "file", {reader->damaged_places().text(), reader->tail_damage()});
  const auto sum = sha256_of_file(path);
  if (!sum) return tl::unexpected<Error>(sum.error());
  recording.files.push_back({path, *sum, packets});
  return {};
}

}  // namespace

bool is_capture(const std::string& path) {
  auto in = FileReader::open(path);
  std::array<char, 4> magic{};
  if (!in || in->read(magic) != magic.size()) return false;
  std::uint32_t value = 0;
  std::memcpy(&value, magic.data(), sizeof value);
  return value == 0xa1b23c4d || value == 0xa1b2c3d4 || value == 0x4d3cb2a1 || value == 0xd4c3b2a1 ||
         value == 0x0a0d0d0a;
}

Result<std::string> bytes_kind(const std::string& path) {
  if (is_capture(path)) return std::string("capture");
  const auto foreign = tables::foreign_file(path);
  if (!foreign) return tl::unexpected<Error>(foreign.error());
  if (!foreign->empty()) return std::string();
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::array<char, drivers::kFirstBytes> bytes{};
  const std::string_view first(bytes.data(), in->read(bytes));
  if (drivers::is_binary(first)) return std::string("file of bytes");
  const auto sentences = drivers::has_sentences(path, first);
  if (!sentences) return tl::unexpected<Error>(sentences.error());
  return std::string(*sentences ? "log of sentences" : "");
}

Result<std::size_t> choose_axis(const std::vector<std::string>& names, const std::string& wanted,
                                const std::string& where) {
  const auto found = wanted.empty() && names.size() == 1 ? names.begin() : std::ranges::find(names, wanted);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  const std::string all = names.empty() ? "a log that names its axis" : fmt::format("{}", fmt::join(names, ", "));
  return make_error(where, wanted.empty()
                               ? fmt::format("found the axes {}, expected one; choose it with --axis", all)
                               : fmt::format("found no axis \"{}\", expected one of {}", plain_text(wanted), all));
}

std::string Metadata::value(const std::string& key) const {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : found->second;
}

std::optional<std::pair<std::string_view, std::string_view>> Metadata::add(std::string_view line) {
  const std::size_t colon = line.find(": ");
  if (!line.starts_with("# ") || colon == std::string_view::npos) return std::nullopt;
  const std::pair entry{line.substr(2, colon - 2), line.substr(colon + 2)};
  metadata.emplace(entry);
  return entry;
}

std::vector<SensorName> Recording::sensors() const { return sensors_of_list(sensor_list); }

SecondFeed::SecondFeed(const std::string& path, LeaveOut leave_out, const OnSecond& on_second)
    : leave_out_(std::move(leave_out)), on_second_(on_second) {
  const std::filesystem::path name(path);
  recording_.name = (name.has_stem() ? name.stem() : name.parent_path().stem()).string();
}

Result<void> SecondFeed::push(const compensation::SecondMean& second_mean, bool begins_session) {
  if (auto good = leave_out_.begin(second_mean.second, recording_.is_date); !good) return good;
  session_begins_ = session_begins_ || begins_session;
  if (leave_out_.contains(second_mean.second)) return {};
  begins_session = std::exchange(session_begins_, false);
  jumps_.push(second_mean, begins_session);
  if (recording_.seconds++ == 0) recording_.sensor_list = second_mean.sensor_list;
  ++recording_.samples[second_mean.samples];
  return on_second_(recording_, second_mean, begins_session);
}

void SecondFeed::finish() {
  add_remarks(recording_.findings, "left out", leave_out_.notes());
  for (Finding& jump : jumps_.findings(recording_.is_date)) recording_.findings.push_back(std::move(jump));
  recording_.unmatched = leave_out_.unmatched();
}

void UnmatchedRanges::add(const Recording& recording) {
  std::erase_if(ranges_, [&](const std::string& range) {
    return std::ranges::find(recording.unmatched, range) == recording.unmatched.end();
  });
}

Result<void> UnmatchedRanges::finish() const {
  if (ranges_.empty()) return {};
  return make_error("--leave-out",
                    fmt::format("found \"{}\", which contains no second of a recording: nothing would be "
                                "left out",
                                ranges_.front()));
}

namespace {

Result<void> read(const std::string& path, const SourceOptions& options, SecondFeed& feed) {
  if (!options.map.empty()) return read_mapped(path, options, feed);
  if (!is_foreign(path)) return read_log(path, options, feed);
  const auto kind = bytes_kind(path);
  if (!kind) return tl::unexpected<Error>(kind.error());
  if (kind->empty()) return tl::unexpected<Error>(without_map(path, options));
  if (!options.config.empty()) return read_capture(path, options, feed);
  return make_error(path,
                    fmt::format("is a {}; expected --config PRISMD.JSON, which names its frame description; prismd "
                                "--sniff {} finds the description",
                                *kind, shell_word(path)));
}

}  // namespace

Result<Recording> read_recording(const std::string& path, const SourceOptions& options, const OnSecond& on_second) {
  // Models and reports contain the name.
  if (!is_printable(path)) return make_error(path, "has a name that is not printable UTF-8; rename it");
  SecondFeed feed(path, LeaveOut(options.leave_out), on_second);
  if (auto done = read(path, options, feed); !done) return tl::unexpected<Error>(done.error());
  return std::move(feed.recording());
}

Result<std::vector<std::string>> axes_of(const std::string& path, const SourceOptions& options) {
  if (!options.map.empty()) return std::vector<std::string>();
  return is_foreign(path) ? axes_of_capture(options) : axes_of_log(path);
}

Result<double> earth_rate_of(const Recording& recording, const SiteOptions& options) {
  if (options.no_earth_rate) return 0.0;
  compensation::AxisPlacement placement;
  if (!options.latitude_deg || !options.elevation_deg) {
    const auto site = site_of(recording);
    if (!site) return tl::unexpected<Error>(site.error());
    placement = *site;
  }
  placement.latitude_deg = options.latitude_deg.value_or(placement.latitude_deg);
  placement.elevation_deg = options.elevation_deg.value_or(placement.elevation_deg);
  placement.azimuth_deg = options.azimuth_deg.value_or(placement.azimuth_deg);
  const bool from_options = options.latitude_deg && options.elevation_deg && !options.azimuth_deg;
  const double range = compensation::azimuth_range_deg_per_h(placement);
  if (from_options && range >= compensation::kAzimuthMatters)
    return make_error("--azimuth",
                      fmt::format("found none, expected it for an axis that is not vertical: the Earth rate "
                                  "on it depends on the azimuth by up to {:.3g} deg/h",
                                  range));
  return compensation::earth_rate_deg_per_h(placement);
}

}  // namespace prism::recordings
