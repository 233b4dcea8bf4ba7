// SPDX-License-Identifier: MIT
// System calls that fail when a test says so, for the faults that no folder and no file can be made to have.
#pragma once

#include <atomic>
#include <climits>

namespace prism::test {

inline std::atomic<int> failures_left{0};

/// While it lives, calls of one kind on regular files and folders fail with `error` (errno), `times` times; other
/// descriptors and other calls are left alone.
class FailingCall {
 public:
  FailingCall(std::atomic<int>& call, int error, int times = INT_MAX) : call_(call) {
    failures_left = times;
    call_ = error;
  }
  ~FailingCall() { call_ = 0; }
  FailingCall(const FailingCall&) = delete;
  FailingCall& operator=(const FailingCall&) = delete;

 private:
  std::atomic<int>& call_;
};

inline std::atomic<int> failing_write{0};      ///< write(2)
inline std::atomic<int> failing_fdatasync{0};  ///< fdatasync(2)
inline std::atomic<int> failing_ftruncate{0};  ///< ftruncate(2)
inline std::atomic<int> failing_readdir{0};    ///< readdir(3), as std::filesystem calls it
/// Bytes that write(2) takes before failing_write begins; then it fails.
inline std::atomic<long> writable_bytes{0};
/// Entries that readdir(3) gives, "." and ".." among them, before failing_readdir begins.
inline std::atomic<long> readable_entries{0};

}  // namespace prism::test
