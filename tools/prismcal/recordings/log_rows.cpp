// SPDX-License-Identifier: MIT
// The rows of a log segment: read in pieces, parsed on all cores, taken in order.
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/log_lines.hpp"
#include "tools/prismcal/recordings/ordered_jobs.hpp"
#include "tools/prismcal/tables/read_meter.hpp"

namespace prism::recordings {
namespace {

constexpr std::size_t kPieceBytes = 1u << 19;

/// Complete lines of a file.
struct Piece {
  std::vector<char> bytes;
  std::size_t first = 0, size = 0;  ///< of the bytes that are the lines
  std::size_t begin = 0;            ///< offset of the first line in the file
  Sha256 before;                    ///< hash of all bytes before it

  std::string_view text() const { return std::string_view(bytes.data(), size).substr(first); }
};

/// A line that is not a readable row.
struct OddLine {
  enum class Type { kComment, kDamaged, kEnd };
  Type type = Type::kComment;
  std::size_t rows_before = 0;  ///< readable rows of the piece before it
  std::size_t line = 0, begin = 0, next_begin = 0;
  std::string text;  ///< why it is damaged; of the end line, all after the mark
};

/// Lines are counted from the start of the piece. Its memory is used again.
struct ParsedPiece {
  Piece piece;
  std::vector<LogRow> rows;
  std::vector<OddLine> odd;
  std::size_t lines = 0;
};

void parse(ParsedPiece& parsed, const LogRowLayout& layout) {
  const Piece& piece = parsed.piece;
  parsed.rows.clear();
  parsed.odd.clear();
  parsed.rows.reserve(piece.size / 100);
  LogLines lines(piece.text());
  while (lines.next()) {
    const std::string_view line = lines.line();
    const auto odd = [&](OddLine::Type type, std::string text) {
      parsed.odd.push_back({type, parsed.rows.size(), lines.number(), piece.begin + lines.begin(),
                            piece.begin + lines.next_begin(), std::move(text)});
    };
    if (line.starts_with(kLogEndMark)) {
      odd(OddLine::Type::kEnd, std::string(line.substr(kLogEndMark.size())));
    } else if (line.empty() || line.front() == '#') {
      odd(OddLine::Type::kComment, "");
    } else if (auto row = parse_log_row(line, layout)) {
      row->line = lines.number();
      parsed.rows.push_back(std::move(*row));
    } else {
      odd(OddLine::Type::kDamaged, std::move(row.error().what));
    }
  }
  parsed.lines = lines.number();
}

/// Reads a file in pieces that end with a line, and hashes it.
class PieceReader {
 public:
  PieceReader(FileReader in, tables::ReadMeter& meter) : in_(std::move(in)), meter_(meter) {}

  /// The next lines; the first piece has at least `least` bytes. Returns false if no complete line is left.
  bool next(Piece& piece, std::size_t least) {
    std::size_t filled = rest_.size(), end = std::string::npos;
    piece.bytes.resize(std::max(piece.bytes.size(), filled + kPieceBytes));
    std::copy(rest_.begin(), rest_.end(), piece.bytes.begin());
    while (end == std::string::npos || end + 1 < least) {
      piece.bytes.resize(std::max(piece.bytes.size(), filled + kPieceBytes));
      const std::size_t got = in_.read(std::span(piece.bytes).subspan(filled, kPieceBytes));
      filled += got;
      meter_.add_bytes(got);
      if (got == 0) break;
      end = std::string_view(piece.bytes.data(), filled).rfind('\n');
    }
    piece.first = 0;
    piece.size = end == std::string::npos ? 0 : end + 1;
    rest_.assign(piece.bytes.data() + piece.size, filled - piece.size);
    if (piece.size == 0) return false;
    piece.begin = begin_;
    piece.before = hash_;
    hash_.add(piece.text());
    begin_ += piece.size;
    return true;
  }
  /// Hashes all bytes that are left.
  void finish() {
    for (Piece piece; next(piece, 0);) continue;
    hash_.add(rest_);
    begin_ += rest_.size();
    rest_.clear();
  }
  std::size_t bytes() const { return begin_; }  ///< in all pieces, and after finish() in the file
  std::string sha256() const { return hash_.hex(); }
  const std::optional<Error>& error() const { return in_.error(); }

 private:
  FileReader in_;
  tables::ReadMeter& meter_;
  std::string rest_;
  Sha256 hash_;
  std::size_t begin_ = 0;
};

/// Takes the parsed pieces in order, and finds where the good rows end.
class SegmentReader {
 public:
  SegmentReader(LogSegment& segment, const std::function<Result<void>(LogRow&)>& on_row)
      : segment_(segment),
        on_row_(on_row),
        good_(segment.layout->head_bytes),
        good_lines_(segment.layout->head_lines),
        lines_before_(segment.layout->head_lines) {}

  Result<void> take(ParsedPiece& parsed) {
    std::size_t row = 0;
    for (OddLine& odd : parsed.odd) {
      odd.line += lines_before_;
      if (auto done = take_rows(parsed, row, odd.rows_before, odd.begin, odd.line - 1); !done) return done;
      row = odd.rows_before;
      if (odd.type == OddLine::Type::kDamaged) {
        ++number_;
        unreadable_.push_back({segment_.path, odd.line, std::move(odd.text)});
        continue;
      }
      if (odd.type == OddLine::Type::kEnd) {
        Sha256 hash = parsed.piece.before;
        hash.add(parsed.piece.text().substr(0, odd.begin - parsed.piece.begin));
        const bool equal = odd.text == fmt::format("rows {}, sha256 {}", number_, hash.hex());
        segment_.end = equal ? SegmentEnd::kIntact : SegmentEnd::kChanged;
        ended_ = true;
      } else if (!unreadable_.empty()) {
        continue;
      }
      good_until(odd.next_begin, odd.line);
      if (ended_) return {};
    }
    auto done = take_rows(parsed, row, parsed.rows.size(), parsed.piece.begin + parsed.piece.text().size(),
                          lines_before_ + parsed.lines);
    lines_before_ += parsed.lines;
    return done;
  }
  bool ended() const { return ended_; }

  void finish(bool open, std::size_t bytes, const std::optional<Error>& error) {
    // After a read error of the disk, the rows before it are kept; the rest is damage.
    if (error) segment_.damaged.push_back({segment_.path, good_lines_ + 1, error->what});
    segment_.read_failed = error.has_value();
    if (ended_ && (!segment_.damaged.empty() || good_ < bytes)) segment_.end = SegmentEnd::kChanged;
    segment_.truncated_bytes = bytes - good_;
    segment_.truncated_line = segment_.truncated_bytes > 0 ? good_lines_ + 1 : 0;
    if (!ended_ && (segment_.format > 1 || segment_.truncated_bytes > 0))
      segment_.end = open ? SegmentEnd::kOpen : SegmentEnd::kTruncated;
  }

 private:
  Result<void> take_rows(ParsedPiece& parsed, std::size_t from, std::size_t to, std::size_t next_begin,
                         std::size_t line) {
    if (from == to) return {};
    good_until(next_begin, line);
    segment_.rows += to - from;
    for (; from < to; ++from) {
      parsed.rows[from].number = ++number_;
      parsed.rows[from].line += lines_before_;
      if (!on_row_) continue;
      if (auto done = on_row_(parsed.rows[from]); !done) return done;
    }
    return {};
  }

  /// A good line follows the unreadable ones: they are damage, not the end.
  void good_until(std::size_t next_begin, std::size_t line) {
    segment_.damaged.insert(segment_.damaged.end(), std::make_move_iterator(unreadable_.begin()),
                            std::make_move_iterator(unreadable_.end()));
    unreadable_.clear();
    good_ = next_begin;
    good_lines_ = line;
  }

  LogSegment& segment_;
  const std::function<Result<void>(LogRow&)>& on_row_;
  std::size_t good_, good_lines_;       ///< end of the last good line
  std::size_t lines_before_;            ///< lines of the file before the piece
  std::size_t number_ = 0;              ///< rows so far, also damaged ones
  std::vector<LeftOutRow> unreadable_;  ///< damage if a row or the end follows, else the truncated end
  bool ended_ = false;
};

}  // namespace

Result<LogRow> parse_log_row(std::string_view line, const LogRowLayout& layout) {
  auto row = compensation::parse_csv(line, {}, layout.columns);
  if (!row) return tl::unexpected<Error>(std::move(row.error()));
  LogRow log_row{std::move(row->window.second_mean), kUnknown, 0, 0};
  if (layout.column) {
    const std::string_view field = csv_field(line, ',', *layout.column).value_or("");
    const auto value = field.empty() ? std::optional(kUnknown) : csv_number(field);
    if (!value) return make_error("", fmt::format("found \"{}\", expected a number", field));
    log_row.value = *value;
  }
  return log_row;
}

Result<void> read_log_rows(LogSegment& segment, const std::function<Result<void>(LogRow& row)>& on_row,
                           tables::ReadMeter& meter) {
  const bool open =
      is_locked(segment.path);  // checked before reading: a segment that ends meanwhile is read to its end
  auto in = FileReader::open(segment.path);
  if (!in) {
    segment.damaged.push_back({segment.path, 0, in.error().what});
    segment.read_failed = true;
    return {};
  }
  PieceReader reader(std::move(*in), meter);
  if (!segment.layout) {
    reader.finish();
    segment.sha256 = reader.sha256();
    segment.end = open ? SegmentEnd::kOpen : SegmentEnd::kTruncated;
    segment.truncated_bytes = reader.bytes();
    segment.truncated_line = 1;
    return {};
  }
  const LogRowLayout& layout = *segment.layout;
  SegmentReader rows(segment, on_row);
  OrderedJobs<ParsedPiece> jobs;
  std::vector<ParsedPiece> spare;
  bool left = true;
  for (std::size_t head = layout.head_bytes; left || !jobs.empty();) {
    if (left && !jobs.full()) {
      ParsedPiece parsed = spare.empty() ? ParsedPiece() : std::move(spare.back());
      if (!spare.empty()) spare.pop_back();
      left = reader.next(parsed.piece, head);
      if (!left) continue;
      if (head > 0) {
        parsed.piece.before.add(parsed.piece.text().substr(0, head));
        parsed.piece.first = parsed.piece.begin = head;
        head = 0;
      }
      jobs.start([&layout, parsed = std::move(parsed)]() mutable {
        parse(parsed, layout);
        return std::move(parsed);
      });
      continue;
    }
    if (jobs.empty()) continue;
    ParsedPiece parsed = jobs.take();
    if (rows.ended()) continue;
    const std::size_t before = segment.rows;
    if (auto done = rows.take(parsed); !done) return done;
    meter.add_rows(segment.rows - before);
    if (rows.ended()) left = false;
    spare.push_back(std::move(parsed));
  }
  reader.finish();
  segment.sha256 = reader.sha256();
  rows.finish(open, reader.bytes(), reader.error());
  return {};
}

}  // namespace prism::recordings
