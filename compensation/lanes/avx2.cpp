// SPDX-License-Identifier: MIT
// The inner loops compiled for AVX2 with FMA.
#include <cstddef>

namespace prism::lanes {
namespace {
constexpr std::size_t kLanes = 4, kRowVectors = 3, kColumns = 4;
}
}  // namespace prism::lanes

#include "compensation/lanes/lanes.inc"

namespace prism::lanes {
const Table kAvx2{kernel_sum, kernel_row, product, cholesky, forward, backward};
}  // namespace prism::lanes
