// SPDX-License-Identifier: MIT
// A recording with all its seconds in memory.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/recording.hpp"

namespace prism::test {

struct CollectedRecording : recordings::Recording {
  std::vector<compensation::SecondMean> second_means;
  std::vector<std::size_t> sessions;  ///< index of the first second of each
};

inline Result<CollectedRecording> collected(const std::string& path, const recordings::SourceOptions& options = {}) {
  CollectedRecording all;
  auto recording = recordings::read_recording(
      path, options,
      [&](const recordings::Recording&, const compensation::SecondMean& second_mean, bool begins_session) {
        if (begins_session) all.sessions.push_back(all.second_means.size());
        all.second_means.push_back(second_mean);
        return Result<void>();
      });
  if (!recording) return tl::unexpected<Error>(recording.error());
  static_cast<recordings::Recording&>(all) = std::move(*recording);
  return all;
}

}  // namespace prism::test
