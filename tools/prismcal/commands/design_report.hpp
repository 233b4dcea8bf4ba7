// SPDX-License-Identifier: MIT
// The plan of `prismcal design` as tables, figures and text.
#pragma once

#include "tools/prismcal/design/plan.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::commands {

/// `basis`: model or prior that the plan comes from, for the header.
report::Report design_report(const design::Plan& plan, const design::PlanSettings& settings, const std::string& basis);

}  // namespace prism::commands
