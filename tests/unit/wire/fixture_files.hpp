// SPDX-License-Identifier: MIT
// Reads captured and printed bytes, and names the values of their frames.
#pragma once

#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::test {

using Bytes = std::vector<std::uint8_t>;

/// Frames that a manual prints, or that were made from documents, are in the source tree; recorded bytes are shared
/// data.
inline std::filesystem::path frames_file(const std::string& file) {
  const auto here = std::filesystem::path(PRISM_SOURCE_DIR) / "tests" / "unit" / "wire" / "data" / file;
  return std::filesystem::exists(here) ? here : shared_dir() / "frames" / file;
}

inline Bytes bytes_of(const std::string& file) {
  const std::string text = read_file(frames_file(file));
  return {text.begin(), text.end()};
}

/// The frames of a .hex file by their names, in order.
inline std::vector<std::pair<std::string, Bytes>> hex_frames(const std::string& file) {
  std::istringstream in(read_file(frames_file(file)));
  std::vector<std::pair<std::string, Bytes>> frames;
  for (std::string line; std::getline(in, line);) {
    if (const auto at = line.find("# frame: "); at != std::string::npos) {
      std::istringstream words(line.substr(at + 9));
      words >> frames.emplace_back().first;
    } else if (!line.empty() && line[0] != '#') {
      std::istringstream words(line);
      for (std::string word; words >> word;)
        frames.back().second.push_back(static_cast<std::uint8_t>(std::stoi(word, nullptr, 16)));
    }
  }
  return frames;
}

inline std::map<std::string, double> values_of(const wire::FrameDescriptionPtr& description,
                                               std::span<const std::uint8_t> bytes) {
  std::map<std::string, double> values;
  if (const auto frame = wire::inspect_frame(*description, bytes)) {
    values["length"] = frame->length;
    for (const auto& value : frame->values) values[value.field] = value.value;
  }
  return values;
}

/// All consecutive frames of a stream; stops at the first other byte.
inline std::vector<std::map<std::string, double>> walk(const wire::FrameDescriptionPtr& description,
                                                       const Bytes& bytes) {
  std::vector<std::map<std::string, double>> frames;
  for (std::size_t at = 0; at < bytes.size();) {
    auto values = values_of(description, std::span(bytes).subspan(at));
    if (values.empty()) break;
    at += static_cast<std::size_t>(values["length"]);
    frames.push_back(std::move(values));
  }
  return frames;
}

}  // namespace prism::test
