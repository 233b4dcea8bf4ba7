// SPDX-License-Identifier: MIT
// Texts with special characters of SQL, CSV, JSON, HTML, shells and terminals.
#pragma once

#include <string>
#include <vector>

namespace prism::test {

inline const std::vector<std::string>& hostile_texts() {
  static const std::vector<std::string> kTexts = {
      R"(quotes ' " ` and \ and \" and '')",
      R"(a\u0000b)",  // six characters and two letters, no NUL
      R"(a\\u0000b)",
      R"(a\\\u0000b)",
      std::string("NUL \0 here", 10),
      "line\nend",
      "line\r\nend",
      "\n\\.\n",  // the end of data for COPY
      "\033[31mred\033[0m",
      "\033]0;title\007",
      "\033]8;;http://example.invalid\033\\link",
      std::string("\xc2\x9b") + "31m C1",
      "\x7f delete",
      "$(id)",
      "`id`",
      "'; DROP TABLE rows;--",
      "<img src=x onerror=alert(1)>",
      "../../etc/passwd",
      "%0a%00%s%n",
      "{0} {} %d",
      "\xe2\x80\xaegnp.exe",  // right-to-left override
      "\xe2\x80\xa8line separator",
      "a,b;c\td",
      "=1+1",
      "invalid \xff\xfe\xc0\x80 UTF-8",
      "half \xe2\x82",
      "surrogate \xed\xa0\x80",
      "# HELP x y\nx 1",
      "+#/$SYS",
      "good+good",
      std::string(1 << 20, 'm'),
  };
  return kTexts;
}

}  // namespace prism::test
