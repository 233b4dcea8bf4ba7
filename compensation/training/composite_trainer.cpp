// SPDX-License-Identifier: MIT
// The composite-kernel IR-LSSVM, dense or over a few centres, with uncertainty parameters from its own record.
#include <algorithm>
#include <cmath>

#include "compensation/extrapolation.hpp"
#include "compensation/training/between_run_error.hpp"
#include "compensation/training/composite_search.hpp"
#include "compensation/training/composite_sparse.hpp"
#include "compensation/training/methods.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kDenseComposite = 3000;  // samples; longer records use a few centres
constexpr Eigen::Index kMaxCompositeRank = 400;
constexpr double kGentleParameter = 3;           // of the weights: a clean record loses almost no data
constexpr double kRowInterval_h = 100.0 / 3600;  // rows without a time: 100 s apart, as in the paper

CompositeSamples samples_of(const NormalisedData& data, const TrainingData& raw) {
  CompositeSamples samples{data.x, data.y, {}, raw.runs, 1};
  const Eigen::Index n = data.y.size();
  if (samples.recording.empty()) samples.recording.assign(static_cast<std::size_t>(n), 0);
  samples.recordings = 1 + *std::max_element(samples.recording.begin(), samples.recording.end());
  samples.time_h = time_of(raw);
  return samples;
}

struct HeldOut {
  Eigen::VectorXd mean, variance;  ///< of each sample, by a model without its fold; normalised, without level
  Eigen::VectorXd level;           ///< the mean of the target in that model's training data
};

double level_of(const CompositeSamples& samples, const Eigen::VectorXd& theta) {
  return compensation::nuisance_level(composite_variances(theta, samples.x.rows()), samples.time_h, samples.recording);
}

// Parameters and weights are fixed: one solve per fold.
std::optional<HeldOut> hold_out(const CompositeSamples& samples, const CompositeFit& fit, const Folds& folds) {
  HeldOut held{samples.y, samples.y, samples.y};
  for (const auto& members : fold_members(folds)) {
    const std::vector<Eigen::Index> rest = others(members, samples.y.size());
    const CompositeSamples seen = samples.part(rest);
    const auto system = CompositeSystem::make(seen, fit.theta, fit.weight(rest));
    if (!system) return std::nullopt;
    Eigen::VectorXd variance;
    held.mean(members) = system->predict(samples.x(Eigen::all, members), &variance);
    held.variance(members) = (variance.array() - level_of(seen, fit.theta)).max(0);
    held.level(members).setConstant(seen.y.mean());
  }
  return held;
}

// r = 1 − Σ ω (y − prediction)² / Σ ω (y − mean of the other half)², each half of the record predicted by the other.
// Returns the worse of both, because the next record may resemble either half. ω = 1 / (1 + v/var_y)²: a half with a
// high uncertainty at a point does not count there.
double skill_of(const CompositeSamples& samples, const CompositeFit& fit) {
  Folds halves(samples.recording.size(), 0);
  for (std::size_t i = halves.size() / 2; i < halves.size(); ++i) halves[i] = 1;
  const auto held = hold_out(samples, fit, halves);
  if (!held) return 0;
  double worst = 1;
  for (const auto& half : fold_members(halves)) {
    const Eigen::ArrayXd y = samples.y(half), knows = (1 + held->variance(half).array()).inverse();
    const Eigen::ArrayXd v = fit.weight(half).array() * knows.square();
    const double missed = (v * (y - held->mean(half).array()).square()).sum(),
                 moved = (v * (y - held->level(half).array()).square()).sum();
    worst = std::min(worst, moved > 0 ? 1 - missed / moved : 0);
  }
  return worst;
}

// Normalised. Cross-conformal (Vovk 2015): blocks of the record, or recordings, each predicted by a model without it;
// the 95 % quantile of |error| / sd_mean, divided by its nominal value of 2. Never below 1, because blocks of one
// record differ less than another run.
compensation::BetweenRunError calibrated(const CompositeSamples& samples, const CompositeFit& fit, double skill) {
  constexpr double kBelievedWeight = 0.3;
  const auto variances = composite_variances(fit.theta, samples.x.rows());
  compensation::BetweenRunError spread;
  spread.nuisance_deg_per_h = std::sqrt(variances.nuisance - level_of(samples, fit.theta) + variances.offset);
  spread.offset_deg_per_h = samples.recordings > 1 ? 0 : compensation::kAssumedOffset;
  spread.noise_deg_per_h = std::sqrt(variances.noise);
  const Folds folds = held_out_folds(samples.recording);
  const auto held = hold_out(samples, fit, folds);
  if (!held || fold_count(folds) < 2) return spread;
  std::vector<double> ratio;
  for (Eigen::Index i = 0; i < samples.y.size(); ++i) {
    if (fit.weight[i] < kBelievedWeight) continue;
    compensation::Prediction served;
    served.bias_deg_per_h = held->mean[i];
    served.mean_deg_per_h = held->level[i];
    served.knowledge = {held->variance[i], 1, skill, 0, spread, true};
    served = compensation::shrunk(served);
    ratio.push_back(std::abs(samples.y[i] - served.bias_deg_per_h) / served.sd_mean_deg_per_h);
  }
  if (ratio.empty()) return spread;
  spread.samples = static_cast<int>(ratio.size());
  spread.blocks = fold_count(folds);
  spread.factor = std::max(1.0, order_statistic(std::move(ratio), 0.95) / 2);
  return spread;
}

double guard_of(const compensation::CompositeModel& model, const CompositeSamples& samples, const TrainingData& raw) {
  const double scale = model.parameters().normalisation.target_scale;
  std::vector<double> values;
  for (const Eigen::Index i : thinned(samples.y.size(), kErrorSamples)) {
    const Eigen::VectorXd x = raw.inputs.col(i);
    const auto known = model.predict({x.data(), static_cast<std::size_t>(x.size())}).knowledge;
    values.push_back(known->model_variance / (scale * scale));
  }
  return std::max(1e-12, kGuardFactor * order_statistic(std::move(values), kGuardQuantile));
}

// Parameters, beta and centres: everything except the uncertainty parameters.
Result<compensation::CompositeParameters> solved(const CompositeSamples& samples, const TrainingSettings& settings,
                                                 bool sparse, Eigen::Index max_rank, CompositeFit& fit,
                                                 TrainedModel& trained) {
  compensation::CompositeParameters p;
  p.variances = composite_variances(fit.theta, samples.x.rows());
  if (sparse) {
    auto found = fit_sparse_composite(samples, fit.theta, settings.reweight, max_rank);
    if (!found) return make_error("composite kernel", "the covariance of the centres is not positive definite");
    p.beta = found->beta;
    p.centres = samples.x(Eigen::all, found->centres);
    p.alpha = found->alpha;
    p.gram = std::move(found->gram);
    fit.weight = std::move(found->weight);
    trained.reweight = std::move(found->reweight);
    trained.samples.alpha = Eigen::VectorXd::Zero(samples.y.size());
    trained.samples.alpha(found->centres) = p.alpha;
    trained.samples.fitted = samples.y - found->residual;
  } else {
    ReweightReport report;
    const auto system = reweighted_system(samples, fit.theta, settings.reweight, fit.weight, report);
    if (!system) return make_error("composite kernel", "the covariance of the samples is not positive definite");
    p.beta = system->beta();
    p.centres = samples.x;
    p.alpha = system->alpha();
    p.weight = fit.weight;
    p.time_h = samples.time_h;
    p.recording = samples.recording;
    trained.reweight = std::move(report);
    trained.samples.alpha = p.alpha;
    trained.samples.fitted = system->predict(samples.x);
  }
  trained.samples.weight = fit.weight;
  trained.centres = static_cast<int>(p.alpha.size());
  return p;
}

}  // namespace

Eigen::VectorXd time_of(const TrainingData& data) {
  const Eigen::Index n = data.target.size();
  if (data.time_s.size() == n) return data.time_s / 3600;
  return Eigen::VectorXd::LinSpaced(n, 0, kRowInterval_h * static_cast<double>(n - 1));
}

namespace {

Result<ResourcePlan> plan_composite(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings) {
  if (samples > kDenseComposite) return plan_sparse(samples, inputs, settings.memory_limit_bytes, kMaxCompositeRank);
  const double n = static_cast<double>(samples), searched = std::min(n, 1000.0);
  ResourcePlan plan;
  plan.bytes = n * n * 5 * 8;  // covariance, its parts, the model's factor
  plan.seconds = (searched * searched * searched * 60 + n * n * n / 3 * 15) / kFlops;
  return within_memory(plan, samples, settings.memory_limit_bytes);
}

Result<TrainedModel> train_composite(TrainingJob job) {
  const auto plan = plan_composite(job.data.inputs.cols(), job.data.inputs.rows(), job.settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto data = job.normalised();
  if (!data) return tl::unexpected<Error>(data.error());
  TrainingSettings settings = job.settings;
  settings.reweight.weight.parameter = settings.parameter.value_or(kGentleParameter);
  const CompositeSamples samples = samples_of(*data, job.data);
  const auto told = [&](int done, int expected, double objective) {
    if (job.progress) job.progress(done, expected, {0, 0, 0, objective});
  };
  auto fit = search_composite(samples, settings.reweight, told, [&] { return job.stop && *job.stop; });
  if (!fit) return tl::unexpected<Error>(fit.error());
  TrainedModel trained;
  auto p = solved(samples, settings, plan->sparse, plan->max_rank, *fit, trained);
  if (!p) return tl::unexpected<Error>(p.error());
  const compensation::Normalisation& n = data->constants;
  trained.samples.fitted = trained.samples.fitted.array() * n.target_scale + n.target_shift;
  p->normalisation = n;
  const std::vector<Eigen::Index> some = thinned(samples.y.size(), kErrorSamples);
  const CompositeSamples subset = samples.part(some);
  const CompositeFit subset_fit{fit->theta, fit->weight(some)};
  p->prior = settings.prior;
  p->trust.skill = skill_of(subset, subset_fit);
  p->trust.level = level_of(samples, fit->theta);
  job.info.spread = calibrated(subset, subset_fit, p->trust.skill);
  for (double* part :
       {&job.info.spread->nuisance_deg_per_h, &job.info.spread->offset_deg_per_h, &job.info.spread->noise_deg_per_h})
    *part *= n.target_scale;
  job.info.kind = "composite";
  const auto first = compensation::CompositeModel::make(job.info, *p);
  if (!first) return tl::unexpected<Error>(first.error());
  p->trust.guard = guard_of(static_cast<const compensation::CompositeModel&>(**first), samples, job.data);
  auto model = compensation::CompositeModel::make(std::move(job.info), std::move(*p));
  if (!model) return tl::unexpected<Error>(model.error());
  trained.model = std::move(*model);
  return trained;
}

}  // namespace

extern const Method kComposite;
const Method kComposite = {"composite",    "default",       kWeights | kOwnSearch | kSiblings,
                           plan_composite, train_composite, describe_composite};

}  // namespace prism::training
