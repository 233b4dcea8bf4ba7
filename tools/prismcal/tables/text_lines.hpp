// SPDX-License-Identifier: MIT
// The lines of a text file in any encoding and with any line ends, as UTF-8, in constant memory.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "base/file.hpp"

namespace prism::tables {

/// The encoding of a text by its first bytes: a byte-order mark, the zero bytes of UTF-16, valid UTF-8 (also ASCII),
/// only letters of units and German words in windows-1252, else what uchardet finds, else windows-1252.
std::string detect_encoding(std::string_view first_bytes);

class TextLines {
 public:
  /// `encoding`: a name for iconv; empty: detected. Errors: those of FileReader::open(), an unknown encoding, UTF-32.
  static Result<TextLines> open(const std::string& path, const std::string& encoding);

  /// The next line without its end, which may be LF, CR LF or CR. Returns false at the end or on an error.
  bool next();
  std::string_view line() const { return line_; }
  std::size_t number() const { return number_; }  ///< of the line, from 1
  bool ended() const { return ended_; }           ///< the line had an end: false only for a torn last line
  std::string position() const;                   ///< "FILE:LINE"
  std::uint64_t bytes_read() const { return in_.offset(); }
  std::uint64_t size_bytes() const { return size_bytes_; }  ///< of the file when it was opened
  const std::string& encoding() const { return encoding_; }
  /// The first error: of the disk, a NUL byte, bytes that the encoding does not have, a line of more than
  /// kMaxLineBytes.
  Result<void> finish() const;

 private:
  struct Converter;
  TextLines(FileReader in, std::string path) : in_(std::move(in)), path_(std::move(path)) {}
  bool fill();
  bool fail(std::string what);

  FileReader in_;
  std::string path_, encoding_ = {};
  std::shared_ptr<Converter> converter_ = {};  ///< null: the bytes are UTF-8 already
  std::string text_ = {};                      ///< decoded, from at_ not yet returned
  std::size_t at_ = 0, number_ = 0;
  std::uint64_t size_bytes_ = 0;
  std::string_view line_ = {};
  bool ended_ = false, at_end_ = false, any_nul_ = false, cr_only_ = false, skip_lf_ = false;
  std::optional<Error> error_ = {};
};

}  // namespace prism::tables
