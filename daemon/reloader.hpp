// SPDX-License-Identifier: MIT
// Reload: read everything on the disk thread, take it over on the live one; a bad configuration leaves all as it was.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/disk_thread.hpp"
#include "daemon/instance.hpp"

namespace prism::daemon {

/// What the disk thread holds of a reload are values of its own and a weak reference: the daemon may end meanwhile.
class Reloader : public std::enable_shared_from_this<Reloader> {
 public:
  using Done = std::function<void(Result<std::string>)>;
  using Load = std::function<Result<pipeline::Setup>()>;

  /// `load` runs on the disk thread and may refer to nothing that lives on another; `line_changed` is called when the
  /// line has to be opened anew.
  static std::shared_ptr<Reloader> make(boost::asio::io_context& io, DiskThread& disk, Load load, Instance& instance,
                                        std::function<void()> line_changed);

  /// A request that comes while a reload runs gets a reload of its own right after: it may be about a newer file.
  void reload(Done done);

 private:
  Reloader(boost::asio::io_context& io, DiskThread& disk, Load load, Instance& instance,
           std::function<void()> line_changed);
  void begin();
  void finish(Result<pipeline::Setup> setup);
  Result<std::string> take(Result<pipeline::Setup> setup);

  boost::asio::io_context& io_;
  DiskThread& disk_;
  const Load load_;
  Instance& instance_;
  std::function<void()> line_changed_;
  std::vector<Done> running_, waiting_;
};

}  // namespace prism::daemon
