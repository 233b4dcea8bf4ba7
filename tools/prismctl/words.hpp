// SPDX-License-Identifier: MIT
// Single values of prismd's answers as words: what the answers in text and the live screen have alike.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/json_member.hpp"

namespace prism::prismctl {

/// A member, or null where the object has none or is none.
inline const nlohmann::json& at(const nlohmann::json& object, std::string_view key) { return member(object, key); }

/// The text, printable (escape.hpp), or `otherwise` if it is empty or no text. Every text of an answer that is shown
/// goes through here; names of members go through printable().
std::string text_of(const nlohmann::json& value, const std::string& otherwise = "-");

/// A number with `decimals`, or "-" where it is null; followed by its unit.
std::string value_text(const nlohmann::json& value, int decimals, const char* unit = "");

/// A count as it stands; "0" where it is missing.
std::string count_text(const nlohmann::json& value);

/// At most `max` bytes of a text, complete characters.
std::string first_bytes(const std::string& text, std::size_t max);

/// The integer part of a number, within ±9e15; `otherwise` if the value is no number.
std::int64_t integer_of(const nlohmann::json& value, std::int64_t otherwise = 0);

/// A span of time in the two units that tell: "0.4 s", "15 s", "2 min 5 s", "3 h 20 min", "4 d 2 h".
std::string span_text(double seconds);

/// "last data 0.4 s ago", or "no data yet" where `age_s` is null.
std::string age_text(const nlohmann::json& age_s);

/// The quality and what of it a person waits for: "warming (15 of 100 s)", "no_data (nothing is measured now)".
/// `answer` is one of status or bias.
std::string quality_words(const nlohmann::json& answer);

/// The same without the explanation: "no_data", "warming (15 of 100 s)".
std::string quality_with_progress(const nlohmann::json& answer);

/// Of the window that the long means are of, seconds.
int window_length_s(const nlohmann::json& answer);

/// How long the long mean of a status or bias is of: the window, or what of it is gathered. Seconds.
int mean_length_s(const nlohmann::json& answer);

/// What happened, and how often since it was last shown: "disk: …", "disk: … (3 more times)".
std::string event_text(const nlohmann::json& event);

/// "8.47111 ± 0.00700 deg/h"; "-" where there is no bias.
std::string bias_text(const nlohmann::json& row);

}  // namespace prism::prismctl
