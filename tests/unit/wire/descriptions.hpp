// SPDX-License-Identifier: MIT
// Loads shipped frame descriptions for the tests of the wire.
#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/wire/decode/frame_decoder.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::test {

inline std::filesystem::path frames_dir() { return std::filesystem::path(PRISM_SOURCE_DIR) / "config" / "frames"; }

inline wire::FrameDescriptionPtr description_of(const std::string& text, const wire::GyroChoice& choice = {}) {
  auto parsed = wire::parse_frame_description(text, "test.json", choice);
  if (!parsed) throw std::runtime_error(parsed.error().text());
  return *parsed;
}

/// Descriptions for tests only: features that no shipped one has.
inline std::filesystem::path described_dir() {
  return std::filesystem::path(PRISM_SOURCE_DIR) / "tests" / "replay" / "frames" / "described";
}

/// A shipped description by its name ("trplg"), or one for tests.
inline wire::FrameDescriptionPtr shipped(const std::string& name, const wire::GyroChoice& choice = {}) {
  auto path = frames_dir() / (name + ".json");
  if (!std::filesystem::exists(path)) path = described_dir() / (name + ".json");
  auto parsed = wire::parse_frame_description(read_file(path), path.filename().string(), choice);
  if (!parsed) throw std::runtime_error(parsed.error().text());
  return *parsed;
}

/// Names of the shipped descriptions with a gyro.
inline std::vector<std::string> shipped_gyros() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(frames_dir())) {
    if (entry.path().extension() != ".json" || entry.path().stem() == "frame.schema") continue;
    if (shipped(entry.path().stem())->carries_gyro()) names.push_back(entry.path().stem());
  }
  return names;
}

/// Names of the descriptions for tests.
inline std::vector<std::string> described() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(described_dir())) names.push_back(entry.path().stem());
  return names;
}

/// All readings of a byte stream fed at once, with finish().
inline std::vector<wire::DecodedMessage> decode(const wire::FrameDescriptionPtr& description,
                                                const std::vector<std::uint8_t>& bytes) {
  wire::FrameDecoder decoder(description);
  std::vector<wire::DecodedMessage> readings;
  decoder.feed(bytes, 0, readings);
  decoder.finish(readings);
  return readings;
}

}  // namespace prism::test
