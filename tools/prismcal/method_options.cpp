// SPDX-License-Identifier: MIT
#include "tools/prismcal/method_options.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compensation/training/trainer.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::commands {
namespace {

std::string default_method() { return training::TrainingSettings().method->name; }

std::vector<std::string> known_methods() {
  std::vector<std::string> names;
  for (const training::Method& method : training::methods()) names.emplace_back(method.name);
  return names;
}

std::string method_help() {
  std::vector<std::string> names = known_methods();
  for (std::string& name : names)
    name += name == default_method() ? " (default)"
            : name == kDefaultTuned  ? " (default with --c, --sigma2 or --tune)"
                                     : "";
  const std::string last = std::move(names.back());
  names.pop_back();
  return fmt::format("{} or {}", fmt::join(names, ", "), last);
}

}  // namespace

void add_method_options(CLI::App& command, MethodOptions& o) {
  using training::method_names;
  const std::string terms = method_names(training::kTerms) + ": ";
  add_options(command, {{"--method", &o.method, method_help(), one_of(known_methods())},
                        {"--json", &o.json, "print JSON"},
                        {"--quiet", &o.quiet, "no progress on stderr"}});
  add_options(
      command,
      {{"--weight", &o.weight, method_names(training::kWeights) + ": huber, hampel, logistic or myriad (default)",
        one_of({"huber", "hampel", "logistic", "myriad"})},
       {"--c", &o.c, "regularisation, normalised units; with --sigma2: no tuning", tools::positive()},
       {"--sigma2", &o.sigma2, "kernel width squared, normalised units", tools::positive()},
       {"--beta", &o.beta, "Huber's parameter", tools::positive()},
       {"--delta", &o.delta, "myriad's parameter", tools::positive()},
       {"--epsilon", &o.epsilon, method_names(training::kTube) + ": half width of the tube, in sd of the target",
        tools::not_negative()},
       {"--tune", &o.tune,
        method_names(training::kTuning) + (o.tune.empty() ? ": blocked (folds; default), shuffled (folds), loo or reml"
                                                          : ": blocked (folds), shuffled (folds), loo or reml"),
        one_of({"blocked", "shuffled", "loo", "reml"})},
       {"--folds", &o.folds, "number of folds", tools::within(2, 1000000)},
       {"--reweight", &o.reweight, "1 (the paper) or converge", one_of({"1", "converge"})},
       {"--scale", &o.scale, "scale estimate of the residuals: mad or iqr", one_of({"mad", "iqr"})},
       {"--hampel-floor", &o.hampel_floor, "Hampel's weight of far outliers; 0 drops the sample", tools::within(0, 1)},
       {"--drift", &o.drift,
        method_names(training::kDrift) + ": thermal (default: what one passage cannot decide is mostly thermal), open "
                                         "(the record decides) or none (no drift in time)",
        one_of({"thermal", "open", "none"})},
       {"--normalise", &o.normalise, "zscore, auto (by column, as LS-SVMlab) or none",
        one_of({"zscore", "auto", "none"})},
       {"--seed", &o.seed, "seed of the random generator", tools::within(0, 1e15)},
       {"--threads", &o.threads, "maximum number of threads", tools::within(1, 64)},
       {"--start", &o.start, terms + "initial terms, or none"},
       {"--p-enter", &o.p_enter, terms + "p below which a term is added", tools::within(0, 1)},
       {"--p-remove", &o.p_remove, terms + "p above which a term is removed", tools::within(0, 1)},
       {"--memory", &o.memory_mb, "memory limit of training, MB", tools::positive()}},
      Need::kFew);
}

std::string method_name_of(const MethodOptions& options) {
  if (!options.method.empty()) return options.method;
  return options.c || options.sigma2 || !options.tune.empty() ? kDefaultTuned : default_method();
}

Result<training::TrainingSettings> settings_of(const MethodOptions& o) {
  training::TrainingSettings s;
  s.method = training::find_method(method_name_of(o));
  if (s.method->has(training::kOwnSearch) && (o.c || o.sigma2 || !o.tune.empty()))
    return make_error("--method", fmt::format("found {} with --c, --sigma2 or --tune, which need {}", s.method->name,
                                              training::method_names(training::kTuning, " and ")));
  s.reweight.weight.kind = training::WeightKind::kNone;
  if (s.method->has(training::kWeights)) {
    s.reweight.weight.kind = training::weight_by_name(o.weight.empty() ? "myriad" : o.weight);
  } else if (!o.weight.empty()) {
    return make_error("--weight", fmt::format("found \"{}\" with --method {}, expected it with {}", o.weight,
                                              s.method->name, training::method_names(training::kWeights, " or ")));
  }
  if (o.beta && s.reweight.weight.kind != training::WeightKind::kHuber)
    return make_error("--beta", "found it without --weight huber");
  if (o.delta && s.reweight.weight.kind != training::WeightKind::kMyriad)
    return make_error("--delta", "found it without --weight myriad");
  if (!o.drift.empty() && !s.method->has(training::kDrift))
    return make_error("--drift", fmt::format("found \"{}\" with --method {}, expected it with {}", o.drift,
                                             s.method->name, training::method_names(training::kDrift, " or ")));
  s.drift = o.drift == "open"   ? training::Drift::kOpen
            : o.drift == "none" ? training::Drift::kNone
                                : training::Drift::kThermal;
  s.parameter = o.beta ? o.beta : o.delta;
  s.reweight.weight.hampel_floor = o.hampel_floor;
  s.reweight.scale = o.scale == "mad" ? training::ScaleKind::kMad : training::ScaleKind::kIqr;
  s.reweight.limit = o.reweight == "1" ? 1 : 500;
  s.scaling = o.normalise == "zscore" ? training::NormalisationMethod::kZscore
              : o.normalise == "auto" ? training::NormalisationMethod::kAuto
                                      : training::NormalisationMethod::kNone;
  s.c = o.c;
  s.sigma2 = o.sigma2;
  s.epsilon = o.epsilon;
  s.tuning = training::tuning_by_name(o.tune.empty() ? "blocked" : o.tune);
  s.folds = o.folds;
  s.seed = o.seed;
  s.threads = o.threads;
  s.stepwise.p_enter = o.p_enter;
  s.stepwise.p_remove = o.p_remove;
  s.memory_limit_bytes = o.memory_mb * 1e6;
  return s;
}

Result<void> set_terms(const MethodOptions& options, const std::vector<std::string>& names, training::TermPowers terms,
                       std::vector<std::string> start, training::TrainingSettings& settings) {
  if (settings.method->has(training::kCubic)) {
    if (names.size() != 1)
      return make_error("--inputs",
                        fmt::format("found {} with --method {}, expected one: the model is a cubic of one input",
                                    names.size(), settings.method->name));
    settings.terms = training::cubic_terms();
  }
  if (!settings.method->has(training::kTerms)) return {};
  settings.terms = std::move(terms);
  std::vector<std::string> known;
  for (const auto& powers : settings.terms) known.push_back(training::term_name(powers, names));
  if (!options.start.empty()) start = tables::list_items(options.start == "none" ? "" : options.start);
  for (const std::string& wanted : start) {
    const auto at = std::find(known.begin(), known.end(), wanted);
    if (at != known.end()) settings.stepwise.start.push_back(static_cast<int>(at - known.begin()));
    if (at == known.end() && !options.start.empty())
      return make_error("--start", fmt::format("found \"{}\", expected terms of {}", wanted, fmt::join(known, ", ")));
  }
  return {};
}

}  // namespace prism::commands
