// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/text_lines.hpp"

#include <fmt/format.h>
#include <iconv.h>
#include <uchardet/uchardet.h>
#include <utf8.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace prism::tables {
namespace {

constexpr std::size_t kChunkBytes = 1u << 18;

bool is_utf8(std::string_view text) {
  const auto bad = utf8::find_invalid(text.begin(), text.end());
  return text.end() - bad < 4 && (bad == text.end() || (static_cast<unsigned char>(*bad) >= 0xC2));
}

/// Letters of units and of German words in Latin-1. uchardet needs more text than a header to recognise them.
bool is_latin(std::string_view text) {
  static constexpr std::string_view kLetters = "\xB0\xB5\xB2\xB3\xB1\xB7\xC4\xD6\xDC\xE4\xF6\xFC\xDF\xE9\xE8\xE0";
  return std::all_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x80 || kLetters.find(c) != std::string_view::npos;
  });
}

std::string uchardet_name(std::string_view text) {
  const auto detector =
      std::unique_ptr<std::remove_pointer_t<uchardet_t>, decltype(&uchardet_delete)>(uchardet_new(), &uchardet_delete);
  if (uchardet_handle_data(detector.get(), text.data(), text.size()) != 0) return {};
  uchardet_data_end(detector.get());
  return uchardet_get_charset(detector.get());
}

}  // namespace

struct TextLines::Converter {
  explicit Converter(iconv_t opened) : handle(opened) {}
  ~Converter() { iconv_close(handle); }
  Converter(const Converter&) = delete;
  Converter& operator=(const Converter&) = delete;

  /// Appends the UTF-8 of `rest` and `bytes` to `text`. Returns false for bytes that the encoding does not have.
  bool add(std::string_view bytes, std::string& text) {
    rest.append(bytes);
    char* in = rest.data();
    std::size_t left = rest.size();
    std::array<char, 1u << 14> out;
    bool good = true;
    while (left > 0 && good) {
      char* to = out.data();
      std::size_t space = out.size();
      const std::size_t done = iconv(handle, &in, &left, &to, &space);
      text.append(out.data(), out.size() - space);
      if (done == static_cast<std::size_t>(-1) && errno == EINVAL) break;  // an incomplete character: wait for the rest
      good = done != static_cast<std::size_t>(-1) || errno == E2BIG;
    }
    rest.erase(0, rest.size() - left);
    return good;
  }

  iconv_t handle;
  std::string rest;
};

std::string detect_encoding(std::string_view first) {
  if (first.starts_with("\xEF\xBB\xBF")) return "UTF-8";
  if (first.starts_with(std::string_view("\xFF\xFE\0\0", 4))) return "UTF-32LE";
  if (first.starts_with("\xFF\xFE")) return "UTF-16LE";
  if (first.starts_with("\xFE\xFF")) return "UTF-16BE";
  std::array<std::size_t, 2> zeros{};
  for (std::size_t i = 0; i < std::min<std::size_t>(first.size(), 4096); ++i) zeros[i % 2] += first[i] == '\0';
  const std::size_t many = std::min<std::size_t>(first.size(), 4096) / 8;
  if (zeros[1] > many && zeros[0] == 0) return "UTF-16LE";
  if (zeros[0] > many && zeros[1] == 0) return "UTF-16BE";
  if (is_utf8(first)) return "UTF-8";
  if (is_latin(first)) return "windows-1252";
  std::string found = uchardet_name(first);
  return found.empty() || found == "ASCII" ? "windows-1252" : found;
}

Result<TextLines> TextLines::open(const std::string& path, const std::string& encoding) {
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::vector<char> first(kChunkBytes);
  const std::size_t got = in->read(first);
  const std::string_view sample(first.data(), got);
  TextLines lines(std::move(*in), path);
  std::error_code error;
  lines.size_bytes_ = std::filesystem::file_size(path, error);
  if (error) lines.size_bytes_ = 0;
  lines.encoding_ = encoding.empty() ? detect_encoding(sample) : encoding;
  if (lines.encoding_ != "UTF-8" && lines.encoding_ != "utf-8") {
    iconv_t handle = iconv_open("UTF-8", lines.encoding_.c_str());
    if (handle == reinterpret_cast<iconv_t>(-1))
      return encoding.empty() ? make_error(path, fmt::format("found the encoding {}, which iconv does not know; state "
                                                             "it with --encoding",
                                                             lines.encoding_))
                              : make_error("--encoding", fmt::format("found \"{}\", expected a name that iconv knows, "
                                                                     "as UTF-8, UTF-16 or ISO-8859-1",
                                                                     encoding));
    lines.converter_ = std::make_shared<Converter>(handle);
  }
  lines.in_.seek(0);
  lines.fill();
  if (lines.text_.starts_with("\xEF\xBB\xBF")) lines.at_ = 3;
  // CR alone ends a line if the first chunk has one that no LF follows.
  for (std::size_t i = lines.text_.find('\r'); !lines.cr_only_ && i < lines.text_.size() - 1;
       i = lines.text_.find('\r', i + 1)) {
    lines.cr_only_ = lines.text_[i + 1] != '\n';
  }
  return lines;
}

bool TextLines::fail(std::string what) {
  if (!error_) error_ = Error{fmt::format("{}:{}", path_, number_), std::move(what)};
  return false;
}

bool TextLines::fill() {
  if (at_end_) return false;
  text_.erase(0, at_);
  at_ = 0;
  const std::size_t before = text_.size();
  std::vector<char> bytes(kChunkBytes);
  const std::size_t got = in_.read(bytes);
  const std::string_view read(bytes.data(), got);
  at_end_ = got < bytes.size();
  if (!converter_) {
    text_.append(read);
  } else if (!converter_->add(read, text_)) {
    at_end_ = true;
    fail("found bytes that " + encoding_ + " does not have; state the encoding with --encoding");
  }
  any_nul_ = any_nul_ || std::memchr(text_.data() + before, 0, text_.size() - before) != nullptr;
  return text_.size() > before || !at_end_;
}

bool TextLines::next() {
  std::size_t searched = 0;
  while (true) {
    if (skip_lf_ && at_ < text_.size()) {
      at_ += text_[at_] == '\n';
      skip_lf_ = false;
    }
    const std::size_t end = cr_only_ ? text_.find_first_of("\r\n", at_ + searched) : text_.find('\n', at_ + searched);
    ended_ = end != std::string::npos;
    if (!ended_ && !at_end_) {
      searched = text_.size() - at_;
      if (searched > kMaxLineBytes) break;
      fill();
      continue;
    }
    if (!ended_ && (at_ == text_.size() || error_)) return false;
    const std::size_t stop = ended_ ? end : text_.size();
    line_ = std::string_view(text_).substr(at_, stop - at_);
    at_ = stop + (ended_ ? 1 : 0);
    if (ended_ && cr_only_ && text_[end] == '\r') skip_lf_ = true;
    if (!cr_only_ && line_.ends_with('\r')) line_.remove_suffix(1);
    ++number_;
    if (line_.size() > kMaxLineBytes) break;
    if (any_nul_ && std::memchr(line_.data(), 0, line_.size()) != nullptr)
      return fail("found a NUL byte, expected text");
    return true;
  }
  return fail(fmt::format("found a line of more than {} bytes", kMaxLineBytes));
}

std::string TextLines::position() const { return fmt::format("{}:{}", path_, number_); }

Result<void> TextLines::finish() const {
  if (error_) return tl::unexpected<Error>(*error_);
  return in_.finish();
}

}  // namespace prism::tables
