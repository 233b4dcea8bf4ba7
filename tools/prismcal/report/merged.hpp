// SPDX-License-Identifier: MIT
// Reports of several axes of one device as one report.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// Each axis's name and report, in order; at least one. Title, tool and warning are the first one's; facts that all
/// have alike stand on top, others at the end of their axis's first section; `overview` stands in front, and then every
/// axis's sections. Their ids, and those of what is in them, begin with the number of the axis; their titles begin with
/// its name.
Report merged(std::vector<std::pair<std::string, Report>> axes, Section overview);

/// The id of a section of an axis within the merged report. `number`: of the axis, from 1.
std::string id_of_axis(std::size_t number, const std::string& id);

}  // namespace prism::report
