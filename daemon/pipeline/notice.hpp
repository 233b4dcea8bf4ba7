// SPDX-License-Identifier: MIT
// How the parts of the daemon report what happened.
#pragma once

#include <functional>
#include <string>

namespace prism::pipeline {

enum class Severity { kDebug, kInfo, kWarning, kError };

/// `kind`: one word for programs (line_open, line_lost, quality, …); `text`: one line for people. The receiver adds the
/// time.
using Tell = std::function<void(Severity severity, const std::string& kind, const std::string& text)>;

}  // namespace prism::pipeline
