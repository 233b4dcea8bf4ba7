// SPDX-License-Identifier: MIT
// Events that the parts of the daemon report.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "base/problems.hpp"

namespace prism::pipeline {

enum class Severity { kDebug, kInfo, kWarning, kError };

/// `kind`: event type, a fixed word (line_open, line_lost, quality, …). `text`: one human-readable line. The receiver
/// adds the time.
using Tell = std::function<void(Severity severity, const std::string& kind, const std::string& text)>;

/// A problem's begin is a warning, its end is information.
inline Problems::Tell problems_as_events(Tell tell) {
  return [tell = std::move(tell)](bool begins, const std::string& kind, const std::string& text) {
    tell(begins ? Severity::kWarning : Severity::kInfo, kind, text);
  };
}

}  // namespace prism::pipeline
