// SPDX-License-Identifier: MIT
#include "compensation/model_types.hpp"

namespace prism::compensation {
namespace {

constexpr ModelKind kKinds[] = {
    {"polynomial", read_polynomial, polynomial_content},
    {"stepwise", read_polynomial, polynomial_content},
    {"lssvm", read_lssvm, lssvm_content},
    {"ir_lssvm", read_lssvm, lssvm_content},
    {"sparse_lssvm", read_lssvm, lssvm_content},
    {"svr", read_lssvm, lssvm_content},
    {"composite", read_composite, composite_content},
};

}  // namespace

const ModelKind* find_model_kind(std::string_view name) {
  for (const ModelKind& kind : kKinds) {
    if (name == kind.name) return &kind;
  }
  return nullptr;
}

std::string model_kind_names() {
  std::string names;
  for (const ModelKind& kind : kKinds) names += std::string(names.empty() ? "" : ", ") + '"' + kind.name + '"';
  return names;
}

}  // namespace prism::compensation
