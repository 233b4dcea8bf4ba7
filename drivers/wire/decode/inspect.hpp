// SPDX-License-Identifier: MIT
// Every named value of one frame: for test vectors and for inspection of captures.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/wire/description/frame_description.hpp"

namespace prism::wire {

struct InspectedFrame {
  struct Value {
    std::string field;
    std::string unit;
    double value = 0;  ///< kUnknown: in the frame, but out of range or not a number
  };
  std::int32_t kind = -1;
  std::string kind_name;
  std::uint32_t length = 0;
  std::vector<Value> values;  ///< of the fields in the frame, in the description's order
};

/// The frame that starts with the first byte; nullopt if no message type matches or the frame is incomplete.
std::optional<InspectedFrame> inspect_frame(const FrameDescription& description, std::span<const std::uint8_t> bytes);

/// Decodes every test vector of the description. Errors: the first vector with a different result.
Result<void> run_test_vectors(const FrameDescription& description);

/// "frames trplg, 3 test vectors hold"; without vectors, that nothing is proved.
std::string proof_text(const FrameDescription& description);

}  // namespace prism::wire
