// SPDX-License-Identifier: MIT
// Creates the report of a campaign: each gyro with each model and its violated limits, and statistics of the lot.
#pragma once

#include "tools/prismcal/campaign/task_result.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::campaign {

/// `previous`: the lot of an earlier campaign, or null. Links to tasks' pages are relative to FOLDER/report.
report::Report lot_report(const CampaignFile& file, const Lot& lot, const Lot* previous);

}  // namespace prism::campaign
