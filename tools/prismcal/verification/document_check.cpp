// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "base/json_document.hpp"
#include "compensation/model_text.hpp"
#include "config/config.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "tools/prismcal/verification/checks.hpp"

namespace prism::verification {
namespace {

enum class Kind { kUnknown, kModel, kFrames, kConfiguration };

// What a text says that it is; a configuration says so by what it must or would name.
Kind kind_of(const Json& json) {
  if (!json.is_object()) return Kind::kUnknown;
  const auto format = json.find("format");
  if (format != json.end() && *format == "prism-model") return Kind::kModel;
  if (format != json.end() && *format == "prism-frames") return Kind::kFrames;
  return json.contains("frames") || json.contains("line") ? Kind::kConfiguration : Kind::kUnknown;
}

Result<std::string> of_model(const std::string& text, const std::string& path) {
  return compensation::parse_model(text, path).map([](const compensation::ModelPtr& model) {
    return fmt::format("model {} {}", model->info().id.substr(0, 12), model->info().name);
  });
}

Result<std::string> of_frames(const std::string& text, const std::string& path) {
  const auto frames = wire::parse_frame_description(text, path);
  if (!frames) return tl::unexpected<Error>(frames.error());
  if (auto proved = wire::run_test_vectors(**frames); !proved) return tl::unexpected<Error>(proved.error());
  return fmt::format("frames {}, {} test vectors hold", (*frames)->name, (*frames)->test_vectors.size());
}

Result<std::string> of_configuration(const std::string& text, const std::string& path) {
  return config::parse_config(text, path).map([](const config::Config& configuration) {
    return fmt::format("configuration of {}", configuration.name);
  });
}

}  // namespace

std::optional<Finding> check_document(const std::string& path, bool named) {
  const auto text = read_text_file(path, kMaxModelBytes);
  if (!text) return Finding{path, FileState::kUnreadable, text.error().what};
  const Json json = Json::parse(*text, nullptr, false, true);
  const Kind kind = kind_of(json);
  if (kind == Kind::kUnknown && !named && !json.is_discarded()) return std::nullopt;
  const auto outcome = kind == Kind::kModel    ? of_model(*text, path)
                       : kind == Kind::kFrames ? of_frames(*text, path)
                                               : of_configuration(*text, path);
  if (outcome) return Finding{path, FileState::kIntact, *outcome};
  return Finding{path, FileState::kUnreadable, without_path(outcome.error(), path)};
}

}  // namespace prism::verification
