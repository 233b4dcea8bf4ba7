// SPDX-License-Identifier: MIT
#include "daemon/event_loop.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <boost/asio/detail/epoll_reactor.hpp>
#include <boost/asio/post.hpp>
#include <boost/system/system_error.hpp>
#include <cerrno>
#include <utility>

#include "daemon/reactor_watch.hpp"

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
using asio::detail::epoll_reactor;

// Asio has no public way to its epoll descriptor. An explicit instantiation may name a private member
// ([temp.spec.general] of C++20), so that another Boost without this member fails to compile here and does nothing else
// by surprise.
template <int epoll_reactor::*member>
struct Opened {
  friend int epoll_descriptor(const epoll_reactor& reactor) { return reactor.*member; }
};
template struct Opened<&epoll_reactor::epoll_fd_>;
int epoll_descriptor(const epoll_reactor& reactor);

}  // namespace

EventLoop::EventLoop() : bell_(io_, make_eventfd()), reactor_(epoll_descriptor(asio::use_service<epoll_reactor>(io_))) {
  hear_bell();
}

void EventLoop::hear_bell() {
  bell_.async_wait(asio::posix::stream_descriptor::wait_read, [this](boost::system::error_code error) {
    if (error) return;
    eventfd_t rings = 0;
    ::eventfd_read(bell_.native_handle(), &rings);
    hear_bell();
  });
}

void EventLoop::post(std::function<void()> task) {
  asio::post(io_, std::move(task));
  ::eventfd_write(bell_.native_handle(), 1);
}

[[gnu::hot]] void EventLoop::run(UrgentSource& source) {
  ReactorWatch watch(reactor_);
  io_.poll();  // what was started before: nothing rings for it
  while (!stopped_) {
    if (watch.rung()) {
      io_.poll();
      watch.answer();
    } else if (source.listening()) {
      read(source, watch);
    } else {
      wait_for_reactor();
    }
  }
}

[[gnu::hot]] void EventLoop::read(UrgentSource& source, ReactorWatch& watch) {
  watch.begin_read();
  if (watch.rung()) return watch.end_read();
  const ssize_t size = source.read();
  const int error = size < 0 ? errno : 0;
  watch.end_read();
  if (error != EINTR) source.received(size, error);
}

void EventLoop::wait_for_reactor() {
  pollfd wait{reactor_, POLLIN, 0};
  if (::poll(&wait, 1, -1) < 0 && errno != EINTR) {
    throw boost::system::system_error(errno, boost::system::system_category(), "poll");
  }
  io_.poll();
}

}  // namespace prism::daemon
