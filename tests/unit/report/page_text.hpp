// SPDX-License-Identifier: MIT
// The page of a report without library code.
#pragma once

#include <string>

namespace prism::test {

/// Removes the chart script, which contains a library that tests must not search.
inline std::string without_script(std::string page) {
  const auto begin = page.find("<script>");
  if (begin == std::string::npos) return page;
  return page.erase(begin, page.find("</script>", begin) - begin);
}

}  // namespace prism::test
