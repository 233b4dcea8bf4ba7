// SPDX-License-Identifier: MIT
#include "tools/prismweb/log_page.hpp"

#include <nlohmann/json.hpp>

#include "compensation/compensated_text.hpp"

namespace prism::prismweb {

using nlohmann::json;

Result<LogPage> parse_log_page(std::string_view member) {
  const json answer = json::parse("{" + std::string(member) + "}", nullptr, false);
  LogPage page;
  try {
    if (answer.contains("error"))
      return make_error(std::to_string(answer["error"].at("code").get<int>()), answer["error"].at("message"));
    const json& result = answer.at("result");
    for (const json& segment : result.at("segments")) {
      const auto layout = compensation::CsvLayout::parse(segment.at("columns").get_ref<const std::string&>(), "rows");
      if (!layout) continue;
      for (const json& line : segment.at("rows")) {
        const auto row = compensation::parse_csv(line.get_ref<const std::string&>(), "rows", *layout);
        if (row) page.seconds.push_back(second_of(*row));
      }
    }
    page.after = result.at("after");
    page.more = result.at("more");
    page.missing = result.value("missing", std::uint64_t{0});
  } catch (const json::exception&) {
    return make_error("", "found an invalid response of prismd to \"rows\"");
  }
  return page;
}

}  // namespace prism::prismweb
