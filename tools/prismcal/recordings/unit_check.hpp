// SPDX-License-Identifier: MIT
// Compares the mean rate of a recording with the Earth rate of its site: a wrong unit shows there.
#pragma once

#include <optional>
#include <string>

#include "tools/prismcal/recordings/block_table.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {

/// The unit in which the mean rate would be the Earth rate (within 30 %), if it is not in the stated one: "rad/s" of
/// values that were taken for deg/h, "deg/h" of values that were taken for another unit.
/// Returns nullopt if the mean is plausible, no other unit fits either, or the Earth rate is unknown or below
/// 0.5 deg/h.
std::optional<std::string> likely_unit(double mean_deg_per_h, double earth_rate_deg_per_h);

/// Mean over the blocks, with the Earth rate.
double mean_rate_deg_per_h(const BlockTable& table);

/// A question if the mean rate is the Earth rate with the other sign (within 10 %); else empty.
std::string sign_question(const BlockTable& table);

/// The table. Errors, unless the options accept that: its mean rate is the Earth rate in another unit, or above 5
/// deg/s.
Result<BlockTable> with_plausible_unit(Result<BlockTable> table, const SiteOptions& options);

}  // namespace prism::recordings
