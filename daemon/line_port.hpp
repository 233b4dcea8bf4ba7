// SPDX-License-Identifier: MIT
// Whose line it is: the gyro's, or that of an instrument beside it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "daemon/instance.hpp"

namespace prism::daemon {

/// What a live line asks of its owner, and hands to it.
class LinePort {
 public:
  virtual ~LinePort() = default;
  virtual const config::LineConfig& config() const = 0;
  virtual const drivers::LineSettings& settings() const = 0;
  virtual LineStatus& status() = 0;
  /// In front of what is told of the line: empty, or the line's name.
  virtual std::string prefix() const = 0;

  virtual void begin_session(std::int64_t now_ns) = 0;
  virtual void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) = 0;
  /// Nothing has arrived until now_ns.
  virtual void expire(std::int64_t now_ns) = 0;
  /// The line was lost.
  virtual void finish() = 0;
};

class GyroPort : public LinePort {
 public:
  explicit GyroPort(Instance& instance) : instance_(instance) {}
  const config::LineConfig& config() const override { return instance_.acquisition.setup().config.line; }
  const drivers::LineSettings& settings() const override { return instance_.acquisition.setup().line; }
  LineStatus& status() override { return instance_.line; }
  std::string prefix() const override { return {}; }
  void begin_session(std::int64_t now_ns) override { instance_.begin_session(now_ns); }
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) override {
    instance_.feed(bytes, arrival_ns);
  }
  void expire(std::int64_t now_ns) override { instance_.expire(now_ns); }
  void finish() override { instance_.finish(); }

 private:
  Instance& instance_;
};

/// A value is told with the bytes that complete it, as a replay tells it: no timer has a part in it.
class SensorPort : public LinePort {
 public:
  SensorPort(Instance& instance, std::size_t line) : instance_(instance), line_(line) {}
  const config::LineConfig& config() const override {
    return instance_.acquisition.setup().config.sensor_lines[line_].line;
  }
  const drivers::LineSettings& settings() const override {
    return instance_.acquisition.setup().sensor_lines[line_].line;
  }
  LineStatus& status() override { return instance_.sensor_lines[line_]; }
  std::string prefix() const override { return instance_.acquisition.setup().sensor_lines[line_].name + ": "; }
  void begin_session(std::int64_t now_ns) override { instance_.acquisition.begin_sensor_session(line_, now_ns); }
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) override {
    status().last_data_ns = arrival_ns;
    instance_.acquisition.feed_sensors(line_, bytes, arrival_ns);
  }
  void expire(std::int64_t) override {}
  void finish() override {}

 private:
  Instance& instance_;
  std::size_t line_;
};

}  // namespace prism::daemon
