// SPDX-License-Identifier: MIT
#include "tests/fuzz/outputs.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "base/outside_text.hpp"
#include "compensation/compensated_text.hpp"
#include "compensation/model_text.hpp"
#include "daemon/log/log_pager.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismrelay/batch.hpp"

namespace prism::test {
namespace {

constexpr const char* kLog = "g-20261121T120000Z.csv";
constexpr std::int64_t kFirstSecond = 1'795'262'400;

/// Columns and 300 rows of a gyro whose temperature rises.
const std::string& rows() {
  static const std::string kRows = [] {
    std::string text = compensation::csv_columns() + "\n";
    for (int i = 0; i < 300; ++i) {
      compensation::CompensatedWindow row;
      row.window.second_mean.second = kFirstSecond + i;
      row.window.second_mean.samples = 2;
      row.window.second_mean.rate_deg_per_h = 8.0 + 0.01 * (i % 7);
      row.window.second_mean.temperature_degc = 20 + 0.01 * i;
      row.window.second_mean.uhfo_v = 1.5 + 0.001 * (i % 5);
      compensation::append_csv(text, row);
      text += '\n';
    }
    return text;
  }();
  return kRows;
}

/// Aborts unless PostgreSQL's COPY can read `text`: quotes are closed, and all records have the same number of fields.
void require_csv(const std::string& text) {
  std::size_t fields = 1, first = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') quoted = !quoted;
    if (quoted) continue;
    if (text[i] == ',') ++fields;
    if (text[i] != '\n') continue;
    if (first == 0) first = fields;
    require(fields == first);
    fields = 1;
  }
  require(!quoted);
  require(text.find('\0') == text.npos);
}

void require_batch(const std::string& folder) {
  log::Segments segments({.directory = folder}, "g", ".csv");
  log::LogPager log_rows(segments);
  const auto page = log_rows.page({.after = "earliest"}, {});
  require(page.has_value());
  const auto json = nlohmann::json::parse(page->json + "}", nullptr, false);
  require(json.is_object());
  const auto item = prismrelay::page_item({"lab/g", "z"}, "earliest", {{"axes", {{"z", json}}}});
  require(item.has_value());
  for (std::size_t table = 0; table < prismrelay::kTables; ++table) {
    if (table != prismrelay::kRows) require_csv((*item)->texts[table]);  // rows are binary
  }
  require_csv(prismrelay::place_line(**item));
}

/// Returns an empty directory; each call empties it.
std::string emptied_folder() {
  static const TemporaryFolder kFolder;
  const std::string path = kFolder.file("log");
  std::filesystem::remove_all(path);
  std::filesystem::create_directory(path);
  return path;
}

}  // namespace

void require_printable_line(const std::string& text) {
  require(!text.empty() && text.size() < 20'000);
  require(is_printable(text));
}

void require_plain_html(const std::string& html) {
  static const std::set<std::string> kElements = {
      "!DOCTYPE", "html",  "head", "meta",     "title", "style",          "body",     "header",     "h1",
      "h2",       "p",     "nav",  "a",        "table", "caption",        "thead",    "tbody",      "tr",
      "th",       "td",    "span", "b",        "div",   "section",        "figure",   "figcaption", "footer",
      "script",   "svg",   "g",    "path",     "rect",  "line",           "polyline", "polygon",    "circle",
      "text",     "tspan", "defs", "clipPath", "use",   "linearGradient", "stop",     "desc",       "dl",
      "dt",       "dd"};
  for (std::size_t at = html.find('<'); at != html.npos; at = html.find('<', at + 1)) {
    const std::size_t begin = at + (html.compare(at, 2, "</") == 0 ? 2 : 1);
    const std::size_t end = std::min(html.find_first_of(" />\n", begin), html.size());
    const std::string name = html.substr(begin, end - begin);
    if (name == "script" || name == "style") {  // their content is not markup
      at = html.find("</" + name, begin);
      require(at != html.npos);
      continue;
    }
    require(kElements.contains(name));
    const std::size_t close = html.find('>', begin);
    require(close != html.npos);
    require(html.substr(begin, close - begin).find(" on") == html.npos ||
            html.substr(begin, close - begin).find('"') != html.npos);
  }
}

bool through_report_and_batch(const std::string& header, const compensation::Model& model) {
  const std::string folder = emptied_folder(), path = folder + "/" + kLog, model_path = folder + "/model.json";
  std::ofstream(path, std::ios::binary) << header << rows();
  std::ofstream(model_path, std::ios::binary) << compensation::format_model(model);
  require_batch(folder);
  commands::EvaluateChoice choice;
  choice.model = model_path;
  choice.recordings = {path};
  choice.common.site.no_earth_rate = true;
  const auto judged = commands::evaluate_recordings(choice);
  if (!judged) {
    require_printable_line(judged.error().text());
    return false;
  }
  require_plain_html(report::html_page(judged->report));
  require(nlohmann::json::accept(report::json_text(judged->report)));
  return true;
}

const compensation::Model& shipped_model() {
  static const compensation::ModelPtr kModel = [] {
    std::ifstream in(PRISM_SOURCE_DIR "/config/models/tao2019-model2.json");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    auto model = compensation::parse_model(text, "tao2019-model2.json");
    require(model.has_value());
    return *model;
  }();
  return *kModel;
}

}  // namespace prism::test
