// SPDX-License-Identifier: MIT
// The composite-kernel IR-LSSVM, dense or over a few centres, with uncertainty parameters from its own record.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/training/composite.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/gross_outliers.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kDenseComposite = 3000;  // samples; longer records use a few centres
constexpr Eigen::Index kMaxCompositeRank = 400;
constexpr double kWarmUpVariance = 0.5;  // of the target's; a weak prior of one coefficient
constexpr double kGentleParameter = 3;   // of the weights: a clean record loses almost no data

// Several long recordings show what each switch-on repeats: without a term of its own it would count as thermal, since
// it repeats at the same temperatures.
bool shows_warm_up(const CompositeSamples& samples) {
  constexpr double kLong_h = 8;
  if (samples.recordings < 2 || samples.y.size() > kDenseComposite) return false;
  std::vector<double> last(static_cast<std::size_t>(samples.recordings), 0.0);
  for (std::size_t i = 0; i < samples.recording.size(); ++i) {
    double& end = last[static_cast<std::size_t>(samples.recording[i])];
    end = std::max(end, samples.time_h[static_cast<Eigen::Index>(i)]);
  }
  return *std::min_element(last.begin(), last.end()) >= kLong_h;
}

CompositeSamples samples_of(const NormalisedData& data, const TrainingData& raw) {
  CompositeSamples samples{data.x, data.y, {}, runs_of(raw), 1, 0};
  samples.recordings = 1 + *std::max_element(samples.recording.begin(), samples.recording.end());
  samples.time_h = time_of(raw);
  if (shows_warm_up(samples)) samples.warm_up = kWarmUpVariance;
  return samples;
}

// Centre and weight on the simulated truths and the chamber splits (docs/benchmarks.md); kNone: as good as zero.
DriftPrior drift_prior(Drift drift) {
  switch (drift) {
    case Drift::kThermal:
      return {0.25, std::log(0.05)};
    case Drift::kNone:
      return {100, std::log(1e-6)};
    default:
      return {};
  }
}

// First weights: as good as none for rows far from their neighbours, so that no drift in time is found
// that follows them. All 1 on clean gyros, if more than a quarter of the rows are far, and if the
// 65 neighbours are more than a third of the record, because then ramps are far.
Eigen::VectorXd first_weights(const TrainingData& data) {
  constexpr Eigen::Index kMostShare = 4, kFewestRows = 195;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(data.target.size());
  if (data.target.size() < kFewestRows) return weight;
  const auto suspects = gross_outliers(data.inputs, data.target, runs_of(data), kSuspect);
  if (static_cast<Eigen::Index>(suspects.size()) * kMostShare <= data.target.size())
    weight(suspects).setConstant(kMinCompositeWeight);
  return weight;
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

/// How one half of the record predicts the other.
struct Skill {
  double score = 1, overlap = 1;
};

// r = 1 − Σ ω (y − prediction)² / Σ ω (y − mean of the other half)², each half of the record predicted by the other.
// Returns the half that says less for the model, because the next record may resemble either. ω = 1 / (1 + v/var_y)²: a
// half with a high uncertainty at a point does not count there; overlap is the mean of √ω. Rows that the weights take
// for outliers do not count: an error that no model can predict lowers r.
Skill skill_of(const CompositeSamples& samples, const CompositeFit& fit) {
  Folds halves(samples.recording.size(), 0);
  for (std::size_t i = halves.size() / 2; i < halves.size(); ++i) halves[i] = 1;
  const auto held = hold_out(samples, fit, halves);
  if (!held) return {0, 1};
  Skill worst;
  for (const auto& half : fold_members(halves)) {
    const Eigen::ArrayXd y = samples.y(half), knows = (1 + held->variance(half).array()).inverse();
    const Eigen::ArrayXd v = believed(fit.weight(half)) * fit.weight(half).array() * knows.square();
    const double missed = (v * (y - held->mean(half).array()).square()).sum(),
                 moved = (v * (y - held->level(half).array()).square()).sum();
    const Skill skill{moved > 0 ? 1 - missed / moved : 0, knows.mean()};
    if (compensation::evidence_of(skill.score, skill.overlap) < compensation::evidence_of(worst.score, worst.overlap))
      worst = skill;
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
compensation::BetweenRunError calibrated(const CompositeSamples& samples, const CompositeFit& fit, const Skill& skill,
                                         HeldOutErrors& errors) {
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
    served.knowledge = {held->variance[i], 1, skill.score, 0, spread, true, skill.overlap, {}};
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

// One passage: the path of the temperature (the first input, if none is named T) is hardly longer than its range.
bool one_passage(const TrainingData& raw, int recordings) {
  constexpr Eigen::Index kPieces = 20;
  constexpr double kStraight = 0.75;
  const Eigen::Index n = raw.inputs.cols();
  if (recordings > 1 || n < 2 * kPieces) return false;
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

constexpr const char* kOnePassage =
    "one passage through the temperatures: thermal drift and drift in time cannot be separated; assumed mostly "
    "thermal; "
    "a second cycle would decide (--drift states what you know)";

// Parameters, beta and centres: everything except the uncertainty parameters.
Result<compensation::CompositeParameters> solved(const CompositeSamples& samples, const ReweightSettings& settings,
                                                 const ResourcePlan& plan, CompositeFit& fit, TrainedModel& trained) {
  compensation::CompositeParameters p;
  p.variances = composite_variances(fit.theta, samples.x.rows());
  if (plan.sparse) {
    auto found = fit_sparse_composite(samples, fit.theta, settings, plan.max_rank);
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
    const auto system = reweighted_system(samples, fit.theta, settings, fit.weight, report);
    if (!system) return make_error("composite kernel", "the covariance of the samples is not positive definite");
    p.variances.warm_up = samples.warm_up;
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

ResourcePlan plan_composite(Eigen::Index samples, Eigen::Index inputs, const TrainingSettings& settings) {
  if (samples > kDenseComposite) return plan_sparse(samples, inputs, settings.memory_limit_bytes, kMaxCompositeRank);
  const double n = static_cast<double>(samples), searched = std::min(n, 1000.0);
  // The covariance, its parts, the model's factor.
  return {n * n * 5 * 8, (searched * searched * searched * 60 + n * n * n / 3 * 15) / kFlops};
}

Result<TrainedModel> train_composite(TrainingJob job) {
  auto data = normalise(job.data.inputs, job.data.target, job.settings.scaling, job.data.names);
  if (!data) return tl::unexpected<Error>(data.error());
  TrainingSettings settings = job.settings;
  settings.reweight.weight.parameter = settings.parameter.value_or(kGentleParameter);
  CompositeSamples samples = samples_of(*data, job.data);
  const bool robust = settings.reweight.weight.kind != WeightKind::kNone;
  auto fit = search_composite(samples, settings.reweight, drift_prior(settings.drift), settings,
                              robust ? first_weights(job.data) : Eigen::VectorXd());
  if (!fit) return tl::unexpected<Error>(fit.error());
  TrainedModel trained;
  auto p = solved(samples, settings.reweight, job.plan, *fit, trained);
  if (p && (believed(fit->weight) == 0).any()) {
    rescale(samples, *fit, data->constants);
    const auto report = trained.reweight;
    p = solved(samples, settings.reweight, job.plan, *fit, trained);
    trained.reweight = report;
  }
  if (!p) return tl::unexpected<Error>(p.error());
  const compensation::Normalisation& n = data->constants;
  trained.samples.fitted = trained.samples.fitted.array() * n.target_scale + n.target_shift;
  p->normalisation = n;
  const Rows some = thinned(samples.y.size(), kErrorSamples);
  const CompositeSamples subset = samples.part(some);
  const CompositeFit subset_fit{fit->theta, fit->weight(some)};
  p->prior = settings.prior;
  const Skill skill = skill_of(subset, subset_fit);
  p->trust.skill = skill.score;
  p->trust.overlap = skill.overlap;
  p->trust.level = level_of(samples, fit->theta);
  job.info.spread = calibrated(subset, subset_fit, skill, trained.held_out);
  trained.held_out.error *= n.target_scale;
  trained.held_out.model_variance *= n.target_scale * n.target_scale;
  if (trained.held_out.error.size() > 0) trained.held_out.samples = some;
  for (double* part :
       {&job.info.spread->nuisance_deg_per_h, &job.info.spread->offset_deg_per_h, &job.info.spread->noise_deg_per_h})
    *part *= n.target_scale;
  job.info.kind = "composite";
  const auto first = compensation::CompositeModel::make(job.info, *p);
  if (!first) return tl::unexpected<Error>(first.error());
  p->trust.relevance = relevance_of(**first, job.data);
  p->trust.guard = guard_for(**first, job.data, n.target_scale);
  auto model = compensation::CompositeModel::make(std::move(job.info), std::move(*p));
  if (!model) return tl::unexpected<Error>(model.error());
  trained.model = std::move(*model);
  if (settings.drift == Drift::kThermal && one_passage(job.data, samples.recordings))
    trained.notes.emplace_back(kOnePassage);
  return trained;
}

}  // namespace prism::training
