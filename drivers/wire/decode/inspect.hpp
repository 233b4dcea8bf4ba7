// SPDX-License-Identifier: MIT
// Every named value of one frame: for test vectors, and for people who look at a capture.
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
    double value = 0;  ///< kUnknown: in the frame, but out of range or no number
  };
  std::int32_t kind = -1;
  std::string kind_name;
  std::uint32_t length = 0;
  std::vector<Value> values;  ///< of the fields that the frame carries, in the description's order
};

/// The frame that begins with the first byte; nothing where no kind fits there, or where it goes on behind the last.
std::optional<InspectedFrame> inspect_frame(const FrameDescription& description, std::span<const std::uint8_t> bytes);

/// Decodes every test vector of the description; the first that does not give what it states is the refusal.
Result<void> run_test_vectors(const FrameDescription& description);

}  // namespace prism::wire
