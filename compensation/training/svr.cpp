// SPDX-License-Identifier: MIT
// ε-SVR by libsvm (paper eqs. 2 to 4): the paper's baseline. Tuned on a log grid.
#include <fmt/format.h>
#include <libsvm/svm.h>

#include <cmath>
#include <memory>
#include <mutex>

#include "compensation/training/between_run_error.hpp"
#include "compensation/training/methods.hpp"
#include "compensation/training/parallel.hpp"

namespace prism::training {
namespace {

// libsvm's sparse rows: (index, value) pairs, terminated by index −1; they must outlive the model.
class Rows {
 public:
  Rows(const Eigen::MatrixXd& x, const std::vector<Eigen::Index>& samples)
      : width_(static_cast<std::size_t>(x.rows()) + 1) {
    nodes_.resize(samples.size() * width_);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      svm_node* row = nodes_.data() + i * width_;
      for (int j = 0; j < x.rows(); ++j) row[j] = {j + 1, x(j, samples[i])};
      row[x.rows()] = {-1, 0};
      rows_.push_back(row);
    }
  }
  svm_node** pointers() { return rows_.data(); }
  int count() const { return static_cast<int>(rows_.size()); }

 private:
  std::size_t width_;
  std::vector<svm_node> nodes_;
  std::vector<svm_node*> rows_;
};

struct Freed {
  void operator()(svm_model* model) const { svm_free_and_destroy_model(&model); }
};
using SvmModel = std::unique_ptr<svm_model, Freed>;

SvmModel fit(Rows& rows, Eigen::VectorXd y, const TuningPoint& point, double epsilon) {
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = RBF;
  parameter.gamma = 0.5 / point.sigma2;
  parameter.C = point.c;
  parameter.p = epsilon;
  parameter.eps = 1e-3;
  parameter.cache_size = 100;
  parameter.shrinking = 1;
  const svm_problem problem{rows.count(), y.data(), rows.pointers()};
  return SvmModel(svm_train(&problem, &parameter));
}

// Mean over folds of the held-out mean absolute error.
double fold_cost(const NormalisedData& data, const Folds& folds, const TuningPoint& point, double epsilon) {
  double total = 0;
  const auto members = fold_members(folds);
  for (const auto& held_out : members) {
    const auto training = others(held_out, data.y.size());
    Rows rows(data.x, training), test(data.x, held_out);
    const SvmModel model = fit(rows, data.y(training), point, epsilon);
    double sum = 0;
    for (std::size_t i = 0; i < held_out.size(); ++i)
      sum += std::fabs(data.y[held_out[i]] - svm_predict(model.get(), test.pointers()[i]));
    total += sum / static_cast<double>(held_out.size());
  }
  return total / static_cast<double>(members.size()) * data.constants.target_scale;
}

HeldOutErrors hold_out(const NormalisedData& data, const std::vector<int>& runs, const TuningPoint& point,
                       double epsilon) {
  const std::vector<Eigen::Index> some = thinned(data.y.size(), kErrorSamples);
  const Eigen::MatrixXd x = data.x(Eigen::all, some);
  const Eigen::VectorXd y = data.y(some);
  HeldOutErrors held{y, Eigen::VectorXd::Zero(y.size()), held_out_folds(taken(runs, some)), some};
  for (const auto& held_out : fold_members(held.folds)) {
    const auto inside = others(held_out, y.size());
    Rows rows(x, inside), test(x, held_out);
    const SvmModel model = fit(rows, y(inside), point, epsilon);
    for (std::size_t i = 0; i < held_out.size(); ++i)
      held.error[held_out[i]] -= svm_predict(model.get(), test.pointers()[i]);
  }
  held.error *= data.constants.target_scale;
  return held;
}

TuningResult tune_svr(const NormalisedData& data, const Folds& folds, const TrainingSettings& settings,
                      const TuningProgress& progress, const std::atomic<bool>* stop) {
  TuningResult result;
  for (const double log_sigma2 : {-1.0, -0.25, 0.5, 1.25}) {
    for (const double log_c : {-0.5, 0.5, 1.5, 2.5}) {
      result.surface.push_back({std::pow(10, log_c), std::pow(10, log_sigma2), 1, kNever});
    }
  }
  std::mutex mutex;
  result.best.cost = kNever;
  const int count = static_cast<int>(result.surface.size());
  parallel_for(count, settings.threads, [&](int i) {
    if (stop != nullptr && stop->load()) return;
    TuningPoint& point = result.surface[static_cast<std::size_t>(i)];
    point.cost = fold_cost(data, folds, point, settings.epsilon);
    const std::lock_guard lock(mutex);
    ++result.evaluations;
    if (point.cost < result.best.cost) result.best = point;
    if (progress) progress(result.evaluations, count, result.best);
  });
  result.stopped = stop != nullptr && stop->load();
  return result;
}

Result<ResourcePlan> plan_svr(Eigen::Index samples, Eigen::Index, const TrainingSettings& settings) {
  const double n = static_cast<double>(samples);
  return within_memory({false, 0, n * n * 4 + 200e6, n * n * 1e-7}, samples, settings.memory_limit_bytes);
}

Result<TrainedModel> train_svr(TrainingJob job) {
  const TrainingSettings& settings = job.settings;
  const auto plan = plan_svr(job.data.inputs.cols(), job.data.inputs.rows(), settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto normalised = job.normalised();
  if (!normalised) return tl::unexpected<Error>(normalised.error());
  const NormalisedData& data = *normalised;
  svm_set_print_string_function([](const char*) {});
  if (!(settings.epsilon >= 0))
    return make_error("epsilon", fmt::format("found {}, expected at least 0", settings.epsilon));
  TrainedModel trained;
  TuningPoint point{settings.c.value_or(1), settings.sigma2.value_or(1), 1, 0};
  if (!settings.c) {
    if (settings.tuning == Tuning::kLoo || settings.tuning == Tuning::kReml) {
      return make_error("tuning", "found leave-one-out or reml for svr, expected folds: blocked or shuffled");
    }
    trained.tuning = tune_svr(data, folds_of(job.data, job.settings), settings, job.progress, job.stop);
    point = trained.tuning->best;
    if (!std::isfinite(point.cost))
      return make_error("tuning", "stopped before the first choice of c and sigma2 had a cost");
  }
  Rows rows(data.x, others({}, data.y.size()));
  const SvmModel svm = fit(rows, data.y, point, settings.epsilon);
  std::vector<Eigen::Index> vectors;
  for (int i = 0; i < svm->l; ++i) vectors.push_back(svm->sv_indices[i] - 1);
  if (vectors.empty()) return make_error("svr", "found no support vector: epsilon exceeds all residuals");
  compensation::LssvmParameters p;
  p.centres = data.x(Eigen::all, vectors);
  p.alpha = Eigen::Map<const Eigen::VectorXd>(svm->sv_coef[0], svm->l);
  p.b = -svm->rho[0];
  p.c = point.c;
  p.sigma2 = point.sigma2;
  p.normalisation = data.constants;
  trained.samples.alpha = Eigen::VectorXd::Zero(data.y.size());
  trained.samples.alpha(vectors) = p.alpha;
  trained.samples.weight = Eigen::VectorXd::Ones(data.y.size());
  trained.samples.fitted.resize(data.y.size());
  for (Eigen::Index i = 0; i < data.y.size(); ++i) {
    trained.samples.fitted[i] =
        svm_predict(svm.get(), rows.pointers()[i]) * data.constants.target_scale + data.constants.target_shift;
  }
  trained.c = point.c;
  trained.sigma2 = point.sigma2;
  trained.centres = svm->l;
  const double scale = data.constants.target_scale;
  const Eigen::VectorXd left = scale * data.y.array() + data.constants.target_shift - trained.samples.fitted.array();
  trained.held_out = hold_out(data, job.runs, point, settings.epsilon);
  job.info.spread = between_run_error_of(trained.held_out, left, scale, job.runs);
  job.info.kind = "svr";
  auto model = compensation::LssvmModel::make(std::move(job.info), std::move(p));
  if (!model) return tl::unexpected<Error>(model.error());
  trained.model = std::move(*model);
  return trained;
}

}  // namespace

extern const Method kSvr;
const Method kSvr = {"svr", "", kTuning | kTube, plan_svr, train_svr, describe_kernel};

}  // namespace prism::training
