// SPDX-License-Identifier: MIT
// What fuzzers of texts share: a log with a fuzzed header goes through the reader, a report and the relay's batch, and
// each output must be valid and free of the text's own markup.
#pragma once

#include <string>
#include <string_view>

#include "compensation/model.hpp"

namespace prism::test {

/// Aborts if `html` has an element or attribute that reports do not have.
void require_plain_html(const std::string& html);
/// Aborts unless `text` is one printable line of UTF-8.
void require_printable_line(const std::string& text);

/// A log of 300 seconds with this header ("# key: value\n" lines) through prismcal's reader, the evaluation of `model`,
/// a report in all its forms, prismd's `rows` and the relay's batch for PostgreSQL. Returns false if the reader rejects
/// it.
bool through_report_and_batch(const std::string& header, const compensation::Model& model);

/// The published model that ships with prism.
const compensation::Model& shipped_model();

}  // namespace prism::test
