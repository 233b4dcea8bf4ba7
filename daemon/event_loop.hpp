// SPDX-License-Identifier: MIT
// The live path's one wait: the gyro's line and everything that Asio watches, in a single poll(2).
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>

namespace prism {

/// The descriptor that must be served first and at the lowest cost.
class UrgentSource {
 public:
  virtual ~UrgentSource() = default;
  /// -1: nothing to wait for now.
  virtual int descriptor() const = 0;
  /// The descriptor is readable, closed or in error. Called on the loop's thread.
  virtual void readable() = 0;
};

/// Asio's reactor tries each read before it waits and once more after it: a system call a frame that finds nothing.
/// Here the line stays outside: poll(2) waits for the line and for the reactor's own descriptor, the line is read
/// once for each time it is readable, and Asio's handlers run when Asio has something to do.
///
/// Since the thread waits outside of Asio, Asio cannot wake it: what other threads have to say goes through post().
class EventLoop {
 public:
  EventLoop();

  boost::asio::io_context& io() { return io_; }
  /// Runs `task` on the loop's thread. Any thread may call it, before run() and during it.
  void post(std::function<void()> task);
  /// Returns after stop(). Throws boost::system::system_error where poll(2) fails: our own bug.
  void run(UrgentSource& source);
  /// From the loop's thread.
  void stop() { stopped_ = true; }

 private:
  void hear_bell();

  boost::asio::io_context io_{1};
  bool stopped_ = false;  ///< io_.stopped() would lock a mutex for each frame
  boost::asio::posix::stream_descriptor bell_;  ///< eventfd: post() has something
  const int reactor_;                           ///< epoll descriptor of io_, readable when a handler has to run
};

}  // namespace prism
