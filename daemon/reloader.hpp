// SPDX-License-Identifier: MIT
// Reload: read everything on the disk thread, take it over on the live one; a bad configuration leaves all as it was.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daemon/disk_thread.hpp"
#include "daemon/event_loop.hpp"
#include "daemon/options.hpp"
#include "daemon/station.hpp"

namespace prism::daemon {

class Reloader {
 public:
  using Done = std::function<void(Result<std::string>)>;

  /// `line_changed` is called when the line has to be opened anew.
  Reloader(EventLoop& loop, DiskThread& disk, Options options, Station& station, std::function<void()> line_changed);

  /// A request that comes while a reload runs gets a reload of its own right after: it may be about a newer file.
  void reload(Done done);

 private:
  void begin();
  void finish(Result<Setup> setup);

  EventLoop& loop_;
  DiskThread& disk_;
  Options options_;
  Station& station_;
  std::function<void()> line_changed_;
  std::vector<Done> running_, waiting_;
};

}  // namespace prism::daemon
