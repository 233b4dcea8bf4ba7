// SPDX-License-Identifier: MIT
// A model as C99 files for firmware: tables, a fixed evaluator, and a self-test with values of the library.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "compensation/compensation_engine.hpp"
#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/polynomial_model.hpp"
#include "compensation/training/low_rank.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"

namespace prism::commands {
namespace {

struct COptions {
  bool single = false;                                                      ///< numbers are float instead of double
  compensation::Extrapolation policy = compensation::Extrapolation::kFlag;  ///< or kClamp
  int max_bytes = 0;  ///< of the tables: a larger kernel model loses centres; 0: no limit
};

using compensation::CompositeModel, compensation::Extrapolation, compensation::LssvmModel;
using compensation::Model, compensation::ModelInfo, compensation::ModelPtr;
using Eigen::MatrixXd, Eigen::VectorXd;

/// Names and texts.
constexpr std::pair<const char*, const char*> kEvaluator[] = {
#include "tools/prismcal/evaluator.inc"
};

constexpr int kPairs = 100, kRamp = 20;
constexpr double kDoubleTolerance = 1e-12, kFloatTolerance = 5e-5;  // of the range of the correction

/// A kernel model of any type, in the form of the composite ones.
struct KernelForm {
  compensation::CompositeKernel kernel;
  MatrixXd centres;
  VectorXd alpha;
  double constant = 0;
  compensation::Normalisation normalisation;
};

/// Nullopt: a polynomial.
std::optional<KernelForm> kernel_form(const Model& model) {
  if (const auto* composite = dynamic_cast<const CompositeModel*>(&model)) {
    const auto& p = composite->parameters();
    return KernelForm{p.variances.kernel, p.centres, p.alpha, p.beta, p.normalisation};
  }
  const auto* kernel = dynamic_cast<const LssvmModel*>(&model);
  if (!kernel) return std::nullopt;
  const auto& p = kernel->parameters();
  compensation::CompositeKernel one_length;
  one_length.length2 = VectorXd::Constant(p.centres.rows(), p.sigma2);
  return KernelForm{std::move(one_length), p.centres, p.alpha, p.b, p.normalisation};
}

/// The evaluator's form of all models: Σ weight exp(−|z − centre|²) + Σ coefficient Π z^power, z = (input − shift) /
/// scale.
struct Sum {
  VectorXd shift, scale;
  MatrixXd centres;
  VectorXd weight;
  std::vector<compensation::Term> terms;
};

Sum sum_of(const Model& model) {
  const auto d = static_cast<Eigen::Index>(model.info().inputs.size());
  const auto form = kernel_form(model);
  if (!form) {
    const auto& polynomial = dynamic_cast<const compensation::PolynomialModel&>(model);
    return {VectorXd::Zero(d), VectorXd::Ones(d), {}, {}, polynomial.terms()};
  }
  const auto& [kernel, centres, alpha, constant, n] = *form;
  const VectorXd length = (2 * kernel.length2).cwiseSqrt();
  Sum sum{n.input_shift,
          n.input_scale.cwiseProduct(length),
          length.cwiseInverse().asDiagonal() * centres,
          kernel.rbf * n.target_scale * alpha,
          {}};
  const auto add = [&](double coefficient, const std::vector<Eigen::Index>& factors) {
    sum.terms.push_back({std::vector<int>(model.info().inputs.size()), coefficient});
    for (const Eigen::Index i : factors) ++sum.terms.back().powers[static_cast<std::size_t>(i)];
  };
  add(constant * n.target_scale + n.target_shift, {});
  if (kernel.linear == 0 && kernel.quadratic == 0) return sum;
  const MatrixXd points = length.asDiagonal() * centres;  // z · point = x · centre
  const VectorXd linear = kernel.linear * n.target_scale * points * alpha;
  const MatrixXd quadratic = kernel.quadratic * n.target_scale * points * alpha.asDiagonal() * points.transpose();
  for (Eigen::Index i = 0; i < d; ++i) {
    add(linear[i], {i});
    add(quadratic(i, i), {i, i});
    for (Eigen::Index j = 0; j < i; ++j) add(2 * quadratic(i, j), {i, j});
  }
  return sum;
}

/// The model with at most `most` (> 0) of its centres, chosen by pivoted Cholesky, and the weights of the function
/// nearest to its own in the kernel's norm. Without a usable standard deviation. Needs a kernel model without a prior.
Result<ModelPtr> fewer_centres(const Model& model, int most) {
  constexpr double kNoMore = 1e-12;  // of the largest variance: a further centre would only add rounding
  // K ≈ Gᵀ G, G = [R ·] with R over the pivots p: the projection's weights w solve K_pp w = K_p alpha, R w = G alpha.
  const KernelForm form = *kernel_form(model);
  const MatrixXd kernel = form.kernel.matrix(form.centres);
  const VectorXd variance = kernel.diagonal();
  const auto found = training::pivoted_cholesky(
      variance, [&kernel](Eigen::Index i, VectorXd& row) { row = kernel.col(i); }, kNoMore * variance.maxCoeff(), most);
  const auto g = found.phi.topRows(found.rank());
  const MatrixXd r = g(Eigen::all, found.pivots), centres = form.centres(Eigen::all, found.pivots);
  const VectorXd right = g * form.alpha, alpha = r.triangularView<Eigen::Upper>().solve(right);
  if (const auto* composite = dynamic_cast<const CompositeModel*>(&model)) {
    auto p = composite->parameters();
    p.centres = centres;
    p.alpha = alpha;
    p.gram = MatrixXd::Identity(centres.cols() + 1, centres.cols() + 1);
    return CompositeModel::make(model.info(), std::move(p));
  }
  auto p = dynamic_cast<const LssvmModel&>(model).parameters();
  p.centres = centres;
  p.alpha = alpha;
  p.weight.resize(0);
  p.uncertainty.reset();
  return LssvmModel::make(model.info(), std::move(p));
}

/// Codes of the inputs in prism_predict.c.
int input_code(const std::string& name) {
  if (name == compensation::kInputTemperature) return 0;
  return name == compensation::kInputUhfo ? 1 : 2;  // slope
}

double rounded(double value, const COptions& options) { return options.single ? static_cast<float>(value) : value; }
std::size_t number_bytes(const COptions& options) { return options.single ? sizeof(float) : sizeof(double); }

/// prism_model.h after its first lines, and the bytes of its tables.
std::pair<std::string, int> tables_of(const Model& model, const COptions& options) {
  const ModelInfo& info = model.info();
  const compensation::FeatureDefinition& f = info.features;
  const std::size_t inputs = info.inputs.size();
  std::string defines, tables;
  int bytes = 0;
  const auto define = [&](const char* name, auto value) { defines += fmt::format("#define {} {}\n", name, value); };
  const auto table = [&](const char* name, const char* size, const auto& values) {
    constexpr bool kInteger = std::is_integral_v<std::decay_t<decltype(*values.begin())>>;
    std::size_t count = 0;
    tables += fmt::format("static const {} {}[{}] = {{", kInteger ? "unsigned char" : "prism_number", name, size);
    for (const auto value : values) {
      if (count > 0) tables += count % inputs == 0 ? ",\n  " : ", ";
      tables += kInteger || value == 0 ? fmt::format("{:.0f}", static_cast<double>(value))  // 0x0p-1022 by fmt 10
                                       : fmt::format("{:a}", rounded(value, options));
      ++count;
    }
    tables += "};\n";
    bytes += static_cast<int>(count * (kInteger ? 1 : number_bytes(options)));
  };
  const Sum sum = sum_of(model);
  const compensation::Domain none{std::vector(inputs, -1e30), std::vector(inputs, 1e30)};
  const compensation::Domain& box = info.domain.min.empty() ? none : info.domain;
  std::vector<int> codes, powers;
  std::vector<double> margins, coefficients;
  for (std::size_t i = 0; i < inputs; ++i) {
    codes.push_back(input_code(info.inputs[i]));
    margins.push_back(compensation::margin_of(info, i));
  }
  for (const compensation::Term& term : sum.terms) {
    powers.insert(powers.end(), term.powers.begin(), term.powers.end());
    coefficients.push_back(term.coefficient);
  }
  const compensation::CompensationSettings settings;
  define("PRISM_EXP", options.single ? "expf" : "exp");
  define("PRISM_CLAMP", options.policy == Extrapolation::kClamp ? 1 : 0);
  define("PRISM_LENGTH_S", f.length_s);
  define("PRISM_END_MEAN_S", f.end_mean_s);
  define("PRISM_LEAST_SQUARES", f.slope == compensation::SlopeMethod::kLeastSquares ? 1 : 0);
  define("PRISM_MAX_GAP_S", f.max_gap_s);
  define("PRISM_HISTORY_S", compensation::history_s(f));
  define("PRISM_INPUTS", inputs);
  define("PRISM_QUANTITIES", std::ranges::find(codes, 1) == codes.end() ? 1 : 2);
  define("PRISM_RESPONSE_S", f.response_s);
  define("PRISM_RESPONSE_BRIDGE_S", std::max(f.max_gap_s + 1, f.response_s / 10));
  define("PRISM_RESPONSE_SETTLED_S", 3 * f.response_s);
  define("PRISM_MAX_BIAS", settings.max_bias_deg_per_h);
  define("PRISM_MAX_SLEW",
         compensation::greatest_slew_deg_per_h_per_s(model, settings.slew, settings.max_bias_deg_per_h));
  define("PRISM_CENTRES", sum.weight.size());
  define("PRISM_TERMS", coefficients.size());
  table("prism_input", "PRISM_INPUTS", codes);
  table("prism_min", "PRISM_INPUTS", box.min);
  table("prism_max", "PRISM_INPUTS", box.max);
  table("prism_margin", "PRISM_INPUTS", margins);
  table("prism_shift", "PRISM_INPUTS", sum.shift);
  table("prism_scale", "PRISM_INPUTS", sum.scale);
  table("prism_power", "PRISM_TERMS * PRISM_INPUTS", powers);
  table("prism_coefficient", "PRISM_TERMS", coefficients);
  if (sum.weight.size() > 0) {
    table("prism_centre", "PRISM_CENTRES * PRISM_INPUTS", sum.centres.reshaped());
    table("prism_weight", "PRISM_CENTRES", sum.weight);
  }
  return {fmt::format("#ifndef PRISM_MODEL_H\n#define PRISM_MODEL_H\n\ntypedef {} prism_number;\n{}\n#endif\n\n#ifdef "
                      "PRISM_TABLES\n{}#endif\n",
                      options.single ? "float" : "double", defines, tables),
          bytes};
}

/// The training range of an input; a usual one if the model has none.
std::pair<double, double> range_of(const ModelInfo& info, const std::string& input) {
  const auto at = std::ranges::find(info.inputs, input) - info.inputs.begin();
  const auto i = static_cast<std::size_t>(at);
  if (i < info.domain.min.size()) return {info.domain.min[i], info.domain.max[i]};
  if (input == compensation::kInputTemperature) return {-40, 60};
  if (input == compensation::kInputSlope) return {-0.02, 0.02};
  return {3, 7};  // of U
}

/// Points that fill the training box; each tenth is of a box that is larger by 60 %. Multiples of 1/g, 1/g², … modulo
/// 1, g^(d + 1) = g + 1 for d inputs, whose parts are independent (Roberts 2018).
std::vector<double> test_point(const ModelInfo& info, int k, const COptions& options) {
  constexpr double kRoots[] = {1.618033988749895, 1.324717957244746, 1.2207440846057596};  // T, dT/dt and U at most
  const double root = kRoots[info.inputs.size() - 1];
  double step = 1;
  std::vector<double> point;
  for (const std::string& name : info.inputs) {
    const auto [low, high] = range_of(info, name);
    step /= root;
    const double turns = 0.5 + (k + 1) * step;
    double part = turns - std::floor(turns);
    if (k % 10 == 9) part = 1.6 * part - 0.3;
    point.push_back(rounded(low + part * (high - low), options));
  }
  return point;
}

/// A curved ramp of temperature, one value a second: its slope rises from half of the step to one and a half. Returns
/// the biases that prismd publishes for its last kRamp seconds; kUnknown: none.
std::vector<double> ramp_biases(const Model& model, double start_degc, double step_degc, double uhfo_v,
                                const COptions& options) {
  const int seconds = compensation::history_s(model.info().features) - 1 + kRamp;
  compensation::FeatureExtractor windows(model.info().features);
  std::vector<double> biases;
  for (int second = 0; second < seconds; ++second) {
    compensation::SecondMean mean;
    mean.second = second;
    mean.rate_deg_per_h = 1;
    mean.temperature_degc = rounded(start_degc + step_degc * second * (0.5 + 0.5 * second / seconds), options);
    mean.uhfo_v = rounded(uhfo_v, options);
    const std::vector<double> inputs = gather_inputs(model, windows.push(mean));
    if (second < seconds - kRamp) continue;
    biases.push_back(inputs.empty() ? kUnknown : predict_within(model, inputs, options.policy).bias_deg_per_h);
  }
  return biases;
}

/// Rounding of the sum, deg/h: from the root of the sum of squares of its weights, which is large where terms cancel; 0
/// for polynomials.
double rounding(const Model& model, const COptions& options) {
  return sum_of(model).weight.norm() * (options.single ? 0x1p-24 : compensation::kKernelTolerance);
}

/// prism_pairs.h: inputs, and the biases that the library computes for them. Empty if the ramp has an unknown bias.
std::string pairs_text(const Model& model, const COptions& options) {
  const ModelInfo& info = model.info();
  const auto& [min, max] = info.domain;
  std::string pairs;
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (int k = 0; k < kPairs; ++k) {
    const std::vector<double> point = test_point(info, k, options);
    const std::vector<double> nearest = nearest_in_box(model, point);
    bool outside = false;
    for (std::size_t i = 0; i < min.size(); ++i)
      outside |= std::abs(point[i] - nearest[i]) > compensation::margin_of(info, i) * (max[i] - min[i]);
    const bool clamps = outside && options.policy == Extrapolation::kClamp;
    const double bias = model.bias_deg_per_h(clamps ? nearest : point);
    least = std::min(least, bias);
    most = std::max(most, bias);
    pairs +=
        fmt::format("  {{{{{:a}}}, {:a}, {}}},\n", fmt::join(point, ", "), bias, outside ? "PRISM_EXTRAPOLATING" : "0");
  }
  const auto [coldest, warmest] = range_of(info, compensation::kInputTemperature);
  const auto [slope, steepest] = range_of(info, compensation::kInputSlope);
  const auto [lowest_v, highest_v] = range_of(info, compensation::kInputUhfo);
  const double most_degc = (warmest - coldest) / 4 / (compensation::history_s(info.features) - 1 + kRamp);
  const double start_degc = (coldest + warmest) / 2, uhfo_v = (lowest_v + highest_v) / 2;
  const double step_degc = std::clamp(slope + 0.7 * (steepest - slope), -most_degc, most_degc);
  const std::vector<double> ramp = ramp_biases(model, start_degc, step_degc, uhfo_v, options);
  const double limit = compensation::CompensationSettings().max_bias_deg_per_h;
  const bool published = std::ranges::all_of(ramp, [&](double bias) { return std::fabs(bias) <= limit; });
  if (!published || !std::isfinite(most - least)) return {};
  const double span = std::isfinite(model.bias_span_deg_per_h()) ? model.bias_span_deg_per_h() : most - least;
  const double tolerance =
      std::max(span * (options.single ? kFloatTolerance : kDoubleTolerance), rounding(model, options));
  return fmt::format(
      "// Pairs of inputs and biases, deg/h, computed by prismcal for model {}.\n#include \"prism_predict.h\"\n\n"
      "#define PRISM_PAIRS {}\n#define PRISM_TOLERANCE {:a} // {} of the range of the correction\n"
      "static const struct {{\n  double inputs[PRISM_INPUTS], bias;\n  unsigned flags;\n}} prism_pairs[PRISM_PAIRS] = "
      "{{\n{}}};\n"
      "#define PRISM_RAMP {}\n#define PRISM_RAMP_T {:a}\n#define PRISM_RAMP_STEP {:a}\n#define PRISM_RAMP_U {:a}\n"
      "static const double prism_ramp_bias[PRISM_RAMP] = {{{:a}}};\n",
      info.id, kPairs, tolerance, tolerance / span, pairs, kRamp, start_degc, step_degc, uhfo_v, fmt::join(ramp, ", "));
}

/// The bias stability of a recording with a model and with its replacement, and the largest difference of both.
Result<std::string> loss_on(const Loaded& loaded, const compensation::ModelPtr& model,
                            const compensation::ModelPtr& fewer, compensation::Extrapolation policy) {
  analysis::CorrectionSettings settings;
  settings.engine.extrapolation = policy;
  const auto all = analysis::evaluate_model(model, loaded.table, settings, evaluation::Divisor::kNMinus1);
  if (!all) return tl::unexpected(all.error());
  const auto less = analysis::evaluate_model(fewer, loaded.table, settings, evaluation::Divisor::kNMinus1);
  if (!less) return tl::unexpected(less.error());
  double largest = 0;
  for (std::size_t i = 0; i < all->predicted_deg_per_h.size(); ++i)
    largest = std::fmax(largest, std::abs(all->predicted_deg_per_h[i] - less->predicted_deg_per_h[i]));
  return fmt::format(
      "on {} the bias differs by at most {:.2g} deg/h, and its standard deviation after correction is "
      "{:.4g} instead of {:.4g} deg/h ({:.4g} without correction).",
      printable(loaded.table.name), largest, less->stability.after.sd, all->stability.after.sd,
      all->stability.before.sd);
}

/// Parts of the correction of prismd that the files do not have, one sentence each.
std::vector<std::string> left_out(const Model& model, const COptions& options) {
  std::vector<std::string> remarks;
  if (model.predict(test_point(model.info(), 0, options)).knowledge)
    remarks.push_back(
        "Not exported: the variance, by which prismd also marks points far from the training samples as "
        "extrapolating; here only the training range counts.");
  if (const auto* composite = dynamic_cast<const CompositeModel*>(&model))
    remarks.push_back(
        fmt::format("Not exported: shrinking towards the training mean, which needs a matrix of {0} x {0} numbers; "
                    "prismd gives the same biases with \"extrapolation\": \"{1}\".",
                    composite->parameters().centres.cols(), extrapolation_name(options.policy)));
  if (model.info().domain.min.empty())
    remarks.push_back("The model has no training range: nothing is marked as extrapolating.");
  return remarks;
}

struct ExportChoice {
  std::string model, folder, recording, policy = "flag";
  CommonOptions common;  ///< of the recording
  COptions c;
};

Result<int> run(const ExportChoice& choice) {
  const std::string& where = choice.model;
  const auto model = load_model(where);
  if (!model) return tl::unexpected(model.error());
  const ModelInfo& info = (*model)->info();
  if (info.table) return make_error(where, "trained on a CSV table, expected a model that prismd can use");
  if (!info.features.sensors.empty())
    return make_error(where, "has inputs of sensors, expected T, dTdt and U only: the C evaluator knows no other");
  const auto* composite = dynamic_cast<const CompositeModel*>(model->get());
  if (composite && composite->parameters().prior)
    return make_error(where,
                      "contains the models of other gyros (train --prior), expected one model: train it without");
  COptions options = choice.c;
  if (choice.policy == "clamp") options.policy = Extrapolation::kClamp;
  std::optional<Loaded> recording;
  if (options.max_bytes > 0) {
    auto blocks = load_blocks(choice.recording, info, choice.common);
    if (!blocks) return tl::unexpected(blocks.error());
    recording = std::move(*blocks);
  }
  std::vector<std::string> remarks = left_out(**model, options);
  ModelPtr exported = *model;
  auto [tables, table_bytes] = tables_of(*exported, options);
  if (recording && table_bytes > options.max_bytes) {
    const auto form = kernel_form(**model);
    const int bytes = static_cast<int>((info.inputs.size() + 1) * number_bytes(options));
    const int centres = form ? static_cast<int>(form->alpha.size()) : 0;
    const int most = centres - (table_bytes - options.max_bytes + bytes - 1) / bytes;
    if (most < 1)
      return make_error(where, fmt::format("its tables have {} bytes without a centre, expected at most {}",
                                           table_bytes - centres * bytes, options.max_bytes));
    const auto fewer = fewer_centres(**model, most);
    if (!fewer) return tl::unexpected(fewer.error());
    const auto loss = loss_on(*recording, *model, *fewer, options.policy);
    if (!loss) return tl::unexpected(loss.error());
    exported = *fewer;
    std::tie(tables, table_bytes) = tables_of(*exported, options);
    remarks.push_back(fmt::format("{} of the {} centres of model {:.12}: {}", kernel_form(*exported)->alpha.size(),
                                  centres, info.id, *loss));
  }
  const double error = rounding(*exported, options), most = kFloatTolerance / 3 * exported->bias_span_deg_per_h();
  if (options.single && error > most)
    return make_error(where, fmt::format("as float, rounding changes the bias by about {:.1g} deg/h, expected at most "
                                         "{:.1g}: its terms cancel; export it without --float",
                                         error, most));
  std::map<std::string, std::string> files(std::begin(kEvaluator), std::end(kEvaluator));  // texts by name
  std::string& text = files["prism_model.h"];
  text = fmt::format("// Model {}, {}, as tables. Inputs: {}. Made by prismcal export.\n", exported->info().id,
                     info.kind, fmt::join(info.inputs, ", "));
  for (const std::string& remark : remarks) text += "// " + remark + "\n";
  text += tables;
  files["prism_pairs.h"] = pairs_text(*exported, options);
  if (files["prism_pairs.h"].empty())
    return make_error(where, "found a bias that is unknown or above 100 deg/h in the middle of the training range");
  const std::filesystem::path folder = choice.folder;
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) return make_error(choice.folder, failure.message());
  for (const auto& [name, content] : files) {
    if (auto done = write_text_file((folder / name).string(), content); !done) return tl::unexpected(done.error());
  }
  for (const std::string& remark : remarks) fmt::print(stderr, "prismcal: {}: {}\n", where, remark);
  fmt::print("{}: {} files, {} bytes of tables\n", choice.folder, files.size(), table_bytes);
  return 0;
}

}  // namespace

void add_export_command(CLI::App& app, int& code) {
  const auto [command, choice] =
      new_command<ExportChoice>(app, code, "export", "write a model as C99 source for firmware", run);
  add_options(command,
              {{"model", &choice.model, "model file"},
               {"--c", &choice.folder, "folder for the C files; files of the same names are replaced"}},
              Need::kRequired);
  const auto options = add_options(
      command,
      {{"--float", &choice.c.single, "numbers are float, not double"},
       {"--extrapolation", &choice.policy, "outside the training range: flag or clamp", one_of({"flag", "clamp"})},
       {"--max-bytes", &choice.c.max_bytes, "most bytes of tables: kernel models lose centres", tools::positive()},
       {"--on", &choice.recording, "recording on which the loss by this is measured"}});
  options[2]->needs(options[3]);
  options[3]->needs(options[2]);
  add_source_options(command, choice.common.source);
  accept_site_options(command);
  choice.common.site.no_earth_rate = true;  // the loss does not depend on it
  choice.common.quiet = true;
  tools::add_examples(command, {"prismcal export model.json --c firmware",
                                "prismcal export model.json --c firmware --float --max-bytes 8000 --on data/log"});
}

}  // namespace prism::commands
