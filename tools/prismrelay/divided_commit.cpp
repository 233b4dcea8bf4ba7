// SPDX-License-Identifier: MIT
#include "tools/prismrelay/divided_commit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/escape.hpp"

namespace prism::prismrelay {
namespace {

class DividedCommit {
 public:
  DividedCommit(const Batch& batch, const Transaction& transaction)
      : batch_(batch), transaction_(transaction), refusals_(batch.items().size()) {}

  Result<void> store_items(std::size_t first, std::size_t last) {
    const auto refused = transaction_(batch_.texts(first, last));
    if (!refused) return tl::unexpected<Error>(refused.error());
    if (!*refused) return {};
    if (last - first == 1) return store_item(first, **refused);
    const std::size_t middle = first + (last - first) / 2;
    if (auto done = store_items(first, middle); !done) return done;
    return store_items(middle, last);
  }

  std::vector<Refusal> refusals() && { return std::move(refusals_); }

 private:
  struct RefusedRecord {
    const Record* record;
    std::string reason;
  };

  // Stores the records that the server accepts, then the cursor with the refused ones.
  Result<void> store_item(std::size_t index, const std::string& reason) {
    const BatchItem& item = batch_.items()[index];
    std::vector<RefusedRecord> refused;
    attempts_left_ = kMaxAttempts;
    if (item.records.size() == 1) {
      refused.push_back({&item.records.front(), reason});
    } else if (!item.records.empty()) {
      const std::size_t middle = item.records.size() / 2;
      if (auto done = store_records(item, 0, middle, refused); !done) return done;
      if (auto done = store_records(item, middle, item.records.size(), refused); !done) return done;
    }
    Refusal& refusal = refusals_[index];
    report(refusal, refused);
    if (attempts_left_ < 0) {
      refusal.too_many = true;
      refusal.error = "too many refused rows in a page";
    }
    if (item.cursor.empty() || refusal.too_many) return {};
    const auto rejected = transaction_(cursor_texts(item, refused));
    if (!rejected) return tl::unexpected<Error>(rejected.error());
    if (*rejected) refusal.error = **rejected;
    return {};
  }

  Result<void> store_records(const BatchItem& item, std::size_t first, std::size_t last,
                             std::vector<RefusedRecord>& refused) {
    if (attempts_left_ < 0 || --attempts_left_ < 0) return {};
    CopyTexts texts;
    for (std::size_t i = first; i < last; ++i)
      texts[static_cast<std::size_t>(item.records[i].table)] += item.csv_of(item.records[i]);
    const auto rejected = transaction_(texts);
    if (!rejected) return tl::unexpected<Error>(rejected.error());
    if (!*rejected) return {};
    if (last - first == 1) {
      refused.push_back({&item.records[first], **rejected});
      return {};
    }
    const std::size_t middle = first + (last - first) / 2;
    if (auto done = store_records(item, first, middle, refused); !done) return done;
    return store_records(item, middle, last, refused);
  }

  static CopyTexts cursor_texts(const BatchItem& item, const std::vector<RefusedRecord>& refused) {
    CopyTexts texts;
    for (const auto& [record, reason] : refused) {
      if (record->table == Table::kRows || record->table == Table::kSegments)
        append_refused(texts, item, *record, reason);
    }
    std::vector<const Record*> stored;
    for (const Record& record : item.records) {
      const auto is_same = [&](const RefusedRecord& other) { return other.record == &record; };
      if (record.table == Table::kRows && std::none_of(refused.begin(), refused.end(), is_same))
        stored.push_back(&record);
    }
    append_place(texts, item, stored);
    return texts;
  }

  static void report(Refusal& refusal, const std::vector<RefusedRecord>& refused) {
    for (const auto& [record, reason] : refused) {
      if (record->table == Table::kRows) ++refusal.rows;
    }
    if (refused.empty()) return;
    const Record& first = *refused.front().record;
    const std::string what = first.table == Table::kRows ? fmt::format("row {} of segment {}", first.row, first.segment)
                             : first.table == Table::kSegments ? fmt::format("metadata of segment {}", first.segment)
                             : first.table == Table::kEvents   ? std::string("an event")
                             : first.table == Table::kGaps     ? std::string("a gap")
                                                               : std::string("an invalid row");
    refusal.first = fmt::format("{}: {}", what, shortened(refused.front().reason, 300));
  }

  const Batch& batch_;
  const Transaction& transaction_;
  std::vector<Refusal> refusals_;
  int attempts_left_ = 0;  ///< of the current item; below 0: exceeded
};

}  // namespace

Result<std::vector<Refusal>> divided_commit(const Batch& batch, const Transaction& transaction) {
  DividedCommit commit(batch, transaction);
  if (!batch.empty()) {
    if (const auto done = commit.store_items(0, batch.items().size()); !done)
      return tl::unexpected<Error>(done.error());
  }
  return std::move(commit).refusals();
}

}  // namespace prism::prismrelay
