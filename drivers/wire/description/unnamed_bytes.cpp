// SPDX-License-Identifier: MIT
#include "drivers/wire/description/unnamed_bytes.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace prism::wire {
namespace {

class NamedBytes {
 public:
  explicit NamedBytes(std::uint32_t length) : named_(length, false) {}

  /// Negative: from the end. `to` is excluded; at most 0: from the end.
  void add(int from, int to) {
    const int length = static_cast<int>(named_.size());
    const int first = std::clamp(from < 0 ? length + from : from, 0, length);
    const int last = std::clamp(to <= 0 ? length + to : to, first, length);
    std::fill(named_.begin() + first, named_.begin() + last, true);
  }
  void add_bytes(int at, int count) {
    const int first = at < 0 ? static_cast<int>(named_.size()) + at : at;
    add(first, first + count);
  }

  /// "5, 12 to 14"; empty if all are named.
  std::string others() const {
    std::vector<std::string> ranges;
    for (std::size_t i = 0; i < named_.size(); ++i) {
      if (named_[i]) continue;
      const std::size_t first = i;
      while (i + 1 < named_.size() && !named_[i + 1]) ++i;
      ranges.push_back(first == i ? fmt::format("{}", i) : fmt::format("{} to {}", first, i));
    }
    return fmt::format("{}", fmt::join(ranges, ", "));
  }

 private:
  std::vector<bool> named_;
};

std::string others_of(const MessageType& kind) {
  NamedBytes bytes(kind.length.max);
  for (const ByteRule& rule : kind.sync) bytes.add_bytes(static_cast<int>(rule.at), 1);
  for (const Field& field : kind.fields) bytes.add_bytes(field.at, field.size);
  for (const CheckRule& check : kind.checks) bytes.add_bytes(check.at, check.size);
  for (const BodyRule& rule : kind.body) bytes.add(rule.from, rule.to);
  return bytes.others();
}

}  // namespace

std::vector<std::string> unnamed_bytes(const FrameDescription& description) {
  std::vector<std::string> lines;
  for (const MessageType& kind : description.kinds) {
    if (kind.structure != Structure::kPlain || kind.length.min != kind.length.max) continue;
    const std::string others = others_of(kind);
    if (!others.empty())
      lines.push_back(
          fmt::format("message type {}: bytes {} belong to no sync, field, check or body", kind.name, others));
  }
  return lines;
}

}  // namespace prism::wire
