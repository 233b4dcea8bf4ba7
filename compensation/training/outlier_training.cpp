// SPDX-License-Identifier: MIT
#include "compensation/training/outlier_training.hpp"

#include <fmt/format.h>

#include "compensation/training/folds.hpp"
#include "compensation/training/gross_outliers.hpp"

namespace prism::training {
namespace {

TrainingData part_of(const TrainingData& data, const std::vector<Eigen::Index>& kept) {
  TrainingData part{data.names, data.inputs(Eigen::all, kept), data.target(kept), {}, {}};
  if (!data.runs.empty()) part.runs = numbered(taken(data.runs, kept));
  if (data.time_s.size() == data.target.size()) part.time_s = data.time_s(kept);
  return part;
}

SampleDiagnostics with_left_out(const SampleDiagnostics& kept, const std::vector<Eigen::Index>& rest,
                                const TrainingData& data, const compensation::Model& model) {
  SampleDiagnostics all{data.target, Eigen::VectorXd::Zero(data.target.size()), data.target, data.target};
  for (Eigen::Index i = 0; i < data.target.size(); ++i) {
    const Eigen::VectorXd x = data.inputs.col(i);
    all.fitted[i] = model.bias_deg_per_h({x.data(), static_cast<std::size_t>(x.size())});
  }
  all.leave_one_out = data.target - all.fitted;
  all.alpha.setZero();
  const auto place = [&](const Eigen::VectorXd& from, Eigen::VectorXd& to) {
    if (from.size() > 0)
      to(rest) = from;
    else
      to.resize(0);
  };
  place(kept.alpha, all.alpha);
  place(kept.weight, all.weight);
  place(kept.fitted, all.fitted);
  place(kept.leave_one_out, all.leave_one_out);
  return all;
}

}  // namespace

// Robust weights start from the residuals of an unweighted fit, which a gross outlier moves without limit: such rows
// are left out first. Without them the start is the paper's.
Result<TrainedModel> train_without(const std::vector<Eigen::Index>& far, const TrainingData& data,
                                   compensation::ModelInfo info, const TrainingSettings& wanted,
                                   const TuningProgress& progress, const std::atomic<bool>* stop) {
  constexpr Eigen::Index kMostShare = 4;
  const Eigen::Index n = data.target.size();
  if (static_cast<Eigen::Index>(far.size()) * kMostShare > n)
    return make_error("training data",
                      fmt::format("found {} of {} rows far from all others, expected at most a quarter: "
                                  "rows {}",
                                  far.size(), n, rows_text(far)));
  const std::vector<Eigen::Index> rest = others(far, n);
  TrainingSettings settings = wanted;
  if (wanted.given_folds) settings.given_folds = numbered(taken(*wanted.given_folds, rest));
  const bool divided = wanted.tuning == Tuning::kBlocked || wanted.tuning == Tuning::kShuffled;
  if (divided) settings.second_folds = numbered(taken(folds_of(data, wanted), rest));
  auto trained = train_checked(part_of(data, rest), std::move(info), settings, progress, stop);
  if (!trained) return trained;
  trained->samples = with_left_out(trained->samples, rest, data, *trained->model);
  for (Eigen::Index& sample : trained->held_out.samples) sample = rest[static_cast<std::size_t>(sample)];
  trained->notes.push_back(
      fmt::format("{} of {} rows are far from all others and were left out: rows {}", far.size(), n, rows_text(far)));
  return trained;
}

}  // namespace prism::training
