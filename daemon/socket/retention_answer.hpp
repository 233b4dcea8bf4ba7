// SPDX-License-Identifier: MIT
// The object `retention` of `status`: limits, deletions so far, and the next one.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "daemon/pipeline/retention_status.hpp"

namespace prism::socket {

/// `next` is null if there is no segment to delete; its `in_s` and `time_s` (host time) are null while a consumer holds
/// the segment without a limit.
nlohmann::ordered_json retention_json(const pipeline::RetentionStatus& status);

}  // namespace prism::socket
