// SPDX-License-Identifier: MIT
#include "compensation/training/methods.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace prism::training {

extern const Method kComposite, kLeastSquares, kStepwise, kLssvm, kIrlssvm,
    kSvr;  // defined in the files of their trainers

namespace {

constexpr const Method* kMethods[] = {&kComposite, &kLeastSquares, &kStepwise, &kLssvm, &kIrlssvm, &kSvr};

std::string joined(const std::vector<std::string>& words, const char* last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : i + 1 == words.size() ? last : ", ") + words[i];
  return text;
}

}  // namespace

std::span<const Method* const> methods() { return kMethods; }

const Method* find_method(std::string_view name) {
  const auto found = std::find_if(std::begin(kMethods), std::end(kMethods),
                                  [&](const Method* method) { return name == method->name; });
  return found == std::end(kMethods) ? nullptr : *found;
}

const Method& default_method(bool tuned) { return tuned ? kIrlssvm : *kMethods[0]; }

Result<const Method*> parse_method(std::string_view name) {
  if (const Method* found = find_method(name)) return found;
  return make_error("method", fmt::format("found \"{}\", expected {}", name, method_names(0, " or ")));
}

std::string method_names(unsigned uses, const char* last) {
  std::vector<std::string> names;
  for (const Method* method : kMethods) {
    if (uses == 0 || (method->uses & uses) != 0) names.emplace_back(method->name);
  }
  return joined(names, last);
}

std::string method_help() {
  std::vector<std::string> names;
  for (const Method* method : kMethods)
    names.push_back(*method->help ? fmt::format("{} ({})", method->name, method->help) : method->name);
  return joined(names, " or ");
}

}  // namespace prism::training
