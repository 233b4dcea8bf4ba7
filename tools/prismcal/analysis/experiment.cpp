// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>

#include "compensation/training/parallel.hpp"

namespace prism::analysis {
namespace {

constexpr const char* kT = compensation::kInputTemperature;
constexpr const char* kR = compensation::kInputSlope;
constexpr const char* kU = compensation::kInputUhfo;

bool needs_uhfo(const ModelSpec& spec) {
  return std::find(spec.inputs.begin(), spec.inputs.end(), kU) != spec.inputs.end();
}

Result<ExperimentRow> make_row(const ExperimentData& data, const ModelSpec& spec, evaluation::Divisor divisor,
                               const Trainer& train) {
  const auto begin = std::chrono::steady_clock::now();
  auto trained = train(data.training, spec);
  if (!trained) return make_error(spec.key(), trained.error().text());
  trained->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  auto fitted = evaluate_model(trained->model, data.training, data.correction, divisor);
  if (!fitted) return tl::unexpected(fitted.error());
  ExperimentRow row{spec, std::move(*trained), std::move(*fitted), {}};
  for (const recordings::BlockTable& table : data.evaluated) {
    auto evaluated = evaluate_model(row.trained.model, table, data.correction, divisor);
    if (!evaluated) return tl::unexpected(evaluated.error());
    row.evaluations.push_back(std::move(*evaluated));
  }
  return row;
}

}  // namespace

std::string ModelSpec::key() const {
  std::string text = fmt::format("{} {}", method, fmt::join(inputs, ","));
  if (!weight.empty()) text += " " + weight;
  if (!tune.empty()) text += " " + tune;
  return text;
}

std::string ModelSpec::inputs_text() const {
  std::string text;
  for (const std::string& input : inputs) {
    text += (text.empty() ? "" : ", ") + (input == compensation::kInputSlope ? std::string("dT/dt") : input);
  }
  return text;
}

const ExperimentRow* Experiment::find(const std::string& key) const {
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](const ExperimentRow& row) { return row.spec.key() == key; });
  return found == rows.end() ? nullptr : &*found;
}

std::vector<ModelSpec> paper_models(bool with_uhfo) {
  const std::vector<std::vector<std::string>> singles = {{kT}, {kR}, {kU}};
  const std::vector<std::vector<std::string>> composites = {{kT, kR}, {kT, kU}, {kR, kU}, {kT, kR, kU}};
  const std::vector<std::string> weights = {"huber", "hampel", "logistic", "myriad"};
  std::vector<ModelSpec> specs;
  for (const auto& inputs : singles) specs.push_back({"ls", inputs, "", ""});
  specs.push_back({"stepwise", {kT, kR}, "", ""});
  specs.push_back({"stepwise", {kT, kR, kU}, "", ""});
  for (const auto* group : {&singles, &composites}) {
    for (const auto& inputs : *group) {
      for (const auto& weight : weights) specs.push_back({"ir-lssvm", inputs, weight, "shuffled"});
    }
  }
  const std::vector<std::string> all = with_uhfo ? composites.back() : composites.front();
  for (const char* tune : {"loo", "shuffled", "blocked", "reml"}) specs.push_back({"lssvm", all, "", tune});
  for (const auto& weight : weights) specs.push_back({"ir-lssvm", all, weight, "blocked"});
  for (const auto& weight : weights) specs.push_back({"ir-lssvm", all, weight, "reml"});
  if (!with_uhfo) std::erase_if(specs, needs_uhfo);
  return specs;
}

std::vector<ModelSpec> ladder_models(bool with_uhfo) {
  std::vector<ModelSpec> specs = paper_models(with_uhfo);
  const std::size_t most = with_uhfo ? 3 : 2;
  std::erase_if(specs, [=](const ModelSpec& spec) {
    const bool tuned = !spec.tune.empty();
    const bool other_weight = !spec.weight.empty() && spec.weight != kUsualWeight;
    return tuned && (spec.inputs.size() != most || other_weight);
  });
  return specs;
}

Result<Experiment> run_experiment(ExperimentData data, const std::vector<ModelSpec>& specs, evaluation::Divisor divisor,
                                  const Trainer& train,
                                  const std::function<void(std::size_t, std::size_t, const std::string&)>& progress,
                                  int threads) {
  Experiment experiment{std::move(data), divisor, {}};
  std::vector<std::optional<ExperimentRow>> rows(specs.size());
  std::optional<Error> first_error;
  std::size_t done = 0;
  std::mutex mutex;
  training::parallel_for(static_cast<int>(specs.size()), threads, [&](int number) {
    const auto i = static_cast<std::size_t>(number);
    {
      const std::lock_guard lock(mutex);
      if (first_error) return;
      if (progress) progress(done, specs.size(), specs[i].key());
    }
    auto row = make_row(experiment.data, specs[i], divisor, train);
    const std::lock_guard lock(mutex);
    if (!row) {
      if (!first_error) first_error = row.error();
      return;
    }
    rows[i] = std::move(*row);
    ++done;
  });
  if (first_error) return tl::unexpected(*first_error);
  for (auto& row : rows) experiment.rows.push_back(std::move(*row));
  if (progress) progress(specs.size(), specs.size(), "done");
  return experiment;
}

}  // namespace prism::analysis
