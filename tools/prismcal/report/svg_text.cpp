// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/svg_text.hpp"

#include <fmt/format.h>

#include "base/escape.hpp"
#include "tools/prismcal/report/svg_scale.hpp"

namespace prism::report {
namespace {

/// Width in em of the character that starts with `byte`; 0 for continuation bytes.
double width_em(char byte) {
  const auto code = static_cast<unsigned char>(byte);
  if (code >= 0x80) return code < 0xc0 ? 0 : code < 0xe2 ? 0.65 : 1;
  if (std::string_view(" iljtfrI.,:;'|()[]!/-").find(byte) != std::string_view::npos) return 0.38;
  if (std::string_view("mwMW%@").find(byte) != std::string_view::npos) return 0.95;
  return byte >= 'A' && byte <= 'Z' ? 0.75 : 0.63;
}

}  // namespace

double text_width(std::string_view text) {
  double width = 0;
  for (const char byte : text) width += kFontPx * width_em(byte);
  return width;
}

std::string fitted(std::string_view text, double width) {
  constexpr std::size_t kLongest = 2000;  // bytes; more than fit in any width
  std::string clean = valid_utf8(text.substr(0, kLongest));
  if (text_width(clean) <= width) return clean;
  double used = kFontPx;  // width of "…"
  for (std::size_t i = 0; i < clean.size(); ++i) {
    used += kFontPx * width_em(clean[i]);
    if (used > width) return clean.substr(0, i) + "…";
  }
  return clean;
}

std::string text_svg(double x, double y, std::string_view text, const char* anchor, std::string_view more) {
  if (text.empty()) return {};
  return fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"{}\"{}>{}</text>\n", svg_number(x), svg_number(y), anchor,
                     more, html_text(text));
}

}  // namespace prism::report
