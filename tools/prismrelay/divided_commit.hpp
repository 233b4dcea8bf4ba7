// SPDX-License-Identifier: MIT
// Stores a batch in smaller transactions if the server refuses some of its data, so that a bad row affects only itself.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismrelay/batch.hpp"

namespace prism::prismrelay {

/// The refused records of one item.
struct Refusal {
  std::size_t rows = 0;   ///< stored in refused_rows
  std::string first;      ///< the first refused record and its reason: "row 17 of segment 3: …"
  std::string error;      ///< reason why the item's cursor is not stored; empty if it is
  bool too_many = false;  ///< ended after kMaxAttempts; `error` is set, and a smaller page may succeed
};

/// Attempts to divide one item, which limit the delay of the others. A page of 50 rows needs at most 106.
inline constexpr int kMaxAttempts = 200;

/// Stores `texts` in one transaction. Returns nothing if it is committed, or the reason if the server refused its data.
/// Errors: everything else, e.g. a lost connection.
using Transaction = std::function<Result<std::optional<std::string>>(const CopyTexts& texts)>;

/// Stores all items; one attempt if the server accepts them. Else divides the refused part in halves, first by items,
/// then by the records of an item: about 2·log2(n) attempts for each bad one of n records, at most kMaxAttempts. The
/// refused rows are stored in refused_rows together with the item's cursor. Returns the refusal of each item, empty for
/// most. Errors: those of `transaction`; then a part of the batch may be stored, which is harmless, because the keys
/// reject a second copy.
Result<std::vector<Refusal>> divided_commit(const Batch& batch, const Transaction& transaction);

}  // namespace prism::prismrelay
