// SPDX-License-Identifier: MIT
// The method `range`: series for charts, in seconds, minutes or hours by length of the view.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "base/result.hpp"
#include "tools/prismweb/axis_archive.hpp"
#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

struct RangeQuery {
  std::optional<double> from_s, to_s;
  double seconds = 3600;  ///< used without from_s
  int points = 1000;
};

/// Errors: a param of another type or outside its range.
Result<RangeQuery> parse_range(const nlohmann::json& params);

void answer_range(InstanceProxy& proxy, AxisArchive& axis, const RangeQuery& query,
                  const InstanceProxy::Answer& answer);

}  // namespace prism::prismweb
