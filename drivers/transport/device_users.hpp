// SPDX-License-Identifier: MIT
// Other programs that have a device open: they may read its data.
#pragma once

#include <string>

namespace prism::transport {

/// "cat (pid 4711), minicom (pid 4712)": at most 3 programs, from /proc as far as it can be read; empty: none is known.
/// `device` may be a symbolic link.
std::string other_users_of(const std::string& device);

}  // namespace prism::transport
