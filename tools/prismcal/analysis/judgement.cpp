// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/judgement.hpp"

#include <fmt/format.h>

namespace prism::analysis {

Result<Judgement> judge(const compensation::Model& model, const recordings::BlockTable& table,
                        evaluation::Divisor divisor) {
  const compensation::ModelInfo& info = model.info();
  if (!(info.features == table.features)) {
    return refuse(table.name, fmt::format("its blocks were not made by the features of model \"{}\"", info.name));
  }
  Judgement result;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::vector<double> inputs = compensation::gather_inputs(model, table.blocks[i]);
    if (inputs.empty()) {
      return refuse(table.name, fmt::format("block {} does not carry an input of model \"{}\" ({})", i, info.name,
                                            fmt::join(info.inputs, ", ")));
    }
    const compensation::Prediction prediction = model.predict(inputs);
    result.predicted_deg_per_h.push_back(prediction.bias_deg_per_h);
    result.corrected_deg_per_h.push_back(table.bias_deg_per_h[i] - prediction.bias_deg_per_h);
    result.sd_deg_per_h.push_back(prediction.sd_deg_per_h);
    result.extrapolating.push_back(prediction.extrapolating);
    result.extrapolated += prediction.extrapolating;
  }
  auto stability = evaluation::measure_bias_stability(table.bias_deg_per_h, result.corrected_deg_per_h, table.follows,
                                                      divisor, table.name);
  if (!stability) return tl::unexpected(stability.error());
  result.stability = *stability;
  return result;
}

std::vector<double> corrected_seconds(const Judgement& judgement, const recordings::BlockTable& table) {
  std::vector<double> result(table.second.size(), kUnknown);
  std::size_t i = 0;
  for (std::size_t block = 0; block < table.size(); ++block) {
    const std::int64_t end = table.blocks[block].bucket.second;
    while (i < table.second.size() && table.second[i] <= end - table.features.length_s) ++i;
    for (; i < table.second.size() && table.second[i] <= end; ++i) {
      result[i] = table.second_bias_deg_per_h[i] - judgement.predicted_deg_per_h[block];
    }
  }
  return result;
}

}  // namespace prism::analysis
