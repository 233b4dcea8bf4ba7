// SPDX-License-Identifier: MIT
// A loop over independent jobs on a few threads.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace prism::training {

/// Calls job(i) for i in [0, count), in any order and on at most `threads` threads; jobs must not throw.
template <class Job>
void parallel_for(int count, int threads, Job&& job) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) job(i);
  };
  std::vector<std::thread> team;
  for (int t = 1; t < std::min(threads, count); ++t) team.emplace_back(work);
  work();
  for (std::thread& member : team) member.join();
}

}  // namespace prism::training
