// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <time.h>

#include <cmath>
#include <numbers>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "tools/prismcal/campaign/cpu_level.hpp"
#include "tools/prismcal/commands/campaign_work.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"

namespace prism::commands {
namespace {

constexpr int kMeasuredBlocks = 300;
constexpr double kReport_s = 0.05;      // figures of the page, per recording
constexpr double kStart_s = 0.02;       // start of a process
constexpr double kProcess_mb = 20;      // memory of a process without data
constexpr double kRow_mb = 150e-6;      // memory per row of a recording, for three copies
constexpr double kPolynomial_s = 2e-5;  // per block, if it could not be measured

double cpu_now_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Synthetic blocks of a chamber cycle with a smooth bias.
training::TrainingData synthetic_blocks(const std::vector<std::string>& names) {
  training::TrainingData data;
  const auto d = static_cast<Eigen::Index>(names.size());
  data.names = names;
  data.inputs.resize(d, kMeasuredBlocks);
  data.target.resize(kMeasuredBlocks);
  data.time_s.resize(kMeasuredBlocks);
  std::uint32_t random = 1;
  for (Eigen::Index i = 0; i < kMeasuredBlocks; ++i) {
    const double phase = 2 * std::numbers::pi * 3 * static_cast<double>(i) / kMeasuredBlocks;
    for (Eigen::Index k = 0; k < d; ++k)
      data.inputs(k, i) = std::sin(phase + 1.3 * static_cast<double>(k)) + 0.01 * static_cast<double>(k + i % 7);
    random = random * 1664525 + 1013904223;
    data.target[i] = std::sin(1.5 * data.inputs(0, i)) + 0.1 * (static_cast<double>(random >> 8) / (1 << 24) - 0.5);
    data.time_s[i] = 100.0 * static_cast<double>(i);
    data.runs.push_back(0);
  }
  return data;
}

}  // namespace

CostModel::CostModel(std::string calibration) : file_(std::move(calibration)) {
  const auto text = read_text_file(file_);
  kept_ = text ? Json::parse(*text, nullptr, false) : Json();
  if (!kept_.is_object() || kept_.value("level", "") != campaign::loaded_level())
    kept_ = {{"level", campaign::loaded_level()}, {"models", Json::object()}};
}

Result<double> CostModel::measure(const TrainChoice& choice) const {
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  settings->threads = 1;
  const auto names = recordings::csv_fields(choice.inputs, ',');
  if (auto done = set_terms(choice.method, names, training::second_order_terms(names.size()), {}, *settings); !done)
    return tl::unexpected<Error>(done.error());
  const auto data = synthetic_blocks(names);
  const auto plan = training::plan_resources(kMeasuredBlocks, data.inputs.rows(), *settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  compensation::ModelInfo info;
  info.name = "calibration";
  const double begin_s = cpu_now_s();
  const auto trained = training::train(data, std::move(info), *settings);
  const double elapsed_s = cpu_now_s() - begin_s;
  if (!trained)
    return plan->seconds > 0 ? 1.0 : kPolynomial_s;  // a model that rejects synthetic blocks may accept real ones
  return plan->seconds > 0 ? elapsed_s / plan->seconds : elapsed_s / kMeasuredBlocks;
}

Result<CostModel::Speed> CostModel::speed_of(const campaign::ModelChoice& model) {
  const auto known = speeds_.find(model.words);
  if (known != speeds_.end()) return known->second;
  auto choice = train_choice(model.words);
  if (!choice) return tl::unexpected<Error>(choice.error());
  const std::string key = fmt::format("{}", fmt::join(model.words, " "));
  Json& models = kept_["models"];
  if (!models.contains(key) || !models[key].is_number()) {
    const auto measured = measure(*choice);
    if (!measured) return tl::unexpected<Error>(measured.error());
    models[key] = *measured;
    (void)write_text_file(file_, json_text(kept_, 1) + "\n");  // if this fails, it is measured again
  }
  const Speed speed{std::move(*choice), models[key].get<double>()};
  return speeds_.emplace(model.words, speed).first->second;
}

double CostModel::read_s_per_row() { return 1.6e-6; }

Result<campaign::Cost> CostModel::cost(const campaign::Task& task, std::uint64_t training_s, std::uint64_t test_s) {
  const auto speed = speed_of(task.model);
  if (!speed) return tl::unexpected<Error>(speed.error());
  auto settings = settings_of(speed->choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  const auto inputs = static_cast<Eigen::Index>(recordings::csv_fields(speed->choice.inputs, ',').size());
  const auto blocks = static_cast<Eigen::Index>(training_s) / std::max(1, speed->choice.recordings.features.length_s);
  const auto plan = training::plan_resources(std::max<Eigen::Index>(1, blocks), inputs, *settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  const double train_s = speed->factor * (plan->seconds > 0 ? plan->seconds : static_cast<double>(blocks));
  const double rows = static_cast<double>(training_s + test_s);
  const auto tests = static_cast<double>(task.inputs.size() - task.paths(campaign::Role::kTrain).size());
  return campaign::Cost{kStart_s + train_s + rows * read_s_per_row() + (task.report ? tests * kReport_s : 0),
                        kProcess_mb + plan->bytes / 1e6 + rows * kRow_mb};
}

}  // namespace prism::commands
