// SPDX-License-Identifier: MIT
// How many bytes, frames, samples and rows the data of a run gave, stage by stage.
#pragma once

#include <string>

#include "daemon/pipeline/device.hpp"

namespace prism::daemon {

/// Returns one line per stage, with what was lost there; the stages after the samples by axis.
std::string funnel_text(const pipeline::Device& device);

}  // namespace prism::daemon
