// SPDX-License-Identifier: MIT
// Series for charts: of seconds, minutes or hours, whichever the view needs.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "base/result.hpp"
#include "tools/prismweb/axis_archive.hpp"
#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

struct RangeQuery {
  std::optional<double> from_s, to_s;
  double seconds = 3600;  ///< where from_s is not given
  int points = 1000;
};

/// Refused where a param is of another type or beyond its range.
Result<RangeQuery> parse_range(const nlohmann::json& params);

void answer_range(InstanceProxy& proxy, AxisArchive& axis, const RangeQuery& query,
                  const InstanceProxy::Answer& answer);

}  // namespace prism::prismweb
