// SPDX-License-Identifier: MIT
#include "tools/prismcal/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "compensation/training/held_out.hpp"

namespace prism::design {
namespace {

constexpr int kDomainPoints = 200;
constexpr Eigen::Index kMissionPoints = 300;  // of each recording
constexpr int kSearchWindows = 3;             // windows in each row of the search
constexpr double kSearchCost = 1.2e11;        // bound of the search, multiplications: seconds

using Posteriors = std::vector<DesignPosterior>;

double together(const Posteriors& all, const std::function<double(const DesignPosterior&)>& sd) {
  double sum = 0;
  for (const DesignPosterior& one : all) sum += std::pow(sd(one), 2);
  return std::sqrt(sum / static_cast<double>(all.size()));
}

Eigen::VectorXd at_points(const Posteriors& all) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(all.front().sd_at_points().size());
  for (const DesignPosterior& one : all) sum += one.sd_at_points().array().square().matrix();
  return (sum / static_cast<double>(all.size())).cwiseSqrt();
}

double hours_of(const RecordedInputs& recording) { return recording.time_h[recording.time_h.size() - 1]; }

/// The inputs that gyros of this type record on profiles.
Result<GyroInputs> inputs_of(const std::vector<KnownGyro>& gyros, const ThermalResponse& response,
                             const std::vector<RecordedInputs>& made) {
  const KnownGyro& first = gyros.front();
  std::vector<RecordedInputs> shown;
  for (const KnownGyro& gyro : gyros) {
    if (gyro.inputs != first.inputs || gyro.features != first.features)
      return make_error(gyro.name, fmt::format("has other inputs or features than {}", first.name));
    shown.insert(shown.end(), gyro.recordings.begin(), gyro.recordings.end());
  }
  shown.insert(shown.end(), made.begin(), made.end());
  return GyroInputs::make(first.inputs, first.features, response, shown);
}

Result<Posteriors> posteriors_of(const std::vector<KnownGyro>& gyros, const Eigen::MatrixXd& domain,
                                 const GyroInputs& inputs, const std::vector<simulation::ChamberProfile>& profiles,
                                 double first_h) {
  Eigen::MatrixXd reachable;
  for (const auto& profile : profiles) append_columns(reachable, inputs.on(profile, kSearchWindows).inputs);
  Posteriors known;
  for (const KnownGyro& gyro : gyros) {
    auto posterior = DesignPosterior::make(gyro, domain, reachable, first_h);
    if (!posterior) return tl::unexpected<Error>(posterior.error());
    known.push_back(std::move(*posterior));
  }
  return known;
}

}  // namespace

Eigen::MatrixXd mission_points(const std::vector<RecordedInputs>& recordings) {
  Eigen::MatrixXd points;
  for (const RecordedInputs& recording : recordings)
    append_columns(points, recording.inputs(Eigen::all, training::thinned(recording.inputs.cols(), kMissionPoints)));
  return points;
}

Result<Plan> plan_recording(const std::vector<KnownGyro>& gyros, const PlanSettings& settings) {
  const KnownGyro& first = gyros.front();
  const auto inputs = inputs_of(gyros, settings.response, settings.made);
  if (!inputs) return tl::unexpected<Error>(inputs.error());
  Eigen::MatrixXd domain = settings.mission;
  if (domain.cols() == 0) {
    auto over = inputs->over(settings.domain, kDomainPoints);
    if (!over) return tl::unexpected<Error>(over.error());
    domain = std::move(*over);
  }
  std::vector<simulation::ChamberProfile> others = {paper_within(settings.chamber)};
  for (auto& simple : simple_profiles(settings.chamber, settings.hours)) others.push_back(std::move(simple));
  // Models of other gyros saw the drift of their own recordings, which may be longer.
  const bool own_model = gyros.size() == 1 && first.model;
  auto posteriors = posteriors_of(gyros, domain, *inputs, others, own_model ? 0 : settings.hours);
  if (!posteriors) return tl::unexpected<Error>(posteriors.error());
  Posteriors& known = *posteriors;
  Plan plan;
  const auto now = [&] { return together(known, [](const DesignPosterior& p) { return p.sd_deg_per_h(); }); };
  plan.spread_deg_per_h = now();
  // Recordings of other gyros of the type show inputs and covariance, not the bias of this one.
  std::vector<RecordedInputs> made = settings.made;
  if (gyros.size() == 1) {
    if (first.gram.size() > 0) {
      known.front().add_long_record(first);
      plan.made.push_back({"the model's recordings", kUnknown, now()});
    }
    made.insert(made.begin(), first.recordings.begin(), first.recordings.end());
  }
  for (const RecordedInputs& recording : made) {
    for (DesignPosterior& p : known) p.add(recording);
    plan.made.push_back({fmt::format("recording {}", plan.made.size() + 1), hours_of(recording), now()});
  }
  plan.before_deg_per_h = now();
  plan.sd_before = at_points(known);
  const auto with = [&](const RecordedInputs& recording, int windows) {
    return together(known, [&](const DesignPosterior& p) { return p.sd_with(recording, windows); });
  };
  if (!made.empty()) plan.repeated_deg_per_h = with(made.back(), 1);
  const double rank = static_cast<double>(std::max<Eigen::Index>(80, first.gram.rows()));
  const int most = static_cast<int>(
      std::clamp(kSearchCost / static_cast<double>(gyros.size()) / (600 * rank * rank), 100.0, 4000.0));
  const FoundProfile found = find_profile(
      settings.chamber, settings.hours,
      [&](const simulation::ChamberProfile& p) { return with(inputs->on(p, kSearchWindows), kSearchWindows); }, most);
  if (found.profile.segments.empty())
    return make_error("--hours", fmt::format("found {} h, too short for a ramp to {} or {} degC at {} degC/min",
                                             settings.hours, settings.chamber.low_degc, settings.chamber.high_degc,
                                             settings.chamber.rate_degc_per_min));
  plan.profile = found.profile;
  plan.evaluations = found.evaluations;
  plan.expected = inputs->on(plan.profile);
  plan.after_deg_per_h = with(plan.expected, 1);
  for (const auto& profile : others)
    plan.others.push_back({profile.name, profile.duration_s() / 3600, with(inputs->on(profile), 1)});
  for (DesignPosterior& p : known) p.add(plan.expected);
  plan.sd_after = at_points(known);
  const Eigen::Index t =
      std::find(first.inputs.begin(), first.inputs.end(), compensation::kInputTemperature) - first.inputs.begin();
  plan.domain_t_degc = domain.row(t);
  plan.expected_t_degc = plan.expected.inputs.row(t);
  plan.assumed = fmt::format(
      "The gyro's temperature is assumed to follow the chamber with {:.0f} min, {:g} degC warmer (--thermal-lag, "
      "--self-heating).",
      settings.response.lag_s / 60, settings.response.self_heating_degc);
  return plan;
}

}  // namespace prism::design
