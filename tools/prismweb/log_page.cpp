// SPDX-License-Identifier: MIT
#include "tools/prismweb/log_page.hpp"

#include <nlohmann/json.hpp>

#include "compensation/compensated_text.hpp"

namespace prism::prismweb {

using nlohmann::json;

tl::expected<LogPage, client::RequestError> parse_log_page(std::string_view member, const std::string& axis) {
  const client::Response response = client::response_of_member("rows", member);
  if (!response) return tl::unexpected(response.error());
  LogPage page;
  try {
    const json& result = client::of_axis(*response, axis);
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
    return tl::unexpected(client::RequestError{config::kFailed, {"prismd", "found an invalid response to \"rows\""}});
  }
  return page;
}

}  // namespace prism::prismweb
