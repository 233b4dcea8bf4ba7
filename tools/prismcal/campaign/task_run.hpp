// SPDX-License-Identifier: MIT
// Runs one task of a campaign. Running a task twice is harmless.
#pragma once

#include "tools/prismcal/campaign/result_store.hpp"

namespace prism::campaign {

/// Checks that the inputs are unchanged since the plan, runs Work::run in a temporary directory and renames it into
/// place: task.json, result.json, times.json and the files of Work::run. Returns at once if the task has a result.
/// Errors, also recorded with add_failure(): changed inputs, another version of prismcal, I/O errors, errors of
/// Work::run.
Result<void> run_task(const ResultStore& store, const Task& task, const Work& work);

}  // namespace prism::campaign
