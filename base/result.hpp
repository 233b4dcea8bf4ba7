// SPDX-License-Identifier: MIT
// Result of a function that can fail: a value or an error with its position.
#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "base/escape.hpp"

namespace prism {

/// An error in one line. `where` is its position (file:line, file:/json/pointer, device); `what` states what was found
/// and what was expected.
struct Error {
  std::string where;
  std::string what;

  /// One line that is safe on a terminal and in a log (printable()).
  std::string text() const { return printable(where.empty() ? what : where + ": " + what); }
};

template <class T>
using Result = tl::expected<T, Error>;

/// `return make_error(where, what);` from any function that returns a Result.
inline tl::unexpected<Error> make_error(std::string where, std::string what) {
  return tl::unexpected<Error>(Error{std::move(where), std::move(what)});
}

/// Moves the value to `to`, or returns the error: `if (auto failed = take(text, read_file(path))) return *failed;`.
template <class To, class From>
std::optional<tl::unexpected<Error>> take(To& to, Result<From>&& from) {
  if (!from) return tl::unexpected<Error>(std::move(from.error()));
  to = std::move(*from);
  return std::nullopt;
}

}  // namespace prism
