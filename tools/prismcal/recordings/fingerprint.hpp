// SPDX-License-Identifier: MIT
// Whether a model was trained on what it is judged on: a judgement of that kind is no test.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/prismcal/recordings/block_table.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {

/// What a model remembers of a recording: the rates (deg/h, earth rate included) of up to 32 of its seconds, evenly
/// spaced, as [[second, rate], …]. Another file with the same data, cut or converted, is known by it.
nlohmann::ordered_json fingerprint_json(const BlockTable& table);

/// One line that says what the recording shares with those that the model was trained on, by the provenance of its
/// file: files with the same SHA-256, or seconds with the same rate to the 2e-6 deg/h that a log rounds to. Empty where
/// nothing shared is known: models of version 0.1 have no fingerprint.
std::string overlap_text(const std::string& provenance_json, const Recording& recording, const BlockTable& table);

}  // namespace prism::recordings
