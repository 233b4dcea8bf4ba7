// SPDX-License-Identifier: MIT
// Merges the reports of several axes of one device.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// `axes`: name and report of each axis, at least one. Takes title, tool and warning of the first. Facts that all axes
/// share are in the header, the others in a table at the end of the first section of their axis. `overview` is the
/// first section, then the sections of all axes follow. Ids are prefixed with the number of the axis, titles with its
/// name.
Report merged(std::vector<std::pair<std::string, Report>> axes, Section overview);

/// Id of a section of an axis in the merged report. `number`: axis, from 1.
std::string id_of_axis(std::size_t number, const std::string& id);

}  // namespace prism::report
