// SPDX-License-Identifier: MIT
// The live path's one wait: a read of the gyro's line, interrupted when Asio has something to do.
#pragma once

#include <sys/types.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>

namespace prism::daemon {

class ReactorWatch;

/// What must be served first and at the lowest cost. All calls come from the loop's thread.
class UrgentSource {
 public:
  virtual ~UrgentSource() = default;
  /// False: nothing to read from now.
  virtual bool listening() const = 0;
  /// One read(2) from a descriptor that blocks, with its result and errno.
  virtual ssize_t read() = 0;
  /// What read() gave: > 0 bytes, 0 end of file, -1 with `error` from errno, never EINTR.
  virtual void received(ssize_t size, int error) = 0;
};

/// Asio's reactor tries each read before it waits and once more after it: system calls that find nothing. Here the
/// thread waits in the read itself, so that a frame costs one read and one send; a second thread (ReactorWatch) waits
/// for the reactor's own descriptor and interrupts the read when there are handlers to run. They run on the loop's
/// thread, in between: nothing else in prismd has to know of threads.
///
/// Since the thread waits outside of Asio, Asio cannot wake it: what other threads have to say goes through post().
class EventLoop {
 public:
  EventLoop();

  boost::asio::io_context& io() { return io_; }
  /// Runs `task` on the loop's thread. Any thread may call it, before run() and during it.
  void post(std::function<void()> task);
  /// Returns after stop(). Interrupts the calling thread's reads by SIGURG meanwhile. Throws
  /// boost::system::system_error where the kernel has no descriptor or no thread to give.
  void run(UrgentSource& source);
  /// From the loop's thread.
  void stop() { stopped_ = true; }

 private:
  void hear_bell();
  static void read(UrgentSource& source, ReactorWatch& watch);
  void wait_for_reactor();

  boost::asio::io_context io_{1};
  bool stopped_ = false;                        ///< io_.stopped() would lock a mutex for each frame
  boost::asio::posix::stream_descriptor bell_;  ///< eventfd: post() has something
  const int reactor_;                           ///< epoll descriptor of io_, readable when a handler has to run
};

}  // namespace prism::daemon
