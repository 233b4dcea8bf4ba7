// SPDX-License-Identifier: MIT
// What an engineer asks of one model on one recording, as tables and figures.
#pragma once

#include "tools/prismcal/evaluation/judgement.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism {

/// One recording with what the model made of it. Pointers do not own.
struct Evidence {
  const BlockTable* table = nullptr;
  const Judgement* judgement = nullptr;
  const BlockTable* training = nullptr;          ///< null: not at hand; then the domain figure shows the box alone
  const std::vector<double>* weights = nullptr;  ///< v_k of the training blocks; null: not weighted
  std::string id;                                ///< prefix of all table and figure ids
};

/// Stability with mean, rms, peak-to-peak, floor, explained share; by segments; hysteresis; Allan coefficients before
/// and after; then the figures. What a recording does not carry (no ramps, too short for Allan) is said in a paragraph.
std::vector<report::Block> evidence_blocks(const Evidence& evidence);

}  // namespace prism
