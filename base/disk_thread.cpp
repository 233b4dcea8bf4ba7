// SPDX-License-Identifier: MIT
#include "base/disk_thread.hpp"

#include <exception>
#include <utility>

namespace prism {

DiskThread::DiskThread(std::size_t max_bytes, Failed failed)
    : max_bytes_(max_bytes), failed_(std::move(failed)), thread_([this] { run(); }) {}

DiskThread::~DiskThread() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  work_.notify_one();
  thread_.join();
}

bool DiskThread::post(std::size_t bytes, Task task, Failed failed) {
  {
    const std::lock_guard lock(mutex_);
    if (bytes > 0 && queued_bytes_ + bytes > max_bytes_) return false;
    queue_.push_back({bytes, std::move(task), std::move(failed)});
    queued_bytes_ += bytes;
  }
  work_.notify_one();
  return true;
}

bool DiskThread::drain(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, timeout, [this] { return queue_.empty() && !busy_; });
}

std::chrono::steady_clock::duration DiskThread::busy_for() const {
  const std::lock_guard lock(mutex_);
  return busy_ ? std::chrono::steady_clock::now() - busy_since_ : std::chrono::steady_clock::duration::zero();
}

void DiskThread::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    work_.wait(lock, [this] { return stop_ || !queue_.empty(); });
    if (queue_.empty()) return;
    Entry entry = std::move(queue_.front());
    queue_.pop_front();
    busy_ = true;
    busy_since_ = std::chrono::steady_clock::now();
    lock.unlock();
    run(entry);
    lock.lock();
    queued_bytes_ -= entry.bytes;
    busy_ = false;
    if (queue_.empty()) idle_.notify_all();
  }
}

// Destroys the task outside the lock, too.
void DiskThread::run(Entry& entry) const noexcept {
  const Failed& failed = entry.failed ? entry.failed : failed_;
  try {
    try {
      entry.task();
    } catch (const std::exception& error) {
      failed(error.what());
    } catch (...) {
      failed("an exception of unknown type");
    }
  } catch (...) {  // out of memory for the message
  }
  entry.task = nullptr;
  entry.failed = nullptr;
}

}  // namespace prism
