// SPDX-License-Identifier: MIT
// The inner loops compiled for the baseline of the architecture.
#include <cstddef>

namespace prism::lanes {
namespace {
constexpr std::size_t kLanes = 2, kRowVectors = 2, kColumns = 4;
}
}  // namespace prism::lanes

#include "compensation/lanes/lanes.inc"

namespace prism::lanes {
const Table kBaseline{kernel_sum, kernel_row, product, cholesky, forward, backward};
}  // namespace prism::lanes
