// SPDX-License-Identifier: MIT
#include "tools/prismsim/truth_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "base/file.hpp"
#include "base/text_number.hpp"
#include "config/version.hpp"

namespace prism::prismsim {

TruthFile::TruthFile(std::string path, Stream file) : path_(std::move(path)), file_(std::move(file)) {}

Result<TruthFile> TruthFile::open(const std::string& path, const simulation::SimulationSettings& settings,
                                  std::size_t axis) {
  auto opened = open_output_stream(path);
  if (!opened) return tl::unexpected<Error>(opened.error());
  TruthFile truth(path, std::move(*opened));
  fmt::print(truth.file_.get(),
             "# simulated: the truth of a virtual gyro, not a measurement\n"
             "# tool: prismsim {}\n"
             "# profile: {}\n# seed: {}\n# frames_per_s: {}\n# earth_rate_deg_per_h: {}\n",
             kVersion, settings.profile.name, settings.seed, settings.rate_hz, settings.earth_rate_deg_per_h[axis]);
  fmt::print(truth.file_.get(),
             "time_utc,time_s,elapsed_s,chamber_degc,body_degc,inner_degc,slope_degc_per_s,uhfo_v,bias_deg_per_h,"
             "sensor_degc,thermal_deg_per_h,hysteresis_deg_per_h,turn_on_deg_per_h,warm_up_deg_per_h,flicker_deg_per_h,"
             "mode_hops_deg_per_h,ageing_deg_per_h,tilt_deg_per_h,gradient_deg_per_h,case_degc\n");
  if (auto flushed = truth.flush(); !flushed) return tl::unexpected<Error>(flushed.error());
  return truth;
}

Result<void> TruthFile::refuse_write() const {
  return make_error(path_, fmt::format("cannot be written: {}", std::strerror(errno)));
}

Result<void> TruthFile::push(std::int64_t time_ns, const simulation::GyroTruth& truth) {
  const std::int64_t second = time_ns / 1'000'000'000;
  if (!std::exchange(begun_, true)) last_second_ = second - (time_ns % 1'000'000'000 == 0 ? 1 : 0);
  if (second <= last_second_) return {};
  last_second_ = second;
  row_ = utc_text(second) + ",";
  append_integer(row_, second);
  const simulation::BiasComponents& causes = truth.causes;
  const std::pair<double, int> columns[]{{truth.time_s, 6},         {truth.chamber_degc, 5},     {truth.body_degc, 6},
                                         {truth.inner_degc, 6},     {truth.slope_degc_per_s, 9}, {truth.uhfo_v, 6},
                                         {truth.bias_deg_per_h, 7}, {truth.sensor_degc, 6},      {causes.thermal, 7},
                                         {causes.hysteresis, 7},    {causes.turn_on, 7},         {causes.warm_up, 7},
                                         {causes.flicker, 7},       {causes.mode_hops, 7},       {causes.ageing, 7},
                                         {causes.tilt, 7},          {causes.gradient, 7},        {truth.case_degc, 5}};
  for (const auto& [value, decimals] : columns) {
    row_ += ',';
    append_fixed(row_, value, decimals);
  }
  row_ += '\n';
  if (std::fwrite(row_.data(), 1, row_.size(), file_.get()) != row_.size()) return refuse_write();
  return {};
}

Result<void> TruthFile::flush() {
  if (std::fflush(file_.get()) != 0) return refuse_write();
  return {};
}

Result<TruthFiles> TruthFiles::open(const std::string& path, const simulation::SimulationSettings& settings,
                                    const wire::FrameDescription& frames) {
  TruthFiles truths;
  for (std::size_t i = 0; i < frames.axes.size(); ++i) {
    std::filesystem::path own = path;
    if (frames.axes.size() > 1)
      own.replace_filename(own.stem().string() + "-" + frames.axes[i].name + own.extension().string());
    auto opened = TruthFile::open(own.string(), settings, i);
    if (!opened) return tl::unexpected<Error>(opened.error());
    truths.files_.push_back(std::move(*opened));
  }
  return truths;
}

Result<void> TruthFiles::push(std::int64_t time_ns, const simulation::SimulatedLine& line) {
  for (std::size_t i = 0; i < files_.size(); ++i) {
    if (auto done = files_[i].push(time_ns, line.truth(i)); !done) return done;
  }
  return {};
}

Result<void> TruthFiles::flush() {
  for (TruthFile& file : files_) {
    if (auto done = file.flush(); !done) return done;
  }
  return {};
}

}  // namespace prism::prismsim
