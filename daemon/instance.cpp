// SPDX-License-Identifier: MIT
#include "daemon/instance.hpp"

#include <utility>

#include "base/escape.hpp"
#include "daemon/arrival_clock.hpp"

namespace prism::daemon {

Instance::Instance(pipeline::Setup setup, std::vector<std::unique_ptr<RowWriter>> logs,
                   std::unique_ptr<CaptureLog> capture, EventLog::Tell told)
    : started_ns(host_time_ns()),
      events([this, told = std::move(told)](const Event& event) {
        told(event);
        publisher.event(event.json);
      }),
      acquisition(std::move(setup), std::move(logs), std::move(capture), events) {
  line.since_ns = started_ns;
  sensor_lines.resize(acquisition.setup().sensor_lines.size(), line);
}

void Instance::rows_written() {
  held_ = disk_late_ = false;
  publisher.release();
}

void Instance::release_late() {
  if (std::exchange(held_, publisher.holds()) && held_) {
    disk_late_ = true;
    publisher.release();
  }
}

void Instance::tell(Severity severity, const std::string& kind, const std::string& text) {
  events.add(severity, kind, printable(text), host_time_ns());
}

void Instance::set_line(LineState state, const std::string& detail) { line.set(state, detail, host_time_ns()); }

}  // namespace prism::daemon
