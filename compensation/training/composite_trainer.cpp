// SPDX-License-Identifier: MIT
// The composite-kernel IR-LSSVM, dense or over a few centres, with uncertainty parameters from its own record.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/training/composite.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/robust.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

constexpr double kWarmUpVariance = 0.5;  // of the target's; a weak prior of one coefficient
constexpr double kGentleParameter = 3;   // of the weights: a clean record loses almost no data

// Several long recordings show what each switch-on repeats: without a term of its own it would count as thermal, since
// it repeats at the same temperatures.
bool shows_warm_up(const CompositeSamples& samples) {
  constexpr double kLong_h = 8;
  const std::vector<Rows> recordings = fold_members(samples.recording);
  const auto is_long = [&](const Rows& rows) { return !rows.empty() && samples.time_h[rows.back()] >= kLong_h; };
  return recordings.size() > 1 && std::all_of(recordings.begin(), recordings.end(), is_long);
}

// 1 for the rows that the weights do not take for outliers, else 0: only they judge the model.
Eigen::ArrayXd believed(const Eigen::VectorXd& weight) { return (weight.array() >= kBelievedWeight).cast<double>(); }

double believed_mean(const Eigen::ArrayXd& values, const Eigen::VectorXd& weight) {
  const Eigen::ArrayXd counts = believed(weight);
  return counts.sum() > 0 ? (counts * values).sum() / counts.sum() : values.mean();
}

// Uncertainty and the cost of shrinkage are relative to the variance of the target: outliers must not enlarge it.
void rescale(CompositeSamples& samples, CompositeFit& fit, compensation::Normalisation& constants) {
  const double level = believed_mean(samples.y, fit.weight), scale = believed_sd(samples.y, fit.weight);
  samples.y = (samples.y.array() - level) / scale;
  constants.target_shift += level * constants.target_scale;
  constants.target_scale *= scale;
  auto v = composite_variances(fit.theta, samples.x.rows());
  for (double* variance :
       {&v.kernel.rbf, &v.kernel.linear, &v.kernel.quadratic, &v.nuisance, &v.noise, &v.offset, &samples.warm_up})
    *variance /= scale * scale;
  fit.theta = composite_theta(v, samples.recordings > 1);
}

struct HeldOut {
  Eigen::VectorXd mean, variance;  ///< of each sample, by a model without its fold; normalised, without level
  Eigen::VectorXd level;           ///< the mean of the target in that model's training data, without outliers
};

double level_of(const CompositeSamples& samples, const Eigen::VectorXd& theta) {
  return compensation::nuisance_level(composite_variances(theta, samples.x.rows()), samples.time_h, samples.recording);
}

// Parameters and weights are fixed: one solve per fold.
std::optional<HeldOut> hold_out(const CompositeSamples& samples, const CompositeFit& fit, const Folds& folds) {
  HeldOut held{samples.y, samples.y, samples.y};
  held.mean = held_out(folds, [&](const Rows& rest, const Rows& members) -> Eigen::VectorXd {
    const CompositeSamples seen = samples.part(rest);
    const auto system = CompositeSystem::make(seen, fit.theta, fit.weight(rest));
    if (!system) return {};
    Eigen::VectorXd variance, mean = system->predict(samples.x(Eigen::all, members), &variance);
    held.variance(members) = (variance.array() - level_of(seen, fit.theta)).max(0);
    held.level(members).setConstant(believed_mean(seen.y, fit.weight(rest)));
    return mean;
  });
  if (held.mean.size() == 0) return std::nullopt;
  return held;
}

// How one half of the record predicts the other: skill and overlap.
// r = 1 − Σ ω (y − prediction)² / Σ ω (y − mean of the other half)², each half of the record predicted by the other.
// Returns the half that says less for the model, because the next record may resemble either. ω = 1 / (1 + v/var_y)²: a
// half with a high uncertainty at a point does not count there; overlap is the mean of √ω. Rows that the weights take
// for outliers do not count: an error that no model can predict lowers r.
compensation::UncertaintySettings trust_of(const CompositeSamples& samples, const CompositeFit& fit) {
  Folds halves(samples.recording.size(), 0);
  for (std::size_t i = halves.size() / 2; i < halves.size(); ++i) halves[i] = 1;
  const auto held = hold_out(samples, fit, halves);
  compensation::UncertaintySettings worst, half_trust;
  if (!held) worst.skill = 0;
  if (!held) return worst;
  for (const auto& half : fold_members(halves)) {
    const Eigen::ArrayXd y = samples.y(half), knows = (1 + held->variance(half).array()).inverse();
    const Eigen::ArrayXd v = believed(fit.weight(half)) * fit.weight(half).array() * knows.square();
    const double missed = (v * (y - held->mean(half).array()).square()).sum(),
                 moved = (v * (y - held->level(half).array()).square()).sum();
    half_trust.skill = moved > 0 ? 1 - missed / moved : 0;
    half_trust.overlap = knows.mean();
    if (compensation::evidence_of(half_trust.skill, half_trust.overlap) <
        compensation::evidence_of(worst.skill, worst.overlap))
      worst = half_trust;
  }
  return worst;
}

// The noise variance of the rows that the weights do not take for outliers, as a share of that of the likelihood, to
// which an outlier adds up to ten times the square of the scale. 1 without outliers.
double believed_noise(const CompositeSamples& samples, const CompositeFit& fit) {
  if ((believed(fit.weight) == 1).all()) return 1;
  const auto system = CompositeSystem::make(samples, fit.theta, fit.weight);
  if (!system) return 1;
  const Eigen::ArrayXd square = fit.weight.array() * system->residual().array().square();
  return std::min(1.0, believed_mean(square, fit.weight) / square.mean());
}

// Normalised. Cross-conformal (Vovk 2015): blocks of the record, or recordings, each predicted by a model without it;
// the 95 % quantile of |error| / sd_mean, divided by its nominal value of 2. Never below 1, because blocks of one
// record differ less than another run.
// `errors`: those of the predictions that prismd would use; without their samples.
compensation::BetweenRunError calibrated(const CompositeSamples& samples, const CompositeFit& fit,
                                         const compensation::UncertaintySettings& trust, HeldOutErrors& errors) {
  const auto variances = composite_variances(fit.theta, samples.x.rows());
  compensation::BetweenRunError spread;
  const double drift = variances.nuisance - level_of(samples, fit.theta);
  spread.nuisance_deg_per_h = std::sqrt(drift + variances.offset);
  if (samples.recordings == 1) {
    const double assumed = compensation::kAssumedOffset;
    spread.offset_deg_per_h = std::sqrt(assumed * assumed + kDaysDiffer * drift);
  }
  spread.noise_deg_per_h = std::sqrt(variances.noise * believed_noise(samples, fit));
  const Folds folds = held_out_folds(samples.recording);
  const auto held = hold_out(samples, fit, folds);
  if (!held || fold_count(folds) < 2) return spread;
  errors = {samples.y, held->variance, folds, {}};
  std::vector<double> ratio;
  for (Eigen::Index i = 0; i < samples.y.size(); ++i) {
    compensation::Prediction served;
    served.bias_deg_per_h = held->mean[i];
    served.mean_deg_per_h = held->level[i];
    served.knowledge = {held->variance[i], 1, trust.skill, 0, spread, true, trust.overlap, {}};
    served = compensation::shrunk(served);
    errors.error[i] -= served.bias_deg_per_h;
    if (fit.weight[i] < kBelievedWeight) continue;
    ratio.push_back(std::abs(samples.y[i] - served.bias_deg_per_h) / served.sd_mean_deg_per_h);
  }
  if (ratio.empty()) return spread;
  spread.samples = static_cast<int>(ratio.size());
  spread.blocks = fold_count(folds);
  spread.factor = std::max(1.0, order_statistic(std::move(ratio), 0.95) / 2);
  return spread;
}

double guard_for(const compensation::Model& model, const TrainingData& raw, double scale) {
  std::vector<double> values;
  for (const Eigen::Index i : thinned(raw.inputs.cols(), kErrorSamples))
    values.push_back(model.predict(column(raw.inputs, i)).knowledge->model_variance / (scale * scale));
  return std::max(1e-12, guard_of(std::move(values), 0));
}

// Shares of the inputs in the mean squared gradient of the bias, each in standard deviations.
std::vector<double> relevance_of(const compensation::Model& model, const TrainingData& raw) {
  constexpr Eigen::Index kSlopes = 300;
  constexpr double kStep = 1e-3;
  const Eigen::Index d = raw.inputs.rows();
  const Rows some = thinned(raw.inputs.cols(), kSlopes);
  std::vector<double> square(static_cast<std::size_t>(d), 0.0);
  for (Eigen::Index j = 0; j < d; ++j) {
    const Eigen::ArrayXd column = raw.inputs.row(j).transpose();
    const double step = kStep * std::sqrt((column - column.mean()).square().mean());
    for (const Eigen::Index i : some) {
      Eigen::VectorXd x = raw.inputs.col(i);
      const auto bias_at = [&](double value) {
        x[j] = value;
        return model.bias_deg_per_h(std::span(x.data(), static_cast<std::size_t>(d)));
      };
      square[static_cast<std::size_t>(j)] += std::pow(bias_at(column[i] + step) - bias_at(column[i] - step), 2);
    }
  }
  const double sum = std::accumulate(square.begin(), square.end(), 0.0);
  for (double& share : square) share = sum > 0 ? share / sum : 1 / static_cast<double>(d);
  return square;
}

}  // namespace

// Centre and weight on the simulated truths and the chamber splits (docs/benchmarks.md); kNone: as good as zero.
DriftPrior drift_prior(Drift drift) {
  if (drift == Drift::kThermal) return {0.25, std::log(0.05)};
  return drift == Drift::kNone ? DriftPrior{100, std::log(1e-6)} : DriftPrior{};
}

// All 1 on clean gyros, if more than a quarter of the rows are far, and if the
// 65 neighbours are more than a third of the record, because then ramps are far.
Eigen::VectorXd first_weights(const TrainingData& data, const TrainingSettings& settings) {
  constexpr Eigen::Index kMostShare = 4, kFewestRows = 195;
  const Eigen::Index n = data.target.size();
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
  if (n < kFewestRows || settings.reweight.weight.kind == WeightKind::kNone) return weight;
  const Rows suspects = gross_outliers(data.inputs, data.target, runs_of(data), kSuspect);
  if (static_cast<Eigen::Index>(suspects.size()) * kMostShare <= n) weight(suspects).setConstant(kMinCompositeWeight);
  return weight;
}

bool one_passage(const TrainingData& raw) {
  constexpr Eigen::Index kPieces = 20;
  constexpr double kStraight = 0.75;
  const Eigen::Index n = raw.inputs.cols();
  if ((!raw.runs.empty() && raw.runs.back() > raw.runs.front()) || n < 2 * kPieces) return false;
  const auto named = std::find(raw.names.begin(), raw.names.end(), compensation::kInputTemperature);
  const Eigen::VectorXd t = raw.inputs.row(named == raw.names.end() ? 0 : named - raw.names.begin());
  Eigen::VectorXd mean(kPieces);
  for (Eigen::Index k = 0; k < kPieces; ++k) {
    const Eigen::Index begin = k * n / kPieces, end = (k + 1) * n / kPieces;
    mean[k] = t.segment(begin, end - begin).mean();
  }
  const double path = (mean.tail(kPieces - 1) - mean.head(kPieces - 1)).cwiseAbs().sum();
  return path > 0 && mean.maxCoeff() - mean.minCoeff() > kStraight * path;
}

Result<TrainedModel> train_composite(TrainingJob job) {
  auto data = normalise(job.data, job.settings.scaling);
  if (!data) return tl::unexpected<Error>(data.error());
  TrainingSettings settings = job.settings;
  settings.reweight.weight.parameter = settings.parameter.value_or(kGentleParameter);
  CompositeSamples samples{data->x, data->y, time_of(job.data), job.runs, fold_count(job.runs), 0};
  if (!job.plan.sparse && shows_warm_up(samples)) samples.warm_up = kWarmUpVariance;
  auto fit = search_composite(samples, settings.reweight, drift_prior(settings.drift), settings,
                              first_weights(job.data, job.settings));
  if (!fit) return tl::unexpected<Error>(fit.error());
  const auto solved = [&] {
    return job.plan.sparse ? solve_sparse_composite(samples, fit->theta, settings.reweight, job.plan.max_rank)
                           : solve_composite(samples, fit->theta, fit->weight, settings.reweight);
  };
  auto solution = solved();
  TrainedModel trained;
  if (solution) trained.reweight = solution->reweight;
  if (solution && (believed(solution->weight) == 0).any()) {
    fit->weight = solution->weight;
    rescale(samples, *fit, data->constants);
    solution = solved();
  }
  if (!solution) return make_error("composite kernel", "the covariance of the samples is not positive definite");
  const compensation::Normalisation& n = data->constants;
  compensation::CompositeParameters& p = solution->parameters;
  p.normalisation = n;
  p.prior = settings.prior;
  fit->weight = solution->weight;
  trained.samples = {Eigen::VectorXd::Zero(samples.y.size()),
                     solution->weight,
                     solution->fitted.array() * n.target_scale + n.target_shift,
                     {}};
  trained.samples.alpha(solution->centres) = p.alpha;
  trained.centres = static_cast<int>(p.alpha.size());
  const Rows some = thinned(samples.y.size(), kErrorSamples);
  const CompositeSamples subset = samples.part(some);
  const CompositeFit subset_fit{fit->theta, fit->weight(some)};
  p.trust = trust_of(subset, subset_fit);
  p.trust.level = level_of(samples, fit->theta);
  job.info.spread = calibrated(subset, subset_fit, p.trust, trained.held_out);
  trained.held_out.error *= n.target_scale;
  trained.held_out.model_variance *= n.target_scale * n.target_scale;
  if (trained.held_out.error.size() > 0) trained.held_out.samples = some;
  for (double* part :
       {&job.info.spread->nuisance_deg_per_h, &job.info.spread->offset_deg_per_h, &job.info.spread->noise_deg_per_h})
    *part *= n.target_scale;
  job.info.kind = "composite";
  const auto first = compensation::CompositeModel::make(job.info, p);
  if (!first) return tl::unexpected<Error>(first.error());
  p.trust.relevance = relevance_of(**first, job.data);
  p.trust.guard = guard_for(**first, job.data, n.target_scale);
  auto model = compensation::CompositeModel::make(std::move(job.info), std::move(p));
  if (!model) return tl::unexpected<Error>(model.error());
  trained.model = std::move(*model);
  if (settings.drift == Drift::kThermal && one_passage(job.data))
    trained.notes.emplace_back(
        "one passage through the temperatures: thermal drift and drift in time cannot be separated; assumed mostly "
        "thermal; a second cycle would decide (--drift states what you know)");
  return trained;
}

// A short record with a population prior: models of gyros of the same type give the shape, the record its scale.

namespace {

constexpr double kScaleSpread = 0.3;  // prior sd of one gyro's drift over that of another of the same type
constexpr Eigen::Index kScaleSamples = 1000;

Result<void> check_siblings(const TrainingData& data, const compensation::ModelInfo& info,
                            const TrainingSettings& settings) {
  if (!settings.method->has(kSiblings))
    return make_error(
        "prior", fmt::format("found method {}, expected {}", settings.method->name, method_names(kSiblings, " or ")));
  if (settings.siblings.size() < 2)
    return make_error("prior", fmt::format("found {} models, expected at least 2", settings.siblings.size()));
  for (const compensation::ModelPtr& sibling : settings.siblings) {
    const compensation::ModelInfo& other = sibling->info();
    const std::string who = fmt::format("prior, model {:.12} of {}", other.id, other.gyro_serial);
    if (other.inputs != data.names)
      return make_error(
          who, fmt::format("found inputs {}, expected {}", fmt::join(other.inputs, ","), fmt::join(data.names, ",")));
    if (other.features != info.features || other.table != info.table)
      return make_error(who, "has different features: window, slope or response");
    if (other.domain.min.empty()) return make_error(who, "contains no ranges of its inputs");
  }
  return {};
}

compensation::PopulationPrior prior_of(const TrainingData& data, const std::vector<compensation::ModelPtr>& siblings) {
  compensation::PopulationPrior prior{1, siblings, {}};
  for (const compensation::ModelPtr& sibling : siblings) {
    double sum = 0;
    for (Eigen::Index i = 0; i < data.inputs.cols(); ++i)
      sum += sibling->bias_deg_per_h(compensation::nearest_in_box(*sibling, column(data.inputs, i)));
    prior.levels.push_back(sum / static_cast<double>(data.inputs.cols()));
  }
  return prior;
}

Eigen::VectorXd said(const compensation::PopulationPrior& prior, const Eigen::MatrixXd& inputs) {
  Eigen::VectorXd mean(inputs.cols());
  for (Eigen::Index i = 0; i < inputs.cols(); ++i) mean[i] = prior.at(column(inputs, i)).mean_deg_per_h;
  return mean;
}

// Generalised least squares for y = beta + scale · m + f + n + e with a normal prior about 1 for scale: with P = C⁻¹
// minus its level, (mᵀP(y − m)) / (mᵀPm + 1/spread²), C from the first training.
double scale_of(const TrainingData& data, const Eigen::VectorXd& m, const TrainedModel& first) {
  const auto& p = static_cast<const compensation::CompositeModel&>(*first.model).parameters();
  const Rows some = thinned(m.size(), kScaleSamples);
  const double scale = p.normalisation.target_scale;
  CompositeSamples samples{normalised_inputs(data.inputs(Eigen::all, some), p.normalisation),
                           (data.target(some) - m(some)) / scale,
                           time_of(data)(some),
                           taken(runs_of(data), some),
                           1,
                           p.variances.warm_up};
  const Eigen::VectorXd theta = composite_theta(p.variances, p.variances.offset > 0);
  const Eigen::VectorXd weight = first.samples.weight(some);
  const auto own = CompositeSystem::make(samples, theta, weight);
  samples.y = m(some) / scale;
  const auto theirs = CompositeSystem::make(samples, theta, weight);
  if (!own || !theirs) return 1;
  const double information = samples.y.dot(theirs->alpha()) + 1 / (kScaleSpread * kScaleSpread);
  return std::clamp(1 + samples.y.dot(own->alpha()) / information, 0.1, 10.0);
}

}  // namespace

Result<TrainedModel> train_with_siblings(const TrainingData& data, compensation::ModelInfo info,
                                         const TrainingSettings& wanted) {
  if (auto good = check_siblings(data, info, wanted); !good) return tl::unexpected<Error>(good.error());
  TrainingSettings settings = wanted;
  settings.siblings.clear();
  settings.prior = prior_of(data, wanted.siblings);
  const Eigen::VectorXd m = said(*settings.prior, data.inputs);
  TrainingData rest = data;
  rest.target = data.target - m;
  // train() has left out gross outliers: a second search would number the rows of the rest.
  auto trained = train_checked(rest, info, settings);
  if (!trained) return trained;
  settings.prior->scale = scale_of(data, m, *trained);
  rest.target = data.target - settings.prior->scale * m;
  trained = train_checked(rest, std::move(info), settings);
  if (!trained) return trained;
  trained->samples.fitted += settings.prior->scale * m;
  const auto square = [](const Eigen::VectorXd& v) { return (v.array() - v.mean()).square().sum(); };
  const double moved = square(data.target);
  trained->from_siblings = moved > 0 ? 1 - square(rest.target) / moved : 0;
  return trained;
}

}  // namespace prism::training
