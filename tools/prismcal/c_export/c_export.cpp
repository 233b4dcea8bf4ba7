// SPDX-License-Identifier: MIT
#include "tools/prismcal/c_export/c_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <span>

#include "compensation/compensation_engine.hpp"
#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/kernel.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/polynomial_model.hpp"
#include "tools/prismcal/c_export/evaluator.hpp"
#include "tools/prismcal/c_export/fewer_centres.hpp"

namespace prism::c_export {
namespace {

using compensation::CompositeModel;
using compensation::LssvmModel;
using compensation::Model;
using compensation::ModelInfo;
using compensation::ModelPtr;
using compensation::PolynomialModel;

constexpr int kPairs = 100, kRamp = 20;
constexpr double kDoubleTolerance = 1e-12, kFloatTolerance = 5e-5;  // of the range of the correction

/// Writes numbers as C constants, exact for double, rounded for float.
class CText {
 public:
  explicit CText(bool single) : single_(single) {}

  std::string number(double value) const {
    return single_ ? fmt::format("{:a}F", static_cast<float>(value)) : fmt::format("{:a}", value);
  }
  template <class Values>
  std::string list(const Values& values) const {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : ", ") + number(value);
    return "{" + text + "}";
  }
  void define(const char* name, double value) { defines += fmt::format("#define {} {}\n", name, number(value)); }
  void define(const char* name, int value) { defines += fmt::format("#define {} {}\n", name, value); }
  template <class Values>
  void table(const char* name, const char* sizes, const Values& values) {
    tables += fmt::format("static const prism_number {}{} = {};\n", name, sizes, list(values));
    bytes += static_cast<int>(std::size(values)) * size();
  }
  /// One column of the matrix per row of the table.
  void columns(const char* name, const char* sizes, const Eigen::MatrixXd& matrix) {
    tables += fmt::format("static const prism_number {}{} = {{\n", name, sizes);
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) tables += "  " + list(matrix.col(k)) + ",\n";
    tables += "};\n";
    bytes += static_cast<int>(matrix.size()) * size();
  }
  int size() const { return single_ ? sizeof(float) : sizeof(double); }

  std::string defines, tables;
  int bytes = 0;  ///< of the tables of numbers

 private:
  bool single_;
};

/// The numbers of a kernel model in the evaluator's form.
struct KernelSum {
  Eigen::MatrixXd centres;  ///< times factor
  Eigen::VectorXd weight, factor;
  double gamma = 0.5, constant = 0;
  compensation::Normalisation normalisation;
  Eigen::VectorXd linear;  ///< empty: no quadratic part
  Eigen::MatrixXd quadratic;
};

KernelSum sum_of(const LssvmModel& model) {
  const auto& p = model.parameters();
  const Eigen::VectorXd factor = Eigen::VectorXd::Ones(p.centres.rows());
  return {p.centres, p.alpha, factor, 1 / (2 * p.sigma2), p.b, p.normalisation, {}, {}};
}

KernelSum sum_of(const CompositeModel& model) {
  const auto& p = model.parameters();
  const compensation::CompositeKernel& kernel = p.variances.kernel;
  const Eigen::VectorXd factor = kernel.length2.cwiseSqrt().cwiseInverse();
  return {factor.asDiagonal() * p.centres,
          kernel.rbf * p.alpha,
          factor,
          0.5,
          p.beta,
          p.normalisation,
          kernel.linear * (p.centres * p.alpha),
          kernel.quadratic * (p.centres * p.alpha.asDiagonal() * p.centres.transpose())};
}

int append_kernel(CText& c, const KernelSum& sum) {
  const int inputs = static_cast<int>(sum.centres.rows()), centres = static_cast<int>(sum.centres.cols());
  const bool quadratic = sum.linear.size() > 0;
  c.define("PRISM_TERMS", 0);
  c.define("PRISM_CENTRES", centres);
  c.define("PRISM_QUADRATIC", quadratic ? 1 : 0);
  c.define("PRISM_GAMMA", sum.gamma);
  c.define("PRISM_CONSTANT", sum.constant);
  c.define("PRISM_TARGET_SHIFT", sum.normalisation.target_shift);
  c.define("PRISM_TARGET_SCALE", sum.normalisation.target_scale);
  c.table("prism_shift", "[PRISM_INPUTS]", sum.normalisation.input_shift);
  c.table("prism_scale", "[PRISM_INPUTS]", sum.normalisation.input_scale);
  c.table("prism_factor", "[PRISM_INPUTS]", sum.factor);
  if (quadratic) {
    c.table("prism_linear", "[PRISM_INPUTS]", sum.linear);
    c.columns("prism_quadratic", "[PRISM_INPUTS][PRISM_INPUTS]", sum.quadratic);
  }
  c.columns("prism_centre", "[PRISM_CENTRES][PRISM_INPUTS]", sum.centres);
  c.table("prism_weight", "[PRISM_CENTRES]", sum.weight);
  return centres * (3 * inputs + 3);
}

int append_polynomial(CText& c, const PolynomialModel& model) {
  c.define("PRISM_TERMS", static_cast<int>(model.terms().size()));
  c.define("PRISM_CENTRES", 0);
  std::vector<double> coefficients;
  std::string powers;
  int operations = 0;
  for (const compensation::Term& term : model.terms()) {
    coefficients.push_back(term.coefficient);
    powers += fmt::format("  {{{}}},\n", fmt::join(term.powers, ", "));
    for (const int power : term.powers) operations += power;
    ++operations;
  }
  c.tables += "static const unsigned char prism_power[PRISM_TERMS][PRISM_INPUTS] = {\n" + powers + "};\n";
  c.bytes += static_cast<int>(model.terms().size() * model.info().inputs.size());
  c.table("prism_coefficient", "[PRISM_TERMS]", coefficients);
  return operations;
}

/// Codes of the inputs, PRISM_INPUT_T and so on.
std::string input_codes(const std::vector<std::string>& inputs) {
  std::vector<std::string> codes;
  for (const std::string& name : inputs) {
    if (name == compensation::kInputTemperature) codes.push_back("PRISM_INPUT_T");
    if (name == compensation::kInputSlope) codes.push_back("PRISM_INPUT_SLOPE");
    if (name == compensation::kInputUhfo) codes.push_back("PRISM_INPUT_U");
    if (name.starts_with("lag")) codes.push_back("PRISM_INPUT_LAG1 + " + std::to_string(std::stoi(name.substr(3)) - 1));
  }
  return fmt::format("{}", fmt::join(codes, ", "));
}

struct Box {
  std::vector<double> min, max, low, high;  ///< low, high: with the margin
};

Box box_of(const ModelInfo& info) {
  Box box{info.domain.min, info.domain.max, {}, {}};
  for (std::size_t i = 0; i < box.min.size(); ++i) {
    const double room = compensation::margin_of(info, i) * (box.max[i] - box.min[i]);
    box.low.push_back(box.min[i] - room);
    box.high.push_back(box.max[i] + room);
  }
  return box;
}

/// Points that fill the training box, each tenth beyond it; usual values if the model has no box.
std::vector<double> test_point(const ModelInfo& info, int k) {
  constexpr double kGolden = 0.6180339887498949;
  std::vector<double> point;
  for (std::size_t i = 0; i < info.inputs.size(); ++i) {
    const std::string& name = info.inputs[i];
    double low = -5, high = 5;
    if (name == compensation::kInputTemperature) low = -40, high = 60;
    if (name == compensation::kInputSlope) low = -0.02, high = 0.02;
    if (name == compensation::kInputUhfo) low = 3, high = 7;
    if (!info.domain.min.empty()) low = info.domain.min[i], high = info.domain.max[i];
    double whole = 0, part = std::modf(0.5 + (k + 1) * std::pow(kGolden, static_cast<double>(i + 1)), &whole);
    if (k % 10 == 9) part = 1.6 * part - 0.3;
    point.push_back(low + part * (high - low));
  }
  return point;
}

/// A curved ramp of temperature through the middle of the box, one value a second: its slope rises from half of the
/// step to one and a half.
struct Ramp {
  double start_degc = 25, step_degc = 0.001, uhfo_v = 5;
};

Ramp ramp_of(const ModelInfo& info, int seconds) {
  Ramp ramp;
  double half_degc = 10;
  for (std::size_t i = 0; i < info.domain.min.size(); ++i) {
    const double low = info.domain.min[i], high = info.domain.max[i], middle = (low + high) / 2;
    if (info.inputs[i] == compensation::kInputTemperature) ramp.start_degc = middle, half_degc = (high - low) / 4;
    if (info.inputs[i] == compensation::kInputSlope) ramp.step_degc = low + 0.7 * (high - low);
    if (info.inputs[i] == compensation::kInputUhfo) ramp.uhfo_v = middle;
  }
  ramp.step_degc = std::clamp(ramp.step_degc, -half_degc / seconds, half_degc / seconds);
  return ramp;
}

/// The biases that prismd publishes for the last kRamp seconds of the ramp; empty if one is unknown.
std::vector<double> ramp_biases(const ModelPtr& model, const Ramp& ramp, int seconds, const COptions& options) {
  compensation::CompensationSettings settings;
  settings.extrapolation = options.clamp ? compensation::Extrapolation::kClamp : compensation::Extrapolation::kFlag;
  compensation::CompensationEngine engine(settings);
  std::vector<double> biases;
  if (!engine.use(model, nullptr)) return {};
  for (int second = 0; second <= seconds; ++second) {
    Sample sample;
    sample.time_ns = (second + 1) * compensation::kNanosecondsPerSecond;
    sample.rate_deg_per_h = 1;
    sample.interval_s = 1;
    sample.temperature_degc = ramp.start_degc + ramp.step_degc * second * (0.5 + 0.5 * second / seconds);
    sample.uhfo_v = ramp.uhfo_v;
    if (options.single) {
      sample.temperature_degc = static_cast<float>(sample.temperature_degc);
      sample.uhfo_v = static_cast<float>(sample.uhfo_v);
    }
    compensation::Compensated row;
    const auto closed = engine.push(sample, row);
    if (!closed || second <= seconds - kRamp) continue;
    if (!std::isfinite(closed->correction.bias_deg_per_h)) return {};
    biases.push_back(closed->correction.bias_deg_per_h);
  }
  return biases;
}

/// Rounding of the sum, deg/h: from the root of the sum of squares of its weights, which is large where terms cancel; 0
/// for polynomials.
double rounding(const Model& model, const COptions& options) {
  double weights = 0;
  if (const auto* composite = dynamic_cast<const compensation::CompositeModel*>(&model)) {
    const auto& p = composite->parameters();
    weights = p.variances.kernel.rbf * p.alpha.norm() * p.normalisation.target_scale;
  } else if (const auto* kernel = dynamic_cast<const compensation::LssvmModel*>(&model)) {
    weights = kernel->parameters().alpha.norm() * kernel->parameters().normalisation.target_scale;
  }
  return weights * (options.single ? 0x1p-24 : compensation::kKernelTolerance);
}

/// prism_pairs.h: inputs, and the biases that the library computes for them. Empty if the ramp has an unknown bias.
std::string pairs_text(const ModelPtr& model, const COptions& options) {
  const ModelInfo& info = model->info();
  const Box box = box_of(info);
  std::string inputs, biases, flags;
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (int k = 0; k < kPairs; ++k) {
    std::vector<double> point = test_point(info, k);
    if (options.single)
      std::transform(point.begin(), point.end(), point.begin(), [](double x) { return static_cast<float>(x); });
    bool outside = false;
    for (std::size_t i = 0; i < box.min.size(); ++i) outside |= point[i] < box.low[i] || point[i] > box.high[i];
    const std::vector<double> at = outside && options.clamp ? compensation::nearest_in_box(*model, point) : point;
    const double bias = model->bias_deg_per_h(at);
    least = std::min(least, bias);
    most = std::max(most, bias);
    inputs += "  " + CText(false).list(point) + ",\n";
    biases += fmt::format("  {:a},\n", bias);
    flags += outside ? "PRISM_EXTRAPOLATING, " : "0, ";
  }
  const int seconds = compensation::history_s(info.features) - 1 + kRamp;
  const Ramp ramp = ramp_of(info, seconds);
  const std::vector<double> ramp_bias = ramp_biases(model, ramp, seconds, options);
  if (ramp_bias.empty() || !std::isfinite(most - least)) return {};
  const double span = std::isfinite(model->bias_span_deg_per_h()) ? model->bias_span_deg_per_h() : most - least;
  const double tolerance =
      std::max(span * (options.single ? kFloatTolerance : kDoubleTolerance), rounding(*model, options));
  return fmt::format(
      "// Pairs of inputs and biases, deg/h, computed by prismcal for model {}.\n#include "
      "\"prism_predict.h\"\n\n#define PRISM_PAIRS {}\n"
      "#define PRISM_TOLERANCE {:a} // {} of the range of the correction\n"
      "static const double prism_pair_inputs[PRISM_PAIRS][PRISM_INPUTS] = {{\n{}}};\n"
      "static const double prism_pair_bias[PRISM_PAIRS] = {{\n{}}};\n"
      "static const unsigned prism_pair_flags[PRISM_PAIRS] = {{{}}};\n"
      "#define PRISM_RAMP {}\n#define PRISM_RAMP_T {:a}\n#define PRISM_RAMP_STEP {:a}\n#define PRISM_RAMP_U {:a}\n"
      "static const double prism_ramp_bias[PRISM_RAMP] = {};\n",
      info.id, kPairs, tolerance, tolerance / span, inputs, biases, flags, kRamp, ramp.start_degc, ramp.step_degc,
      ramp.uhfo_v, CText(false).list(ramp_bias));
}

/// prism_model.h. Sets `bytes` of its tables.
std::string model_text(const Model& model, const COptions& options, const std::vector<std::string>& remarks,
                       int& bytes) {
  const ModelInfo& info = model.info();
  const compensation::FeatureDefinition& f = info.features;
  const auto uses = [&](const char* name) {
    return std::find(info.inputs.begin(), info.inputs.end(), name) != info.inputs.end();
  };
  CText c(options.single);
  c.define("PRISM_FLOAT", options.single ? 1 : 0);
  c.define("PRISM_CLAMP", options.clamp ? 1 : 0);
  c.define("PRISM_LENGTH_S", f.length_s);
  c.define("PRISM_END_MEAN_S", f.end_mean_s);
  c.define("PRISM_LEAST_SQUARES", f.slope == compensation::SlopeMethod::kLeastSquares ? 1 : 0);
  c.define("PRISM_MAX_GAP_S", f.max_gap_s);
  c.define("PRISM_HISTORY_S", compensation::history_s(f));
  c.define("PRISM_INPUTS", static_cast<int>(info.inputs.size()));
  c.define("PRISM_USES_UHFO", uses(compensation::kInputUhfo) ? 1 : 0);
  c.define("PRISM_LAGS", static_cast<int>(f.lag_time_constants_s.size()));
  c.defines +=
      "#define PRISM_INPUT_T 0\n#define PRISM_INPUT_SLOPE 1\n#define PRISM_INPUT_U 2\n#define PRISM_INPUT_LAG1 3\n";
  c.tables += fmt::format("static const unsigned char prism_input[PRISM_INPUTS] = {{{}}};\n", input_codes(info.inputs));
  if (const auto& lags = f.lag_time_constants_s; !lags.empty()) {
    const double bridge_s = std::max<double>(f.max_gap_s + 1, *std::min_element(lags.begin(), lags.end()) / 10);
    c.defines += fmt::format("#define PRISM_LAG_BRIDGE_S {:a}\n#define PRISM_LAG_SETTLED_S {:a}\n", bridge_s,
                             3 * *std::max_element(lags.begin(), lags.end()));
    c.tables += fmt::format("static const double prism_lag_s[PRISM_LAGS] = {};\n", CText(false).list(lags));
    c.bytes += static_cast<int>(lags.size() * sizeof(double));
  }
  const compensation::CompensationSettings settings;
  c.define("PRISM_HUGE", 1e30);
  c.define("PRISM_MAX_BIAS", settings.max_bias_deg_per_h);
  c.define("PRISM_MAX_SLEW",
           compensation::greatest_slew_deg_per_h_per_s(model, settings.slew, settings.max_bias_deg_per_h));
  c.define("PRISM_HAS_RANGE", info.domain.min.empty() ? 0 : 1);
  if (const Box box = box_of(info); !box.min.empty()) {
    c.table("prism_low", "[PRISM_INPUTS]", box.low);
    c.table("prism_high", "[PRISM_INPUTS]", box.high);
    if (options.clamp) {
      c.table("prism_min", "[PRISM_INPUTS]", box.min);
      c.table("prism_max", "[PRISM_INPUTS]", box.max);
    }
  }
  int operations = 0;
  if (const auto* polynomial = dynamic_cast<const PolynomialModel*>(&model)) {
    operations = append_polynomial(c, *polynomial);
  } else if (const auto* composite = dynamic_cast<const CompositeModel*>(&model)) {
    operations = append_kernel(c, sum_of(*composite));
  } else {
    operations = append_kernel(c, sum_of(static_cast<const LssvmModel&>(model)));
  }
  c.define("PRISM_OPERATIONS", operations);
  bytes = c.bytes;
  std::string text = fmt::format("// Model {}, {}, as tables. Inputs: {}. Made by prismcal export.\n", info.id,
                                 info.kind, fmt::join(info.inputs, ", "));
  for (const std::string& remark : remarks) text += "// " + remark + "\n";
  return text + fmt::format(
                    "#ifndef PRISM_MODEL_H\n#define PRISM_MODEL_H\n\ntypedef {} prism_number;\n{}\n#endif\n\n#ifdef "
                    "PRISM_TABLES\n{}#endif\n",
                    options.single ? "float" : "double", c.defines, c.tables);
}

/// The parts of prismd's correction that the files lack.
std::vector<std::string> not_exported(const Model& model, const COptions& options) {
  const auto* composite = dynamic_cast<const CompositeModel*>(&model);
  const auto* kernel = dynamic_cast<const LssvmModel*>(&model);
  std::vector<std::string> remarks;
  if (composite || (kernel && kernel->parameters().uncertainty))
    remarks.push_back(
        "Not exported: the variance, by which prismd also marks points far from the training samples as "
        "extrapolating; here only the training range counts.");
  if (composite) {
    remarks.push_back(
        fmt::format("Not exported: shrinking towards the training mean, which needs a matrix of {0} x {0} numbers; "
                    "prismd gives the same biases with \"extrapolation\": \"{1}\".",
                    composite->parameters().centres.cols(), options.clamp ? "clamp" : "flag"));
  }
  if (model.info().domain.min.empty())
    remarks.push_back("The model has no training range: nothing is marked as extrapolating.");
  return remarks;
}

Result<CExport> files_of(const ModelPtr& model, const std::string& where, const COptions& options,
                         std::vector<std::string> remarks) {
  const double error = rounding(*model, options), most = kFloatTolerance / 3 * model->bias_span_deg_per_h();
  if (options.single && error > most)
    return make_error(where, fmt::format("as float, rounding changes the bias by about {:.1g} deg/h, expected at most "
                                         "{:.1g}: its terms cancel; export it without --float",
                                         error, most));
  const std::string pairs = pairs_text(model, options);
  if (pairs.empty())
    return make_error(where, "found a bias that is unknown or above 100 deg/h in the middle of the training range");
  CExport done;
  done.files = {{"prism_model.h", model_text(*model, options, remarks, done.bytes)}, {"prism_pairs.h", pairs}};
  for (const EvaluatorFile& file : kEvaluator) done.files.push_back({file.name, file.text});
  done.remarks = std::move(remarks);
  return done;
}

}  // namespace

Result<CExport> export_c(const ModelPtr& model, const std::string& where, const COptions& options) {
  const ModelInfo& info = model->info();
  if (info.table) return make_error(where, "trained on a CSV table, expected a model that prismd can use");
  if (!info.features.sensors.empty())
    return make_error(where,
                      "has inputs of sensors, expected T, dTdt, U and lags only: the C evaluator knows no other");
  const auto* composite = dynamic_cast<const CompositeModel*>(model.get());
  if (composite && composite->parameters().prior)
    return make_error(where,
                      "contains the models of other gyros (train --prior), expected one model: train it without");
  std::vector<std::string> remarks = not_exported(*model, options);
  int bytes = 0;
  model_text(*model, options, remarks, bytes);
  if (options.max_bytes == 0 || bytes <= options.max_bytes) return files_of(model, where, options, std::move(remarks));
  const int centre_bytes = CText(options.single).size() * static_cast<int>(info.inputs.size() + 1);
  const int centres = centres_of(*model),
            most = centres - (bytes - options.max_bytes + centre_bytes - 1) / centre_bytes;
  if (most < 1)
    return make_error(where, fmt::format("its tables have {} bytes without a centre, expected at most {}",
                                         bytes - centres * centre_bytes, options.max_bytes));
  const auto fewer = fewer_centres(*model, most);
  if (!fewer) return tl::unexpected(fewer.error());
  const auto loss = options.loss(*fewer);
  if (!loss) return tl::unexpected(loss.error());
  remarks.push_back(
      fmt::format("{} of the {} centres of model {:.12}: {}", centres_of(**fewer), centres, info.id, *loss));
  return files_of(*fewer, where, options, std::move(remarks));
}

}  // namespace prism::c_export
