// SPDX-License-Identifier: MIT
// Events that the parts of the daemon report.
#pragma once

#include <functional>
#include <string>

namespace prism::pipeline {

enum class Severity { kDebug, kInfo, kWarning, kError };

/// `kind`: event type, a fixed word (line_open, line_lost, quality, …). `text`: one human-readable line. The receiver
/// adds the time.
using Tell = std::function<void(Severity severity, const std::string& kind, const std::string& text)>;

}  // namespace prism::pipeline
