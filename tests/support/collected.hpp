// SPDX-License-Identifier: MIT
// A recording with all its seconds in memory.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/recordings/recording.hpp"

namespace prism::test {

struct CollectedRecording : recordings::Recording {
  std::vector<compensation::SecondMean> second_means;
  std::vector<std::size_t> sessions;  ///< index of the first second of each
};

inline Result<CollectedRecording> collected(const std::string& path, const recordings::SourceOptions& options = {}) {
  struct Collector : recordings::SecondConsumer {
    CollectedRecording all;
    Result<void> begin(const recordings::Recording&) override { return {}; }
    Result<void> push(const compensation::SecondMean& second_mean, bool begins_session) override {
      if (begins_session) all.sessions.push_back(all.second_means.size());
      all.second_means.push_back(second_mean);
      return {};
    }
  } collector;
  auto recording = recordings::read_recording(path, options, collector);
  if (!recording) return tl::unexpected<Error>(recording.error());
  static_cast<recordings::Recording&>(collector.all) = std::move(*recording);
  return std::move(collector.all);
}

}  // namespace prism::test
