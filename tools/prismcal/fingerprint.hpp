// SPDX-License-Identifier: MIT
// Detects test data that was also used for training.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::recordings {

/// Returns the rates (deg/h, with Earth rate) of up to 32 evenly spaced seconds of a recording as [[second, rate], …].
/// Stored in the model, it identifies the same data in another file, also if cut or converted.
nlohmann::ordered_json fingerprint_json(const BlockTable& table);

/// Returns one line about the data that the recording shares with the training recordings in the model's provenance:
/// files with the same SHA-256, or seconds with the same rate within 2e-6 deg/h, the resolution of a log, or nearly
/// all, and eight or more, within a tenth of the noise, also if all times differ by the same number of seconds. Seconds
/// of a rate whose steps exceed its noise are not compared. Empty if they share no data. Empty also for a model without
/// a fingerprint (version 0.1), where this is unknown.
std::string overlap_text(const std::string& provenance_json, const Recording& recording, const BlockTable& table);

}  // namespace prism::recordings
