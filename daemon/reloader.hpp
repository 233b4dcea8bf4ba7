// SPDX-License-Identifier: MIT
// Reload: reads all files on a thread of its own, since a file server may not respond, and applies them on the live
// thread; a bad configuration changes nothing.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/disk_thread.hpp"
#include "daemon/instance.hpp"

namespace prism::daemon {

/// The loader thread owns copies and a weak reference: the daemon may end while it reads.
class Reloader : public std::enable_shared_from_this<Reloader> {
 public:
  using Done = std::function<void(Result<std::string>)>;
  using Load = std::function<Result<pipeline::Setup>()>;

  /// `load` runs on `loader` (not the thread that writes the log) and must use its own data only. `line_changed` is
  /// called if the line must be reopened.
  static std::shared_ptr<Reloader> make(boost::asio::io_context& io, DiskThread& loader, Load load, Instance& instance,
                                        std::function<void()> line_changed);

  /// A request that comes while a reload runs gets a reload of its own right after: it may be about a newer file.
  void reload(Done done);

 private:
  Reloader(boost::asio::io_context& io, DiskThread& loader, Load load, Instance& instance,
           std::function<void()> line_changed);
  void begin();
  void finish(Result<pipeline::Setup> setup);
  Result<std::string> take(Result<pipeline::Setup> setup);

  boost::asio::io_context& io_;
  DiskThread& loader_;
  const Load load_;
  Instance& instance_;
  std::function<void()> line_changed_;
  std::vector<Done> running_, waiting_;
};

}  // namespace prism::daemon
