// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/campaign_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

std::string absolute_in(const fs::path& base, const std::string& path) {
  return path.empty() ? path : (base / path).lexically_normal().string();
}

/// One option with its value, as on a command line; empty for a flag that is false.
std::string word_of(const std::string& key, const Json& value, const Section& section) {
  if (value.is_boolean()) return value.get<bool>() ? "--" + key : "";
  if (value.is_string()) return fmt::format("--{}={}", key, value.get<std::string>());
  if (value.is_number()) return fmt::format("--{}={}", key, json_text(value));
  const auto good = [](const Json& item) { return item.is_string() || item.is_number(); };
  if (!value.is_array() || value.empty() || !std::all_of(value.begin(), value.end(), good)) {
    section.fail(key, fmt::format("found {}, expected a text, a number, true, or an array of them", shown(value)));
    return {};
  }
  std::string list;
  for (const Json& item : value)
    list += (list.empty() ? "" : ",") + (item.is_string() ? item.get<std::string>() : json_text(item));
  return fmt::format("--{}={}", key, list);
}

std::vector<std::string> words_of(const Section& section) {
  std::vector<std::string> words;
  for (const std::string& key : section.names(TextRule::kName)) {
    std::string word = word_of(key, section.any(key), section);
    if (!word.empty()) words.push_back(std::move(word));
  }
  return words;
}

std::vector<RecordingPattern> read_patterns(const Section& root, const fs::path& base) {
  std::vector<RecordingPattern> recordings;
  std::array<bool, kRoleNames.size()> found{};
  for (const Section& section : root.objects("recordings")) {
    RecordingPattern recording;
    recording.role = static_cast<Role>(section.choice("role", kRoleNames));
    for (const std::string& pattern : section.texts("paths")) recording.patterns.push_back(absolute_in(base, pattern));
    found[static_cast<std::size_t>(recording.role)] = true;
    recordings.push_back(std::move(recording));
  }
  for (const Role role : {Role::kTrain, Role::kRepeat}) {
    if (root.good() && !found[static_cast<std::size_t>(role)])
      root.fail("recordings", fmt::format("found no recording with role {}, expected one or more", role_name(role)));
  }
  return recordings;
}

std::vector<ModelChoice> read_models(const Section& root) {
  std::vector<ModelChoice> models;
  const Section section = root.object("models", true);
  for (const std::string& name : section.names(TextRule::kName))
    models.push_back({name, words_of(section.object(name))});
  if (root.good() && models.empty()) root.fail("models", "found none, expected one or more");
  return models;
}

std::vector<analysis::Limit> read_limits_of(const Section& limits, const std::string& role) {
  if (!limits.has(role)) return {};
  const std::string where = fmt::format("{}/{}", limits.where(), role);
  auto read = analysis::parse_limits(json_text(limits.any(role)), where);
  if (read) return *read;
  const Error& error = read.error();  // error.where: `where`, or `where` + ":/QUANTITY…"
  const bool below = error.where.size() > where.size() && error.where.starts_with(where);
  limits.fail(below ? role + error.where.substr(where.size() + 1) : role, error.what);
  return {};
}

std::vector<FindingLimit> read_findings(const Section& findings) {
  std::vector<FindingLimit> limits;
  for (const std::string& name : findings.names(TextRule::kName)) {
    if (std::find(kFindingNames.begin(), kFindingNames.end(), name) == kFindingNames.end())
      findings.fail(name, fmt::format("no such finding; expected one of {}", fmt::join(kFindingNames, ", ")));
    const Section limit = findings.object(name);
    FindingLimit range{name, {}, {}};
    if (limit.has("min")) range.min = limit.number("min", kAnyNumber);
    if (limit.has("max")) range.max = limit.number("max", kAnyNumber);
    if (!range.min && !range.max) findings.fail(name, "found neither min nor max, expected one or both");
    limits.push_back(std::move(range));
  }
  return limits;
}

CampaignLimits read_limits(const Section& root) {
  CampaignLimits limits;
  const Section section = root.object("limits");
  const Section quality = section.object("data_quality");
  limits.warnings_pass = quality.choice("verdict", {"pass", "warn"}, 1) == 1;
  limits.findings = read_findings(quality.object("findings"));
  limits.repeat = read_limits_of(section, "repeat");
  limits.other = read_limits_of(section, "other");
  return limits;
}

}  // namespace

Result<CampaignFile> parse_campaign(std::string_view text, const std::string& path) {
  const auto document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  std::error_code error;
  CampaignFile file;
  file.path = fs::absolute(path, error).lexically_normal().string();
  const fs::path base = fs::path(file.path).parent_path();
  const Section root(*document);
  file.warnings = root.removed(KeyFile::kCampaign);
  root.allow({"$schema"});
  file.name = root.text("name", fs::path(file.path).stem().string(), TextRule::kName);
  file.asked_by = root.text("asked_by", "");
  file.recordings = read_patterns(root, base);
  file.models = read_models(root);
  file.judging = words_of(root.object("judging"));
  file.limits = read_limits(root);
  const Section output = root.object("output");
  file.folder = absolute_in(base, output.text("folder", file.name + ".campaign"));
  file.reports = output.boolean("reports", true);
  file.previous = absolute_in(base, root.text("previous", ""));
  if (auto done = root.finish(); !done) return tl::unexpected<Error>(done.error());
  return file;
}

Result<CampaignFile> load_campaign(const std::string& path) {
  return read_text_file(path).and_then([&](const std::string& text) { return parse_campaign(text, path); });
}

}  // namespace prism::campaign
