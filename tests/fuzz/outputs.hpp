// SPDX-License-Identifier: MIT
// Checks for the fuzzers of texts: a log with a fuzzed header goes through the reader, a report and the relay's batch;
// each output must be valid, without markup from the text.
#pragma once

#include <string>
#include <string_view>

#include "compensation/model.hpp"

namespace prism::test {

/// Aborts if `html` has an element that reports do not use, or an unquoted event attribute.
void require_plain_html(const std::string& html);
/// Aborts unless `text` is one printable line of UTF-8.
void require_printable_line(const std::string& text);

/// Passes a log of 300 seconds with this header ("# key: value\n" lines) through prismd's `rows`, the relay's batch for
/// PostgreSQL, prismcal's evaluation of `model`, and its report as HTML and JSON. Aborts if an output is invalid.
/// Returns false if the evaluation rejects the log.
bool through_report_and_batch(const std::string& header, const compensation::Model& model);

/// The published model that ships with prism.
const compensation::Model& shipped_model();

}  // namespace prism::test
