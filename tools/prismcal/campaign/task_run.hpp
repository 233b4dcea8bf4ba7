// SPDX-License-Identifier: MIT
// One task from its inputs to its folder: what every engine calls, as often and wherever it likes.
#pragma once

#include "tools/prismcal/campaign/result_store.hpp"

namespace prism::campaign {

/// Checks that the inputs are those of the plan, does the work beside, and renames it into place: model.json, report/,
/// result.json, and times.json for what differs from run to run. Returns at once where the task stands. Refused, and
/// kept as a failure: inputs that changed since the plan, what the disk refuses, what Work::run refuses.
Result<void> run_task(const ResultStore& store, const Task& task, const Work& work);

}  // namespace prism::campaign
