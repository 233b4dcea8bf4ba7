// SPDX-License-Identifier: MIT
// The rows of a log segment: read in pieces, parsed on all cores, taken in order.
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <deque>
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
#include "tools/prismcal/recordings/log_pieces.hpp"
#include "tools/prismcal/recordings/ordered_jobs.hpp"
#include "tools/prismcal/tables/read_meter.hpp"

namespace prism::recordings {
namespace {

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
  LogRowParser parser(layout);
  LogLines lines(piece.text());
  while (lines.next()) {
    const std::string_view line = lines.line();
    const auto odd = [&](OddLine::Type type, std::string text) {
      parsed.odd.push_back({type, parsed.rows.size(), lines.number(), piece.begin + lines.begin(),
                            piece.begin + lines.next_begin(), std::move(text)});
    };
    if (line.empty() || line.front() == '#') {
      if (line.starts_with(kLogEndMark))
        odd(OddLine::Type::kEnd, std::string(line.substr(kLogEndMark.size())));
      else
        odd(OddLine::Type::kComment, "");
    } else if (auto good = parser.parse(line)) {
      parsed.rows.push_back({parser.second_mean(), parser.value(), lines.number(), 0});
    } else {
      odd(OddLine::Type::kDamaged, std::move(good.error().what));
    }
  }
  parsed.lines = lines.number();
}

/// Takes the parsed pieces in order, and finds where the good rows end.
class SegmentReader {
 public:
  SegmentReader(LogSegment& segment, const OnSegmentRow& on_row)
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
  const OnSegmentRow& on_row_;
  std::size_t good_, good_lines_;       ///< end of the last good line
  std::size_t lines_before_;            ///< lines of the file before the piece
  std::size_t number_ = 0;              ///< rows so far, also damaged ones
  std::vector<LeftOutRow> unreadable_;  ///< damage if a row or the end follows, else the truncated end
  bool ended_ = false;
};

/// A segment whose pieces are read.
struct OpenSegment {
  LogSegment* segment = nullptr;
  bool locked = false;               ///< checked before reading: a segment that ends meanwhile is read to its end
  std::optional<PieceReader> bytes;  ///< nullopt: the file cannot be opened
  FileHash hash;
  std::size_t head = 0;     ///< bytes before the first row, if they are not read
  std::size_t running = 0;  ///< pieces that are being parsed
  bool all_read = false;
};

/// Reads the pieces of all segments in order, also those of the next segments while the last ones of a segment are
/// parsed, and takes their rows in order.
class SegmentQueue {
 public:
  SegmentQueue(std::span<LogSegment> segments, const SegmentVisitor& visitor, tables::ReadMeter& meter)
      : segments_(segments), visitor_(visitor), meter_(meter) {}

  Result<void> read() {
    for (LogSegment& segment : segments_) {
      if (visitor_.begin) visitor_.begin(segment);
      if (auto done = read(segment); !done) return done;
      if (!visitor_.end) continue;
      if (auto done = visitor_.end(segment); !done) return done;
    }
    return {};
  }

 private:
  static constexpr std::size_t kMostOpen = 8;

  Result<void> read(LogSegment& segment) {
    if (opened_.empty()) open_next();
    OpenSegment& opened = opened_.front();
    if (opened.bytes && segment.layout) {
      SegmentReader rows(segment, visitor_.row);
      for (;;) {
        while (!jobs_.full() && start_piece()) continue;
        if (opened.running == 0) break;
        if (auto done = take_piece(opened, rows); !done) return done;
      }
      opened.bytes->finish(opened.hash);
      rows.finish(opened.locked, opened.bytes->bytes(), opened.bytes->error());
    } else if (opened.bytes) {
      opened.bytes->finish(opened.hash);
      segment.end = opened.locked ? SegmentEnd::kOpen : SegmentEnd::kTruncated;
      segment.truncated_bytes = opened.bytes->bytes();
      segment.truncated_line = 1;
    }
    if (opened.bytes) segment.sha256 = opened.hash.hex();
    opened_.pop_front();
    return {};
  }

  void open_next() {
    LogSegment& segment = segments_[next_++];
    OpenSegment& opened = opened_.emplace_back();
    opened.segment = &segment;
    opened.locked = is_locked(segment.path);
    opened.head = segment.layout ? segment.layout->head_bytes : 0;
    auto in = FileReader::open(segment.path);
    opened.all_read = !in || !segment.layout;
    if (in) {
      opened.bytes.emplace(std::move(*in), meter_);
    } else {
      segment.damaged.push_back({segment.path, 0, in.error().what});
      segment.read_failed = true;
    }
  }

  /// Returns false if all segments are read, or enough are open.
  bool start_piece() {
    while (opened_.back().all_read) {
      if (next_ == segments_.size() || opened_.size() == kMostOpen) return false;
      open_next();
    }
    OpenSegment& last = opened_.back();
    ParsedPiece parsed;
    if (!spare_.empty()) {
      parsed = std::move(spare_.back());
      spare_.pop_back();
    }
    if (!last.bytes->next(parsed.piece, last.head)) {
      spare_.push_back(std::move(parsed));
      last.all_read = true;
      return start_piece();
    }
    if (last.head > 0) {
      parsed.piece.first = parsed.piece.begin = last.head;
      last.head = 0;
    }
    jobs_.start([&layout = *last.segment->layout, &hash = last.hash, parsed = std::move(parsed)]() mutable {
      hash.add(parsed.piece);  // first, so that the next job waits only for this
      parse(parsed, layout);
      return std::move(parsed);
    });
    ++last.running;
    return true;
  }

  Result<void> take_piece(OpenSegment& opened, SegmentReader& rows) {
    ParsedPiece parsed = jobs_.take();
    --opened.running;
    if (!rows.ended()) {
      const std::size_t before = opened.segment->rows;
      if (auto done = rows.take(parsed); !done) return done;
      meter_.add_rows(opened.segment->rows - before);
      opened.all_read = opened.all_read || rows.ended();
    }
    spare_.push_back(std::move(parsed));
    return {};
  }

  const std::span<LogSegment> segments_;
  const SegmentVisitor& visitor_;
  tables::ReadMeter& meter_;
  std::size_t next_ = 0;            ///< of segments_, to open
  std::deque<OpenSegment> opened_;  ///< the first one is the segment whose rows are taken
  std::vector<ParsedPiece> spare_;  ///< their memory is used again
  OrderedJobs<ParsedPiece> jobs_;   ///< last: it ends before the memory that it uses
};

}  // namespace

Result<void> LogRowParser::parse(std::string_view line) {
  if (auto good = compensation::read_csv(line, {}, layout_.columns, row_); !good) return good;
  if (!layout_.column) return {};
  if (const double* const value = layout_.columns.real(*layout_.column, row_)) {
    value_ = *value;
    return {};
  }
  const std::string_view field = csv_field(line, ',', *layout_.column).value_or("");
  const auto value = field.empty() ? std::optional(kUnknown) : csv_number(field);
  if (!value) return make_error("", fmt::format("found \"{}\", expected a number", field));
  value_ = *value;
  return {};
}

Result<void> read_log_rows(std::span<LogSegment> segments, const SegmentVisitor& visitor, tables::ReadMeter& meter) {
  return SegmentQueue(segments, visitor, meter).read();
}

}  // namespace prism::recordings
