// SPDX-License-Identifier: MIT
// Whether the stamps of a series fit uniform samples without a loss, if the stamps are coarser than they look.
#pragma once

#include <optional>
#include <vector>

#include "tools/prismcal/recordings/packed_stamps.hpp"
#include "tools/prismcal/recordings/sample_grid.hpp"

namespace prism::recordings {

struct UniformStamps {
  double interval_ns = 0;          ///< sample time if no sample is lost
  double resolution_ns = 0;        ///< of the stamps
  double width = 0;                ///< of the narrowest strip around a line that has all stamps, in resolutions
  bool batches = false;            ///< equal stamps come in runs of one length
  std::vector<SampleHole> pauses;  ///< the only losses

  bool exact() const { return width <= 1.02; }  ///< as wide as rounding makes it
};

/// The reading "no sample is lost, except in pauses": all stamps are within one resolution of t0 + i T; after a pause,
/// t0 is another. Then the steps have only two lengths, of which one is a resolution longer than the other; 1 s stamps
/// of samples of 1.02 s have steps of 1 s and 2 s. Longer steps are pauses; each run between them needs ten changes of
/// the step on average. Stamps at the start may be finer: printf("%g") has 6 digits, and its resolution grows with the
/// time. Returns nullopt if the stamps do not fit, or have one step only. The strip may be wider than a resolution by a
/// quarter of it, or of T if that is less, because real clocks drift and jitter. Ten losses at random are within such a
/// strip in fewer than one in a hundred thousand records. Memory: that of the pauses. Requires stamps that do not go
/// back, two or more.
std::optional<UniformStamps> uniform_stamps(const PackedStamps& stamps_ns);

}  // namespace prism::recordings
