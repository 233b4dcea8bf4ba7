// SPDX-License-Identifier: MIT
#include "base/result.hpp"

#include "base/escape.hpp"

namespace prism {

std::string Error::text() const { return printable(where.empty() ? what : where + ": " + what); }

}  // namespace prism
