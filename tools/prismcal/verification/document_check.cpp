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

enum class DocumentType { kUnknown, kModel, kFrames, kConfiguration };

// The "format" of a model or frame description; a configuration has "frames" or "line" instead.
DocumentType type_of(const Json& json) {
  if (!json.is_object()) return DocumentType::kUnknown;
  const auto format = json.find("format");
  if (format != json.end() && *format == "prism-model") return DocumentType::kModel;
  if (format != json.end() && *format == "prism-frames") return DocumentType::kFrames;
  return json.contains("frames") || json.contains("line") ? DocumentType::kConfiguration : DocumentType::kUnknown;
}

Result<std::string> of_model(const std::string& text, const std::string& path) {
  return compensation::parse_model(text, path).map([](const compensation::ModelPtr& model) {
    return fmt::format("model {} {}", model->info().id.substr(0, 12), model->info().name);
  });
}

Result<std::string> of_frames(const std::string& text, const std::string& path) {
  const auto frames = wire::parse_frame_description(text, path);
  if (!frames) return tl::unexpected<Error>(frames.error());
  if (auto passed = wire::run_test_vectors(**frames); !passed) return tl::unexpected<Error>(passed.error());
  return wire::proof_text(**frames);
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
  const DocumentType type = type_of(json);
  if (type == DocumentType::kUnknown && !named && !json.is_discarded()) return std::nullopt;
  const auto summary = type == DocumentType::kModel    ? of_model(*text, path)
                       : type == DocumentType::kFrames ? of_frames(*text, path)
                                                       : of_configuration(*text, path);
  if (summary) return Finding{path, FileState::kIntact, *summary};
  return Finding{path, FileState::kUnreadable, without_path(summary.error(), path)};
}

}  // namespace prism::verification
