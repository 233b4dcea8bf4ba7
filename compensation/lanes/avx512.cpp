// SPDX-License-Identifier: MIT
// The inner loops compiled for AVX-512.
#include <cstddef>

namespace prism::lanes {
namespace {
constexpr std::size_t kLanes = 8, kRowVectors = 3, kColumns = 8;
}
}  // namespace prism::lanes

#include "compensation/lanes/lanes.inc"

namespace prism::lanes {
const Table kAvx512{kernel_sum, kernel_row, product, cholesky, forward, backward};
}  // namespace prism::lanes
