// SPDX-License-Identifier: MIT
// The report of a campaign: every gyro with every model, accepted or not and by which limit, and the lot as a whole.
#pragma once

#include "tools/prismcal/campaign/task_result.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::campaign {

/// `previous`: the lot of an earlier campaign, or null. Links lead from FOLDER/report/report.html to the tasks' pages.
report::Report lot_report(const CampaignFile& file, const Lot& lot, const Lot* previous);

}  // namespace prism::campaign
