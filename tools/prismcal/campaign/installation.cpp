// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/installation.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pwd.h>
#include <stdio.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "compensation/model_text.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "manifest.json";
constexpr const char* kFormat = "prism-manifest";

std::string file_name_of(const TaskResult& result) {
  std::string name = result.serial + (result.axis.empty() ? "" : "-" + result.axis);
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && !std::strchr("-_.", c)) c = '_';
  }
  return (name.starts_with(".") ? "_" : "") + name + ".json";
}

std::string requested_by(const LotFile& file) {
  if (!file.asked_by.empty()) return file.asked_by;
  const passwd* user = ::getpwuid(::getuid());
  return user ? user->pw_name : fmt::format("user {}", ::getuid());
}

Json limits_json(const std::vector<analysis::Limit>& limits) {
  Json json = Json::object();
  for (const analysis::Limit& limit : limits) {
    json[limit.quantity] = Json::object();
    if (limit.min) json[limit.quantity]["min"] = *limit.min;
    if (limit.max) json[limit.quantity]["max"] = *limit.max;
  }
  return json;
}

Json entry_of(const LotFile& file, const TaskResult& result, const std::string& name, const std::string& text) {
  Json entry = {{"file", name},
                {"sha256", sha256_hex(text)},
                {"id", result.id},
                {"serial", result.serial},
                {"axis", result.axis},
                {"model", result.model},
                {"campaign", file.name},
                {"asked_by", requested_by(file)},
                {"task", result.task},
                {"version", result.version},
                {"level", result.level},
                {"limits",
                 {{"data_quality", limits_json(file.limits.quality)},
                  {"repeat", limits_json(file.limits.repeat)},
                  {"other", limits_json(file.limits.other)}}},
                {"judged", Json::array()}};
  for (const RecordingResult& recording : result.evaluations) {
    Json measured = Json::object();
    for (const analysis::Measured& m : recording.measured) measured[m.quantity] = m.value ? Json(*m.value) : Json();
    entry["judged"].push_back({{"role", recording.role}, {"recording", recording.recording}, {"measured", measured}});
  }
  return entry;
}

/// Reads the model of a result. Errors: it is not the model that was evaluated, or belongs to another gyro.
Result<std::string> model_text_of(const ResultStore& store, const TaskResult& result) {
  const std::string path = store.task_folder(result.task) + "/model.json";
  auto text = read_text_file(path, kMaxModelBytes);
  if (!text) return text;
  const auto model = compensation::parse_model(*text, path);
  if (!model) return tl::unexpected<Error>(model.error());
  const compensation::ModelInfo& info = (*model)->info();
  if (info.id != result.id)
    return make_error(path,
                      fmt::format("found id {:.12}, expected {:.12}: not the evaluated model", info.id, result.id));
  if (info.gyro_serial != result.serial)
    return make_error(
        path, fmt::format("found the model of gyro \"{}\", expected that of \"{}\"", info.gyro_serial, result.serial));
  return text;
}

/// The entries of the manifest in `folder`; none if the folder does not exist or is empty.
Result<Json> old_entries(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(folder, error) || fs::is_empty(folder, error)) return Json::array();
  const std::string path = folder + "/" + kManifest;
  const auto text = read_text_file(path, kMaxModelBytes);
  if (!text)
    return make_error(folder,
                      fmt::format("found files but no {}, expected an empty folder or installed models", kManifest));
  const Json json = Json::parse(*text, nullptr, false);
  if (!json.is_object() || json.value("format", "") != kFormat || !json.contains("models") ||
      !json["models"].is_array())
    return make_error(path, fmt::format("found other contents, expected a {} with \"models\"", kFormat));
  return json["models"];
}

/// Writes the models and the manifest into `made`, a new folder that will replace `folder`.
Result<InstalledModels> fill(const LotFile& file, const ResultStore& store, const Lot& lot, const std::string& made,
                             const std::string& folder, bool keep_others) {
  InstalledModels installed;
  std::error_code error;
  Json manifest = {
      {"format", kFormat}, {"version", 1}, {"made", utc_text(std::time(nullptr))}, {"models", Json::array()}};
  const auto add = [&](const std::string& name, const Result<std::string>& text, Json entry) -> Result<void> {
    if (!text) return tl::unexpected<Error>(text.error());
    manifest["models"].push_back(std::move(entry));
    return write_text_file((fs::path(made) / name).string(), *text);
  };
  for (const TaskResult* result : lot.chosen(file.models)) {
    const std::string name = file_name_of(*result);
    if (fs::exists(fs::path(made) / name, error) || name == kManifest)
      return make_error(
          name, fmt::format("found a second gyro with this file name ({}), expected unique names", result->gyro));
    const auto text = model_text_of(store, *result);
    if (auto done = add(name, text, text ? entry_of(file, *result, name, *text) : Json()); !done)
      return tl::unexpected<Error>(done.error());
    ++installed.models;
  }
  const auto others = old_entries(folder);
  if (!others) return tl::unexpected<Error>(others.error());
  for (const Json& entry : *others) {
    const std::string name = entry.is_object() ? entry.value("file", "") : "";
    if (!keep_others || name.empty() || name.find('/') != std::string::npos || fs::exists(fs::path(made) / name, error))
      continue;
    if (auto done = add(name, read_text_file((fs::path(folder) / name).string(), kMaxModelBytes), entry); !done)
      return tl::unexpected<Error>(done.error());
    ++installed.kept;
  }
  if (auto done = write_text_file(made + "/" + kManifest, json_text(manifest, 1) + "\n"); !done)
    return tl::unexpected<Error>(done.error());
  return installed;
}

}  // namespace

Result<InstalledModels> install_models(const LotFile& file, const ResultStore& store, const Lot& lot,
                                       const std::string& folder, bool keep_others) {
  std::error_code error;
  std::string target = fs::absolute(folder, error).lexically_normal().string();
  while (target.size() > 1 && target.back() == '/') target.pop_back();
  if (fs::is_symlink(target, error)) target = fs::canonical(target, error).string();
  const std::string made = fmt::format("{}.{}.new", target, ::getpid());
  fs::remove_all(made, error);
  if (!fs::create_directories(made, error)) return make_error(made, error ? error.message() : "cannot be created");
  auto installed = fill(file, store, lot, made, target, keep_others);
  const bool exists = fs::exists(target, error);
  if (installed && (exists ? ::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE)
                           : ::rename(made.c_str(), target.c_str())) != 0)
    installed = make_error(target, fmt::format("cannot be exchanged atomically: {}; unchanged", std::strerror(errno)));
  if (!installed || exists) fs::remove_all(made, error);
  return installed;
}

}  // namespace prism::campaign
