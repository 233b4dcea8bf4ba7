// SPDX-License-Identifier: MIT
// What of a report is prism's own.
#pragma once

#include <string>

namespace prism::test {

/// A report's page without the script of its charts: a library's, whose words are its own.
inline std::string without_script(std::string page) {
  const auto begin = page.find("<script>");
  if (begin == std::string::npos) return page;
  return page.erase(begin, page.find("</script>", begin) - begin);
}

}  // namespace prism::test
