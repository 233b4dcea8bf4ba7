// SPDX-License-Identifier: MIT
// Reload: reads all files on a thread of its own, since a file server may not respond, and applies them on the live
// thread; an invalid configuration has no effect.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/disk_thread.hpp"
#include "daemon/pipeline/device.hpp"

namespace prism::daemon {

/// Make it with std::make_shared: the loader thread owns copies and a weak reference, since the daemon may end while
/// it reads.
class Reloader : public std::enable_shared_from_this<Reloader> {
 public:
  using Done = std::function<void(Result<std::string>)>;
  using Load = std::function<Result<pipeline::Setup>()>;

  struct Parts {
    Load load;  ///< runs on the loader (not the thread that writes the log) and uses its own data only
    pipeline::Device& device;
    std::function<void()> lines_changed;    ///< the lines must be opened again
    std::function<void()> outputs_changed;  ///< the same of the outputs
    pipeline::Tell tell;
    std::function<std::string()> summary;  ///< for systemd's status, when the reload is over
  };
  Reloader(boost::asio::io_context& io, DiskThread& loader, Parts parts)
      : io_(io), loader_(loader), parts_(std::move(parts)) {}

  /// A request during a reload starts another reload after it, since the files may have changed again.
  void reload(Done done);

 private:
  void begin();
  void finish(Result<pipeline::Setup> setup);
  Result<std::string> take(Result<pipeline::Setup> setup);

  boost::asio::io_context& io_;
  DiskThread& loader_;
  const Parts parts_;
  std::vector<Done> running_, waiting_;
};

}  // namespace prism::daemon
