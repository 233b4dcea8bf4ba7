// SPDX-License-Identifier: MIT
// Loads shipped frame descriptions for the tests of the wire.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
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

/// One byte in a thousand is flipped, dropped or followed by another.
enum class Damage { kFlip, kDrop, kInsert };
inline constexpr Damage kDamages[] = {Damage::kFlip, Damage::kDrop, Damage::kInsert};

/// A frame of a stream.
struct Part {
  std::uint64_t offset = 0, length = 0;
};

/// The stream after damage, and the offsets of the frames that it did not touch.
struct Damaged {
  std::vector<std::uint8_t> bytes;
  std::vector<std::uint64_t> intact;
};

inline Damaged damage(const std::vector<std::uint8_t>& good, const std::vector<Part>& frames, Damage what,
                      unsigned seed = 99) {
  std::mt19937 random(seed);
  Damaged result;
  std::vector<std::uint64_t> new_offset(good.size() + 1);
  std::vector<bool> hit(good.size(), false);
  for (std::size_t i = 0; i < good.size(); ++i) {
    // Of two equal bytes the dropped one is unknown, and so is the damaged frame.
    const bool twin = i + 1 < good.size() && good[i] == good[i + 1];
    hit[i] = random() % 1000 == 0 && !(what == Damage::kDrop && twin);
    new_offset[i] = result.bytes.size();
    if (hit[i] && what == Damage::kDrop) continue;
    result.bytes.push_back(hit[i] && what == Damage::kFlip ? static_cast<std::uint8_t>(good[i] ^ (1 + random() % 255))
                                                           : good[i]);
    if (hit[i] && what == Damage::kInsert) result.bytes.push_back(static_cast<std::uint8_t>(random()));
  }
  for (const Part& frame : frames) {
    bool touched = false;
    for (std::uint64_t i = frame.offset; i < frame.offset + frame.length; ++i) {
      const bool behind_the_end = what == Damage::kInsert && i + 1 == frame.offset + frame.length;
      touched = touched || (hit[i] && !behind_the_end);
    }
    if (!touched) result.intact.push_back(new_offset[frame.offset]);
  }
  return result;
}

/// How many intact frames the decoder does not find after damage, and how many it finds.
inline std::pair<std::size_t, std::size_t> lost_frames(const wire::FrameDescriptionPtr& description,
                                                       const std::vector<std::uint8_t>& good,
                                                       const std::vector<Part>& frames, Damage what) {
  const Damaged damaged = damage(good, frames, what);
  std::set<std::uint64_t> found;
  for (const wire::DecodedMessage& reading : decode(description, damaged.bytes)) found.insert(reading.offset);
  const auto seen = static_cast<std::size_t>(std::count_if(damaged.intact.begin(), damaged.intact.end(),
                                                           [&](std::uint64_t at) { return found.contains(at); }));
  return {damaged.intact.size() - seen, seen};
}

}  // namespace prism::test
