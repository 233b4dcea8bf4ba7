// SPDX-License-Identifier: MIT
// Joins several descriptors into one that poll(2) can wait for.
#pragma once

#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>

#include "base/file.hpp"

namespace prism::transport {

/// Its descriptor is readable while one of its members is ready. A closed member leaves the set by itself.
class WaitSet {
 public:
  WaitSet() : set_(::epoll_create1(EPOLL_CLOEXEC)) {}

  int fd() const { return set_.get(); }
  /// `events`: EPOLLIN, EPOLLOUT. Changes them if `fd` is a member.
  void wait_for(int fd, std::uint32_t events) {
    epoll_event event{};
    event.events = events;
    event.data.fd = fd;
    if (::epoll_ctl(set_.get(), EPOLL_CTL_ADD, fd, &event) != 0) ::epoll_ctl(set_.get(), EPOLL_CTL_MOD, fd, &event);
  }

 private:
  Descriptor set_;
};

/// A time limit that a WaitSet can wait for.
class Deadline {
 public:
  Deadline() : timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {}

  int fd() const { return timer_.get(); }
  /// 0: no limit.
  void set(std::chrono::milliseconds after) {
    itimerspec time{};
    time.it_value.tv_sec = after.count() / 1000;
    time.it_value.tv_nsec = after.count() % 1000 * 1'000'000;
    ::timerfd_settime(timer_.get(), 0, &time, nullptr);
  }
  /// True once after the limit has passed.
  bool passed() {
    std::uint64_t expirations = 0;
    return ::read(timer_.get(), &expirations, sizeof expirations) == sizeof expirations;
  }

 private:
  Descriptor timer_;
};

}  // namespace prism::transport
