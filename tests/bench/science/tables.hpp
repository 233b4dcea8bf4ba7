// SPDX-License-Identifier: MIT
// The two tables of docs/science.md, printed as Markdown.
#pragma once

#include <cstdint>
#include <string>

namespace prism::science {

/// Seeds first_seed, first_seed + 10, …: `count` gyros a truth. Returns the exit code, as real() does.
int simulated(std::uint64_t first_seed, int count);

/// The splits of a real chamber recording (three axes), by branches of its temperature and by thirds.
int real(const std::string& path);

}  // namespace prism::science
