// SPDX-License-Identifier: MIT
// Reports of several axes of one device as one report.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// Each axis's name and report, in order; at least one. Title, tool and warning are the first one's; facts that all
/// have alike stand on top, others at the end of their axis's first section; `overview` stands in front, and then every
/// axis's sections, whose ids and those of what is in them begin with the axis.
Report merged(std::vector<std::pair<std::string, Report>> axes, Section overview);

/// The id of an axis's section within the merged report.
std::string id_of_axis(const std::string& axis, const std::string& id);

}  // namespace prism::report
