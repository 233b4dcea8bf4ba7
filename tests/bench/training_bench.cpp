// SPDX-License-Identifier: MIT
// Speed of training and prediction as ratios measured in one run; docs/benchmarks.md lists the results.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "compensation/kernel.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/training/dense.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/trainer.hpp"

double native_kernel_sum(const double* centres, long count, const double* point, double gamma, const double* alpha);
double native_llt(const double* matrix, long n);

namespace prism::bench {
namespace {

double cpu_s() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// CPU seconds of one call of each job: the best of several batches, with the jobs in turn, so that other load on the
// machine hardly changes their ratios.
template <class... Jobs>
std::array<double, sizeof...(Jobs)> best_s(int batches, int calls, Jobs&&... jobs) {
  std::array<double, sizeof...(Jobs)> best;
  best.fill(1e300);
  for (int i = 0; i < batches; ++i) {
    std::size_t at = 0;
    const auto batch = [&](auto&& job) {
      const double begin = cpu_s();
      for (int j = 0; j < calls; ++j) job();
      best[at] = std::min(best[at], (cpu_s() - begin) / calls);
      ++at;
    };
    (batch(jobs), ...);
  }
  return best;
}

volatile double sink;

// A small version of the paper's thermal cycle: 924 samples, three inputs, 3 % outliers; used without the reference
// data.
training::TrainingData made_up(Eigen::Index n) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  training::TrainingData data;
  data.names = {"T", "dTdt", "U"};
  data.inputs.resize(3, n);
  data.target.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double phase = 12.566 * static_cast<double>(i) / static_cast<double>(n);
    const double t = 55 * std::sin(phase), slope = 0.017 * std::tanh(4 * std::cos(phase)),
                 u = 5.6 - 0.002 * t + 0.01 * normal(random);
    data.inputs.col(i) << t, slope, u;
    data.target[i] = 0.0004 * t - 0.9 * slope - 0.1 * (u - 5.6) + 0.006 * normal(random) + (i % 33 == 5 ? 0.05 : 0);
  }
  return data;
}

training::Folds given_folds;

training::TrainingData reference(const std::string& shared) {
  std::ifstream in(shared + "/golden/gyro924/train.csv");
  if (!in) {
    fmt::print("{}/golden does not exist: using synthetic data of the same size\n", shared);
    given_folds = training::shuffled_folds(924, 10, 1);
    return made_up(924);
  }
  training::TrainingData data;
  data.names = {"T", "dTdt", "U"};
  data.inputs.resize(3, 924);
  data.target.resize(924);
  std::string line, field;
  std::getline(in, line);
  for (Eigen::Index i = 0; i < 924 && std::getline(in, line); ++i) {
    std::istringstream row(line);
    for (int j = 0; j < 10 && std::getline(row, field, ','); ++j) {
      if (j >= 1 && j <= 3) data.inputs(j - 1, i) = std::stod(field);
      if (j == 4) data.target[i] = std::stod(field);
      if (j == 9) given_folds.push_back(std::stoi(field) - 1);
    }
  }
  return data;
}

// libprism-kernels at the microarchitecture level that the loader selected;
// GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX512F,-AVX2 prevents a level.
void measure_prediction(const training::NormalisedData& data) {
  const Eigen::Index n = data.y.size();
  const compensation::KernelCentres centres(data.x, 0.5);
  const Eigen::MatrixXd rows = data.x.transpose();
  const Eigen::VectorXd alpha = Eigen::VectorXd::LinSpaced(n, -1, 1);
  const Eigen::Vector3d point(0.1, 0.2, 0.3);
  const auto [native, own] = best_s(
      100, 500, [&] { sink = native_kernel_sum(rows.data(), n, point.data(), 1, alpha.data()); },
      [&] { sink = centres.sum(point, alpha); });
  fmt::print("kernel sum, {} centres, 3 inputs: {:.2f} us; bare sum by Eigen built for this machine {:.2f} us\n", n,
             own * 1e6, native * 1e6);
  fmt::print("  ratio {:.2f}\n", own / native);
}

void measure_fit(const training::NormalisedData& data) {
  const Eigen::Index n = data.y.size();
  Eigen::MatrixXd h = compensation::kernel_matrix(data.x, 0.1458);
  h.diagonal().array() += 1 / 76.0796;
  const auto [native, eigen, own, fit] = best_s(
      15, 1, [&] { sink = native_llt(h.data(), n); },
      [&] { sink = Eigen::LLT<Eigen::MatrixXd>(h).matrixLLT()(n - 1, n - 1); },
      [&] {
        Eigen::MatrixXd l = h;
        sink = training::cholesky(l) ? l(n - 1, n - 1) : 0;
      },
      [&] {
        sink = training::LssvmFactor::make(compensation::kernel_matrix(data.x, 0.1458),
                                           Eigen::VectorXd::Constant(n, 1 / 76.0796), data.y)
                   ->solution()
                   .b;
      });
  fmt::print(
      "one LSSVM fit, N = {}: {:.2f} ms (factor {:.2f}); Eigen's LLT {:.2f} ms built for this machine, {:.2f} ms built "
      "for any x86-64\n",
      n, fit * 1e3, own * 1e3, native * 1e3, eigen * 1e3);
  fmt::print("  ratio {:.2f} and {:.2f}\n", fit / native, fit / eigen);
}

void measure_window(const training::TrainingData& data) {
  training::TrainingSettings settings;
  settings.c = 76.0796, settings.sigma2 = 0.1458;
  const std::vector<double> x = {25, 0.001, 5.6};
  double bare = 0;  // IR-LSSVM: the sum of a Gaussian kernel only
  for (const training::Method* method : {training::find_method("ir-lssvm"), training::find_method("composite")}) {
    settings.method = method;
    if (method == training::find_method("composite")) settings.c.reset(), settings.sigma2.reset();
    const double begin = cpu_s();
    const auto trained = training::train(data, {}, settings);
    const double took = cpu_s() - begin;
    const compensation::Model& model = *trained->model;
    const double alone = best_s(10, 1000, [&] { sink = model.bias_deg_per_h(x); })[0];
    if (bare == 0) bare = alone;
    fmt::print(
        "{}: trained in {:.1f} CPU s; one window in prismd: {:.1f} us with both standard deviations, {:.2f} us "
        "without, ratio to the bare sum {:.2f}\n",
        model.info().kind, took, best_s(10, 50, [&] { sink = model.predict(x).sd_deg_per_h; })[0] * 1e6, alone * 1e6,
        alone / bare);
  }
}

void measure_tuning(const training::TrainingData& data, const char* name, training::Tuning tuning,
                    training::WeightKind weight) {
  training::TrainingSettings settings;
  settings.tuning = tuning;
  settings.given_folds = given_folds;
  settings.method =
      weight == training::WeightKind::kNone ? training::find_method("lssvm") : training::find_method("ir-lssvm");
  settings.reweight.weight.kind = weight;
  const double begin = cpu_s();
  const auto trained = training::train(data, {}, settings);
  const double took = cpu_s() - begin;
  if (!trained) return void(fmt::print("  {}: {}\n", name, trained.error().text()));
  fmt::print("  {:<28} {:6.2f} CPU s, cost {:.7g} at c {:.4g}, sigma2 {:.4g}, {} evaluations\n", name, took,
             trained->tuning->best.cost, trained->c, trained->sigma2, trained->tuning->evaluations);
}

// Tables 4 and 5: four weights on every subset of the inputs, and the unweighted model: 29 tunings.
void measure_tables(const training::TrainingData& all) {
  const double begin = cpu_s();
  int count = 0;
  for (const std::vector<int>& subset : {std::vector{0}, {1}, {2}, {0, 1}, {0, 2}, {1, 2}, {0, 1, 2}}) {
    training::TrainingData data = all;
    data.inputs = all.inputs(subset, Eigen::all);
    data.names.resize(subset.size());
    for (int weight = subset.size() == 3 ? 0 : 1; weight <= 4; ++weight, ++count) {
      training::TrainingSettings settings;
      settings.tuning = weight == 0 ? training::Tuning::kLoo : training::Tuning::kGiven;
      settings.given_folds = given_folds;
      settings.method = weight == 0 ? training::find_method("lssvm") : training::find_method("ir-lssvm");
      settings.reweight.weight.kind = static_cast<training::WeightKind>(weight);
      (void)training::train(data, {}, settings);
    }
  }
  fmt::print("tables 4 and 5: {} tuned models in {:.1f} CPU s\n", count, cpu_s() - begin);
}

void measure_long_record(Eigen::Index n) {
  training::TrainingSettings settings;
  settings.method = training::find_method("ir-lssvm");
  const training::TrainingData data = made_up(n);
  const double begin = cpu_s();
  const auto trained = training::train(data, {}, settings);
  if (!trained) return void(fmt::print("{}\n", trained.error().text()));
  fmt::print("{} rows, tuned and trained: {:.1f} CPU s, {} centres\n", n, cpu_s() - begin, trained->centres);
}

int run(const std::string& shared, bool kernels_only) {
  const training::TrainingData data = reference(shared);
  const training::NormalisedData normalised = *training::normalise(data, training::NormalisationMethod::kZscore);
  measure_prediction(normalised);
  measure_fit(normalised);
  measure_window(data);
  if (kernels_only) return 0;
  fmt::print("tuning, N = 924, three inputs, given folds:\n");
  measure_tuning(data, "plain ten-fold", training::Tuning::kGiven, training::WeightKind::kNone);
  measure_tuning(data, "leave-one-out", training::Tuning::kLoo, training::WeightKind::kNone);
  measure_tuning(data, "reml", training::Tuning::kReml, training::WeightKind::kNone);
  measure_tuning(data, "robust ten-fold, huber", training::Tuning::kGiven, training::WeightKind::kHuber);
  measure_tuning(data, "robust ten-fold, hampel", training::Tuning::kGiven, training::WeightKind::kHampel);
  measure_tuning(data, "robust ten-fold, logistic", training::Tuning::kGiven, training::WeightKind::kLogistic);
  measure_tuning(data, "robust ten-fold, myriad", training::Tuning::kGiven, training::WeightKind::kMyriad);
  measure_long_record(100000);
  measure_tables(data);
  return 0;
}

}  // namespace
}  // namespace prism::bench

int main(int argc, char** argv) {
  const char* shared = std::getenv("PRISM_SHARED");
  setvbuf(stdout, nullptr, _IONBF, 0);
  return prism::bench::run(shared ? shared : PRISM_SOURCE_DIR "/../shared",
                           argc > 1 && std::string(argv[1]) == "kernels");
}
