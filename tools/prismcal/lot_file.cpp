// SPDX-License-Identifier: MIT
#include "tools/prismcal/lot_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kFindings = {"temperature_span", "length", "explainable", "moved",
                                            "disturbed",        "noise",  "quantised"};

constexpr const char* kWildcards = "*?[{";

std::string absolute_in(const fs::path& base, const std::string& path) {
  return path.empty() ? path : (base / path).lexically_normal().string();
}

/// One option with its value, as on a command line; empty for a flag that is false.
std::string word_of(const std::string& key, const Json& value, const Section& section) {
  if (value.is_boolean()) return value.get<bool>() ? "--" + key : "";
  const auto text = [](const Json& item) { return item.is_string() ? item.get<std::string>() : json_text(item); };
  const auto good = [](const Json& item) { return item.is_string() || item.is_number(); };
  if (good(value)) return fmt::format("--{}={}", key, text(value));
  if (!value.is_array() || value.empty() || !std::all_of(value.begin(), value.end(), good)) {
    section.fail(key, fmt::format("found {}, expected a text, a number, true, or an array of them", shown(value)));
    return {};
  }
  std::string list;
  for (const Json& item : value) list += (list.empty() ? "" : ",") + text(item);
  return fmt::format("--{}={}", key, list);
}

std::vector<std::string> words_of(const Section& section, std::vector<std::string> words = {}) {
  for (const std::string& key : section.names(TextRule::kName)) {
    std::string word = word_of(key, section.any(key), section);
    if (!word.empty()) words.push_back(std::move(word));
  }
  return words;
}

/// The end of the folder or file name with the first wildcard, if that is a * and the only one of its name; else 0.
std::size_t end_of_name_with_star(const std::string& pattern) {
  const std::size_t star = pattern.find_first_of(kWildcards), end = std::min(pattern.find('/', star), pattern.size());
  const bool is_only_star = star != pattern.npos && pattern[star] == '*' &&
                            pattern.substr(star + 1, end - star - 1).find_first_of(kWildcards) == pattern.npos;
  return is_only_star ? end : 0;
}

std::vector<RecordingPattern> read_patterns(const Section& root, const fs::path& base) {
  std::vector<RecordingPattern> recordings;
  for (const Section& section : root.objects("recordings")) {
    RecordingPattern recording{static_cast<Role>(section.choice("role", kRoleNames)), {}, section.text("serial", "")};
    for (const std::string& pattern : section.texts("paths")) {
      recording.patterns.push_back(absolute_in(base, pattern));
      if (recording.serial == "*" && end_of_name_with_star(recording.patterns.back()) == 0)
        section.fail("serial", fmt::format("found \"*\" with the path {}, expected a path whose first * is the first "
                                           "wildcard, and the only one of its name",
                                           pattern));
    }
    recordings.push_back(std::move(recording));
  }
  for (const Role role : {Role::kTrain, Role::kRepeat}) {
    const auto has_role = [role](const RecordingPattern& recording) { return recording.role == role; };
    if (root.good() && std::none_of(recordings.begin(), recordings.end(), has_role))
      root.fail("recordings", fmt::format("found no recording with role {}, expected one or more", role_name(role)));
  }
  return recordings;
}

std::vector<analysis::Limit> read_limits(const Section& limits, const std::string& key,
                                         const std::vector<std::string>& names = analysis::measured_names()) {
  if (!limits.has(key)) return {};
  const std::string where = fmt::format("{}/{}", limits.where(), key);
  auto read = analysis::parse_limits(json_text(limits.any(key)), where, names);
  if (read) return *read;
  const Error& error = read.error();  // error.where: `where`, or `where` + ":/QUANTITY…"
  const bool below = error.where.size() > where.size() && error.where.starts_with(where);
  limits.fail(below ? key + error.where.substr(where.size() + 1) : key, error.what);
  return {};
}

}  // namespace

std::string matched_by_star(const std::string& pattern, const std::string& path) {
  const std::size_t star = pattern.find('*'), after = end_of_name_with_star(pattern) - star - 1;
  return path.substr(star, std::min(path.find('/', star), path.size()) - star - after);
}

Result<LotFile> parse_lot_file(std::string_view text, const std::string& path) {
  const auto document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  std::error_code error;
  LotFile file;
  file.path = fs::absolute(path, error).lexically_normal().string();
  const fs::path base = fs::path(file.path).parent_path();
  const Section root(*document);
  file.warnings = root.removed(KeyFile::kCampaign);
  root.allow({"$schema"});
  file.name = root.text("name", fs::path(file.path).stem().string(), TextRule::kName);
  file.asked_by = root.text("asked_by", "");
  file.recordings = read_patterns(root, base);
  const std::vector<std::string> reading = words_of(root.object("reading"));
  const Section models = root.object("models", true);
  for (const std::string& name : models.names(TextRule::kName))
    file.models.push_back({name, words_of(models.object(name), reading)});
  if (root.good() && file.models.empty()) root.fail("models", "found none, expected one or more");
  file.judging = words_of(root.object("judging"), reading);
  const Section limits = root.object("limits"), quality = limits.object("data_quality");
  file.limits.warnings_pass = quality.choice("verdict", {"pass", "warn"}, 1) == 1;
  file.limits.quality = read_limits(quality, "findings", kFindings);
  file.limits.repeat = read_limits(limits, "repeat");
  file.limits.other = read_limits(limits, "other");
  if (root.has("limits")) file.limits.stated = root.any("limits");
  const Section output = root.object("output");
  file.folder = absolute_in(base, output.text("folder", file.name + ".campaign"));
  file.reports = output.boolean("reports", true);
  file.previous = absolute_in(base, root.text("previous", ""));
  if (auto done = root.finish(); !done) return tl::unexpected<Error>(done.error());
  return file;
}

Result<LotFile> load_lot_file(const std::string& path) {
  return read_text_file(path).and_then([&](const std::string& text) { return parse_lot_file(text, path); });
}

}  // namespace prism::campaign
