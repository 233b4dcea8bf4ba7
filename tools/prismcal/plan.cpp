// SPDX-License-Identifier: MIT
#include "tools/prismcal/plan.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "compensation/extrapolation.hpp"
#include "compensation/kernel.hpp"
#include "compensation/training/composite.hpp"
#include "compensation/training/held_out.hpp"
#include "compensation/training/low_rank.hpp"
#include "compensation/training/trainer.hpp"

namespace prism::design {
namespace {

constexpr Eigen::Index kPivotCandidates = 1500, kMostPivots = 120;
constexpr double kLeftOfNoise = 0.02;  // largest prior variance outside the pivots, in noise variances
constexpr double kStrangeness = 1.25;  // of the model's variance, in stated() (extrapolation.hpp)
constexpr double kUnknownConstant = 1e-6, kUnknownWarmUp = 1;

Eigen::MatrixXd raw_inputs(const Eigen::MatrixXd& x, const compensation::Normalisation& n) {
  return (x.array().colwise() * n.input_scale.array()).colwise() + n.input_shift.array();
}

}  // namespace

Result<KnownGyro> known_gyro(const compensation::ModelPtr& model) {
  const compensation::ModelInfo& info = model->info();
  const auto* composite = dynamic_cast<const compensation::CompositeModel*>(model.get());
  if (!composite || info.table)
    return make_error(info.name.empty() ? "model" : info.name,
                      fmt::format("found a model of type {}{}, expected composite, made by prismcal train", info.kind,
                                  info.table ? " of a table" : ""));
  const compensation::CompositeParameters& p = composite->parameters();
  KnownGyro gyro{info.name, info.inputs, info.features, p.variances, p.normalisation, *info.spread, {}, {}, {}, model};
  const Eigen::MatrixXd inputs = raw_inputs(p.centres, p.normalisation);
  if (p.gram.size() > 0) {
    gyro.centres = p.centres;
    gyro.gram = p.gram;
    return gyro;
  }
  for (const auto& rows : training::fold_members(p.recording))
    gyro.recordings.push_back({inputs(Eigen::all, rows), p.time_h(rows), p.weight(rows)});
  return gyro;
}

Result<DesignPosterior> DesignPosterior::make(const KnownGyro& gyro, const Eigen::MatrixXd& domain,
                                              const Eigen::MatrixXd& reachable, double first_h) {
  DesignPosterior made;
  made.gyro_ = gyro;
  const double scale = gyro.normalisation.target_scale;
  made.set_between_runs(first_h);
  Eigen::MatrixXd all;
  const auto append = [&](const Eigen::MatrixXd& x) {
    const Eigen::MatrixXd some = x(Eigen::all, training::thinned(x.cols(), kPivotCandidates));
    append_columns(all, training::normalised_inputs(some, gyro.normalisation));
  };
  append(domain);
  append(reachable);
  for (const RecordedInputs& recording : gyro.recordings) append(recording.inputs);
  const compensation::CompositeKernel& kernel = gyro.variances.kernel;
  if (gyro.centres.size() > 0) {
    made.points_ = gyro.centres;
  } else {
    const auto found = training::composite_pivots(kernel, all, kLeftOfNoise * gyro.variances.noise, kMostPivots);
    made.points_ = all(Eigen::all, found.pivots);
  }
  made.factor_ = kernel.matrix(made.points_);
  made.factor_.diagonal().array() += compensation::kCompositeJitter * kernel.rbf;
  if (!compensation::lower_factor(made.factor_))
    return make_error(gyro.name, "the covariance of the design's pivots is not positive definite");
  made.domain_features_ = made.features_of(domain);
  const Eigen::MatrixXd x = training::normalised_inputs(domain, gyro.normalisation);
  const Eigen::Index r = made.points_.cols();
  made.left_.resize(domain.cols());
  made.bias_deg_per_h_ = Eigen::VectorXd::Constant(domain.cols(), scale);
  for (Eigen::Index i = 0; i < domain.cols(); ++i) {
    made.left_[i] = std::max(0.0, kernel.variance(x.col(i)) - made.domain_features_.col(i).head(r).squaredNorm());
    if (!gyro.model) continue;
    const Eigen::VectorXd at = domain.col(i);
    const auto said = compensation::predict_within(*gyro.model, {at.data(), static_cast<std::size_t>(at.size())},
                                                   compensation::Extrapolation::kPreset);
    made.bias_deg_per_h_[i] = said.bias_deg_per_h - said.mean_deg_per_h;
  }
  made.information_ = Eigen::MatrixXd::Identity(r + 2, r + 2);
  made.information_(r, r) = kUnknownWarmUp;
  made.information_(r + 1, r + 1) = kUnknownConstant;
  return made;
}

// [L⁻¹ k; 0; 1]: the warm-up's row is of the time, not of the inputs.
Eigen::MatrixXd DesignPosterior::features_of(const Eigen::MatrixXd& inputs) const {
  const Eigen::MatrixXd x = training::normalised_inputs(inputs, gyro_.normalisation);
  const compensation::CompositeCentres centres(gyro_.variances.kernel, points_);
  Eigen::MatrixXd features(points_.cols() + 2, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) features.col(i) << centres.row(x.col(i)), 0.0, 1.0;
  auto kernel_rows = features.topRows(points_.cols());
  factor_.triangularView<Eigen::Lower>().solveInPlace(kernel_rows);
  return features;
}

void DesignPosterior::add(const RecordedInputs& recording, int windows) {
  const Eigen::Index n = recording.inputs.cols();
  Eigen::MatrixXd features = features_of(recording.inputs);
  features.row(points_.cols()) = std::sqrt(gyro_.variances.warm_up) * (-recording.time_h.array()).exp();
  compensation::CompositeVariances own = gyro_.variances;
  own.noise /= windows;
  const std::vector<int> one(static_cast<std::size_t>(n), 0);
  if (two_runs_ > 0) own.offset = own_part() - compensation::nuisance_level(gyro_.variances, recording.time_h, one);
  const Eigen::VectorXd weight = recording.weight.size() == n ? recording.weight : Eigen::VectorXd::Ones(n);
  const training::NuisanceFilter filter(own, recording.time_h, one, weight);
  training::NuisanceFilter::Carry carry(features.rows());
  filter.whiten(features, 0, carry);
  information_.selfadjointView<Eigen::Lower>().rankUpdate(features);
  empty_ = false;
}

// The gram of one recording has Λ without an offset; Λ + d 1 1ᵀ by Woodbury's formula.
void DesignPosterior::add_long_record() {
  const Eigen::Index r = points_.cols();
  Eigen::MatrixXd gram = gyro_.gram;
  const double level = gyro_.variances.nuisance - drift_, more = two_runs_ > 0 ? own_part() - level : 0;
  const Eigen::VectorXd constant = gram.col(r);
  if (more != 0) gram -= constant * constant.transpose() / (1 / more + constant[r]);
  information_.topLeftCorner(r, r) = gram.topLeftCorner(r, r);
  information_.row(r + 1).head(r) = gram.row(r).head(r);
  information_(r + 1, r + 1) = gram(r, r);
  empty_ = false;
}

// As training states it (composite_trainer.cpp): with one recording, the difference between two runs is a prior that
// depends on the drift; with several it is in the variances of the kernel.
void DesignPosterior::set_between_runs(double first_h) {
  const double scale = gyro_.normalisation.target_scale;
  const auto share = [&](double deg_per_h) { return deg_per_h * deg_per_h / (scale * scale); };
  drift_ = share(gyro_.spread.nuisance_deg_per_h);
  two_runs_ = share(gyro_.spread.offset_deg_per_h);
  if (two_runs_ == 0 || first_h == 0) return;
  const double lengths = first_h / (2 * gyro_.variances.nuisance_time_h);
  drift_ = gyro_.variances.nuisance * lengths / (1 + lengths);
  two_runs_ = compensation::kAssumedOffset * compensation::kAssumedOffset + training::kDaysDiffer * drift_;
  gyro_.spread.nuisance_deg_per_h = scale * std::sqrt(drift_);
}

// Half of the difference between two runs, without the factor that the sd gives to variances of the model.
double DesignPosterior::own_part() const { return two_runs_ / 2 / kStrangeness; }

// After one recording: the kernel's variance, and the whole difference between two runs. Further recordings reduce
// both, but not the half of the run to come.
compensation::Prediction DesignPosterior::predicted(Eigen::Index point, double variance) const {
  const double scale = gyro_.normalisation.target_scale;
  compensation::BetweenRunError spread = gyro_.spread;
  if (two_runs_ > 0) {
    const double of_level = std::min(variance, own_part());
    spread.offset_deg_per_h = scale * std::sqrt(two_runs_ / 2 + kStrangeness * of_level);
    variance -= of_level;
  }
  compensation::Prediction prediction;
  prediction.bias_deg_per_h = bias_deg_per_h_[point];
  prediction.mean_deg_per_h = 0;
  prediction.knowledge = {variance * scale * scale, scale * scale, 1, 0, spread, true, 1, {}};
  return compensation::shrunk(prediction);
}

Eigen::VectorXd DesignPosterior::sd_at_points() const {
  if (empty_) return Eigen::VectorXd::Constant(left_.size(), gyro_.normalisation.target_scale);
  Eigen::MatrixXd factor = information_;
  Eigen::VectorXd sd = Eigen::VectorXd::Constant(left_.size(), kUnknown);
  if (!compensation::lower_factor(factor)) return sd;
  Eigen::MatrixXd solved = domain_features_;
  factor.triangularView<Eigen::Lower>().solveInPlace(solved);
  for (Eigen::Index i = 0; i < sd.size(); ++i)
    sd[i] = predicted(i, left_[i] + solved.col(i).squaredNorm()).sd_deg_per_h;
  return sd;
}

double DesignPosterior::sd_deg_per_h() const { return std::sqrt(sd_at_points().array().square().mean()); }

double DesignPosterior::sd_with(const RecordedInputs& recording, int windows) const {
  DesignPosterior with = *this;
  with.add(recording, windows);
  return with.sd_deg_per_h();
}

// The plan.

namespace {

constexpr int kDomainPoints = 200;
constexpr int kSearchWindows = 3;       // windows in each row of the search
constexpr double kSearchCost = 1.2e11;  // bound of the search, multiplications: seconds

using Posteriors = std::vector<DesignPosterior>;

double together(const Posteriors& all, const std::function<double(const DesignPosterior&)>& sd) {
  double sum = 0;
  for (const DesignPosterior& one : all) sum += std::pow(sd(one), 2);
  return std::sqrt(sum / static_cast<double>(all.size()));
}

double hours_of(const RecordedInputs& recording) { return recording.time_h[recording.time_h.size() - 1]; }

/// The inputs that gyros of this type record on profiles.
Result<GyroInputs> inputs_of(const std::vector<KnownGyro>& gyros, const ThermalResponse& response) {
  const KnownGyro& first = gyros.front();
  std::vector<RecordedInputs> shown;
  for (const KnownGyro& gyro : gyros) {
    if (gyro.inputs != first.inputs || gyro.features != first.features)
      return make_error(gyro.name, fmt::format("has other inputs or features than {}", first.name));
    shown.insert(shown.end(), gyro.recordings.begin(), gyro.recordings.end());
  }
  return GyroInputs::make(first.inputs, first.features, response, shown);
}

}  // namespace

Result<Plan> plan_recording(const std::vector<KnownGyro>& gyros, const PlanSettings& settings) {
  const KnownGyro& first = gyros.front();
  const bool alone = gyros.size() == 1;
  const auto inputs = inputs_of(gyros, settings.response);
  if (!inputs) return tl::unexpected<Error>(inputs.error());
  const auto domain = inputs->over(settings.domain, kDomainPoints);
  if (!domain) return tl::unexpected<Error>(domain.error());
  const std::vector<simulation::ChamberProfile> usual = usual_profiles(settings.chamber, settings.hours);
  Eigen::MatrixXd reachable;
  for (const auto& profile : usual) append_columns(reachable, inputs->on(profile, kSearchWindows).inputs);
  Posteriors known;
  // Models of other gyros saw the drift of their own recordings, which may be longer.
  const double first_h = alone && first.model ? 0 : settings.hours;
  for (const KnownGyro& gyro : gyros) {
    auto posterior = DesignPosterior::make(gyro, *domain, reachable, first_h);
    if (!posterior) return tl::unexpected<Error>(posterior.error());
    known.push_back(std::move(*posterior));
  }
  Plan plan;
  const auto now = [&] { return together(known, [](const DesignPosterior& p) { return p.sd_deg_per_h(); }); };
  const auto with = [&](const RecordedInputs& recording, int windows = 1) {
    return together(known, [&](const DesignPosterior& p) { return p.sd_with(recording, windows); });
  };
  plan.made.push_back({"none: spread of the bias", kUnknown, now()});
  // Recordings of other gyros of the type show inputs and covariance, not the bias of this one.
  const std::vector<RecordedInputs> made = alone ? first.recordings : std::vector<RecordedInputs>();
  if (alone && first.gram.size() > 0) {
    known.front().add_long_record();
    plan.made.push_back({"the model's recordings", kUnknown, now()});
  }
  for (const RecordedInputs& recording : made) {
    known.front().add(recording);
    plan.made.push_back({fmt::format("recording {}", plan.made.size()), hours_of(recording), now()});
  }
  const double rank = static_cast<double>(std::max<Eigen::Index>(80, first.gram.rows()));
  const int most = static_cast<int>(
      std::clamp(kSearchCost / static_cast<double>(gyros.size()) / (600 * rank * rank), 100.0, 4000.0));
  FoundProfile found = find_profile(
      settings.chamber, settings.hours,
      [&](const simulation::ChamberProfile& p) { return with(inputs->on(p, kSearchWindows), kSearchWindows); }, most);
  if (found.profile.segments.empty())
    return make_error("--hours", fmt::format("found {} h, too short for a ramp to {} or {} degC at {} degC/min",
                                             settings.hours, settings.chamber.low_degc, settings.chamber.high_degc,
                                             settings.chamber.rate_degc_per_min));
  plan.profile = std::move(found.profile);
  plan.expected = inputs->on(plan.profile);
  plan.after_deg_per_h = with(plan.expected);
  for (const auto& profile : usual)
    plan.others.push_back({profile.name, profile.duration_s() / 3600, with(inputs->on(profile))});
  if (!made.empty()) plan.others.push_back({"like the last", hours_of(made.back()), with(made.back())});
  const auto t = std::ranges::find(first.inputs, compensation::kInputTemperature) - first.inputs.begin();
  plan.expected_t_degc = plan.expected.inputs.row(t);
  plan.assumed = fmt::format(
      "The gyro's temperature is assumed to follow the chamber with {:.0f} min, {:g} degC warmer (--thermal-lag, "
      "--self-heating).",
      settings.response.lag_s / 60, settings.response.self_heating_degc);
  return plan;
}

}  // namespace prism::design
