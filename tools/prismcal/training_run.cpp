// SPDX-License-Identifier: MIT
#include "tools/prismcal/training_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/text_number.hpp"
#include "compensation/composite_model.hpp"
#include "compensation/evaluation/allan.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/model_text.hpp"
#include "compensation/training/composite.hpp"
#include "compensation/training/response.hpp"
#include "compensation/training/trainer.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/model_evaluation.hpp"

namespace prism::commands {
namespace {

/// An input that has the same value in all samples; the temperature's first, because it is the reason of others.
std::optional<Error> constant_input(const training::TrainingData& data) {
  std::vector<std::string> changing;
  std::optional<Error> constant;
  for (std::size_t d = 0; d < data.names.size(); ++d) {
    const auto row = data.inputs.row(static_cast<Eigen::Index>(d));
    const double value = row.minCoeff();
    if (value != row.maxCoeff()) {
      changing.push_back(data.names[d]);
    } else if (!constant || data.names[d] == compensation::kInputTemperature) {
      constant = Error{"input " + data.names[d], fmt::format("always {:.6g}: it cannot explain anything", value)};
    }
  }
  if (constant && !changing.empty()) constant->what += fmt::format("; use --inputs {}", fmt::join(changing, ","));
  return constant;
}

constexpr const char* kAdvice =
    " Record again without these faults, or leave them out (--leave-out, or of the table); --force trains anyway.";

/// The worst of set.qualities. Adds them to set.facts and prints the findings that do not pass. Errors: one that is
/// rejected.
Result<evaluation::DataQuality> worst_quality(recordings::TrainingSet& set, const TrainChoice& choice) {
  std::optional<Error> rejected;
  evaluation::DataQuality worst = set.qualities.front();
  for (std::size_t i = 0; i < set.qualities.size(); ++i) {
    const evaluation::DataQuality& quality = set.qualities[i];
    const std::string& name = set.recordings[i].table.name;
    set.facts[i]["data_quality"] = analysis::data_quality_json(quality);
    for (const evaluation::Finding& finding : quality.findings) {
      if (finding.verdict != evaluation::Verdict::kPass && !choice.method.quiet)
        fmt::print(stderr, "{}: {}: {} {}\n", name, evaluation::verdict_text(finding.verdict), finding.name,
                   finding.text);
    }
    const std::string reason = analysis::data_quality_error(quality);
    if (!reason.empty()) rejected = Error{name, reason + kAdvice};
    if (quality.verdict > worst.verdict) worst = quality;
  }
  if (rejected && !choice.force) return tl::unexpected<Error>(*rejected);
  return worst;
}

std::string provenance(const recordings::TrainingSet& set, const nlohmann::ordered_json& summary) {
  nlohmann::ordered_json json = {{"tool", fmt::format("prismcal {}", kVersion)},
                                 {"made", utc_text(std::time(nullptr))}};
  json["recordings"] = set.facts;
  json["training"] = provenance_json(summary);
  return json_text(json);
}

std::string check_response(std::string& word) {
  const auto seconds = parse_number<int>(word);
  if (word == "auto" || (seconds && *seconds >= 0 && *seconds <= 1'000'000)) return {};
  return fmt::format("found \"{}\", expected auto or whole seconds within 0 to 1000000", word);
}

/// The samples with T and dTdt alone, the first two candidates.
training::TrainingData by_temperature(const training::TrainingData& data) {
  return {{compensation::kInputTemperature, compensation::kInputSlope},
          data.inputs.topRows(2),
          data.target,
          data.runs,
          data.time_s};
}

std::string response_text(const training::ResponseSearch& found) {
  return found.tau_s > 0
             ? fmt::format(
                   "the gyro follows this thermometer in {:.0f} min ({:.0f} to {:.0f}): T and dTdt are of its body",
                   found.tau_s / 60.0, found.low_s / 60, found.high_s / 60)
             : "the gyro follows this thermometer at once: T and dTdt are as measured";
}

/// N and B of what the model leaves; without a certain N, the noise that the model states. Nullopt if the recordings
/// have no one-second means.
std::optional<compensation::RateNoise> rate_noise_of(const training::TrainedModel& trained,
                                                     const recordings::TrainingSet& set) {
  const auto& spread = trained.model->info().spread;
  if (!spread || !(spread->noise_deg_per_h > 0) || !(set.second_sd_deg_per_h > 0)) return std::nullopt;
  const double length_s = set.features.length_s;
  compensation::RateNoise noise{spread->noise_deg_per_h * std::sqrt(length_s / 3600), 0, set.second_sd_deg_per_h};
  std::vector<double> left;
  for (Eigen::Index i = 0; i < set.data.target.size(); ++i) {
    if (i > 0 && set.data.time_s[i] - set.data.time_s[i - 1] != length_s) left.push_back(evaluation::kAllanBreak);
    left.push_back(set.data.target[i] - trained.samples.fitted[i]);
  }
  const auto allan = evaluation::analyse_allan(std::move(left), length_s, "");
  if (!allan || !allan->coefficients) return noise;
  const auto value = [&](evaluation::NoiseType type) { return coefficient(*allan->coefficients, type).value; };
  noise.n_deg_per_sqrt_h = value(evaluation::NoiseType::kAngleRandomWalk).value_or(noise.n_deg_per_sqrt_h);
  noise.b_deg_per_h = value(evaluation::NoiseType::kBiasInstability).value_or(0);
  return noise;
}

/// The attempts that the advice names if the model predicts badly. The paper's other methods are tried only against the
/// composite kernel: they take about as long as it does.
Attempts attempts_of(const TrainChoice& choice, const recordings::TrainingSet& set,
                     const training::TrainingSettings& settings, const evaluation::DataQuality& quality,
                     const std::optional<training::ResponseSearch>& response) {
  constexpr double kLong_h = 8;
  const bool narrow = std::ranges::any_of(quality.findings, [](const auto& finding) {
    return finding.name == std::string("temperature_span") && finding.verdict != evaluation::Verdict::kPass;
  });
  const double hours = static_cast<double>(set.data.target.size()) * set.features.length_s / 3600;
  Attempts tried{.method = settings.method->name,
                 .inputs = fmt::format("{}", fmt::join(set.data.names, ", ")),
                 .all_inputs = choice.inputs == "auto",
                 .longer_helps = hours < kLong_h || narrow || training::one_passage(set.data),
                 .others = {}};
  if (const int tau_s = set.features.response_s; tau_s > 0) {
    tried.inputs += fmt::format(" and a response of {:.0f} min", tau_s / 60.0);
  } else if (response) {
    tried.inputs += " and no response, which fits best";
  }
  if (!settings.method->has(training::kOwnSearch) || !settings.siblings.empty()) return tried;
  for (const char* const name : {"stepwise", "ir-lssvm"}) {
    MethodOptions options;
    options.method = name;
    options.settings.threads = choice.method.settings.threads;
    options.memory_mb = choice.method.memory_mb;
    auto other = settings_of(options);
    if (!other || !set_terms(options, set.data.names, *other)) continue;
    other->stop = settings.stop;
    compensation::ModelInfo info;
    info.features = set.features;
    const auto trained = training::train(set.data, std::move(info), *other);
    if (!trained) continue;
    if (const auto expected = expectation_of(trained->held_out, set.data))
      tried.others.emplace_back(name, expected->explained);
  }
  return tried;
}

}  // namespace

std::string TrainingRun::model_text() const {
  const auto& spread = trained.model->info().spread;
  return compensation::format_model(*trained.model, provenance(set, summary.json), rate_noise_of(trained, set),
                                    spread
                                        ? training::monitor_of(trained.held_out, *spread, training::runs_of(set.data),
                                                               set.data.time_s, set.features.length_s)
                                        : std::nullopt);
}

Result<TrainingRun> train_on_recordings(const TrainChoice& requested, const std::atomic<bool>* stop) {
  TrainChoice choice = requested;
  if (choice.method.quiet) choice.recordings.source.table.silence();
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  settings->stop = stop;
  int& response_s = choice.recordings.features.response_s;
  bool open = choice.response == "auto";
  if (!open) response_s = std::stoi(choice.response);
  std::optional<training::ResponseSearch> response;
  recordings::Unusable left_out;
  const auto read_once = [&](const std::vector<std::string>& inputs) {
    const bool several = choice.files.size() > 1;  // worst_quality() says more of one
    bool rejected = false;
    const auto judge = [&](const recordings::Loaded& loaded) -> Result<evaluation::DataQuality> {
      auto [quality, reason] = analysis::usability_of(loaded, true);
      if (!quality || !several || choice.force || reason.empty()) return quality;
      rejected = true;
      return make_error(loaded.table.name, reason);
    };
    auto set = recordings::read_training_set(choice.files, inputs, choice.recordings, judge);
    if (!set && rejected) set.error().what += kAdvice;
    if (!set) return set;
    for (const auto& entry : set->left_out) {
      std::erase(choice.files, entry.first);
      left_out.push_back(entry);
    }
    return set;
  };
  // Reads the recordings, and the models of --prior for their gyro. If the response is open, it is that of these
  // models, or the one by which T and dTdt predict the bias best: the recordings are read once more with it.
  const auto read = [&](const std::vector<std::string>& inputs) -> Result<recordings::TrainingSet> {
    auto set = read_once(inputs);
    if (!set) return set;
    if (!choice.prior.empty() && settings->siblings.empty()) {
      auto models = read_population_models(choice.prior, choice.serial.empty() ? set->serial : choice.serial);
      if (!models) return tl::unexpected<Error>(models.error());
      settings->siblings = std::move(*models);
    }
    if (!std::exchange(open, false)) return set;
    if (!settings->siblings.empty()) {
      response_s = settings->siblings.front()->info().features.response_s;
    } else {
      response = training::find_response(choice.inputs == "auto" ? by_temperature(set->data) : set->data, *settings,
                                         choice.recordings.features.length_s);
      if (response) response_s = response->tau_s;
    }
    return response_s == 0 ? std::move(set) : read_once(inputs);
  };
  std::optional<recordings::InputSearch> search;
  if (choice.inputs == "auto") {
    const auto candidates = recordings::candidate_inputs(choice.files.front(), choice.recordings);
    if (!candidates) return tl::unexpected<Error>(candidates.error());
    const auto all = read(*candidates);
    if (!all) return tl::unexpected<Error>(all.error());
    auto found = recordings::search_inputs(all->data);
    if (!found) return tl::unexpected<Error>(found.error());
    choice.inputs = fmt::format("{}", fmt::join(found->best().inputs, ","));
    search = std::move(*found);
    if (!choice.method.quiet) fmt::print(stderr, "{}", recordings::search_text(*search));
  }
  const std::vector<std::string> names = tables::list_items(choice.inputs);
  if (auto good = set_terms(choice.method, names, *settings); !good) return tl::unexpected<Error>(good.error());
  auto set = read(names);
  if (!set) return tl::unexpected<Error>(set.error());
  if (!choice.method.quiet) {
    for (const auto& [path, reason] : left_out) fmt::print(stderr, "left out: {}\n", printable(reason));
    for (const std::string& note : set->notes) fmt::print(stderr, "{}\n", note);
    if (response) fmt::print(stderr, "{}\n", response_text(*response));
  }
  // A recording that cannot be used must not be called usable first. Of a constant temperature its quality says more.
  const auto constant = constant_input(set->data);
  const bool is_temperature = constant && constant->where == std::string("input ") + compensation::kInputTemperature;
  if (constant && !is_temperature) return tl::unexpected<Error>(*constant);
  auto quality = worst_quality(*set, choice);
  if (!quality) return tl::unexpected<Error>(quality.error());
  if (constant) return tl::unexpected<Error>(*constant);
  set->recordings = {};  // a year has 80 MB of blocks
  const auto plan = training::plan_resources(set->data.inputs.cols(), set->data.inputs.rows(), *settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (!choice.method.quiet && plan->seconds > 0.5) fmt::print(stderr, "{}\n", plan->text());
  compensation::ModelInfo info;
  info.name = choice.name.empty() ? fmt::format("{} {}", settings->method->name, choice.inputs) : choice.name;
  if (choice.name.empty() && !choice.recordings.source.axis.empty()) info.name += " " + choice.recordings.source.axis;
  info.gyro_serial = choice.serial.empty() ? set->serial : choice.serial;
  if (!info.gyro_serial.empty()) info.gyro_axis = set->axis;
  info.features = set->features;
  if (info.gyro_serial.empty() && !choice.method.quiet)
    fmt::print(stderr, "the recordings name no gyro: the model is for any; --serial NAME binds it to one\n");
  settings->progress = progress_line(choice.method.quiet);
  auto trained = training::train(set->data, std::move(info), *settings);
  end_progress();
  if (!trained) return tl::unexpected<Error>(trained.error());
  if (stop && *stop) set->questions.insert(set->questions.begin(), kStoppedEarly);
  auto summary = summary_of(*trained, *settings, names);
  auto expected = expectation_of(trained->held_out, set->data);
  Judgement judgement = judge(*trained, expected, *quality, set->questions,
                              [&] { return attempts_of(requested, *set, *settings, *quality, response); });
  summary.json["stopped_early"] = stop && *stop;
  summary.json["readiness"] = readiness_text(judgement.readiness);
  summary.json["expected"] = expectation_json(expected);
  summary.json["recordings"] = set->facts;
  for (const auto& [path, reason] : left_out) summary.json["left_out"].push_back({{"path", path}, {"reason", reason}});
  if (response)
    summary.json["response"] = {{"tau_s", response->tau_s},
                                {"interval_s", {response->low_s, response->high_s}},
                                {"log_likelihood_gain", response->gain}};
  if (search) summary.json["input_search"] = recordings::search_json(*search);
  return TrainingRun{std::move(*trained), std::move(*set),      std::move(*quality),
                     std::move(expected), std::move(judgement), std::move(summary)};
}

void add_train_options(CLI::App& command, TrainChoice& choice) {
  add_options(command, {{"--inputs", &choice.inputs, "T, dTdt, U; for a sensor NAME, dNAME/dt, NAME-T; or auto"},
                        {"--response", &choice.response,
                         "time constant with which the gyro follows a thermometer outside it, s; 0: none; auto: by "
                         "the recordings",
                         CLI::Validator(check_response, "")},
                        {"--serial", &choice.serial, "gyro serial number (default: from the recordings)"},
                        {"--name", &choice.name, "readable name of the model"},
                        {"--prior", &choice.prior,
                         training::method_names(training::kSiblings) +
                             ": folder with two or more models of gyros of the same type"},
                        {"--force", &choice.force, "train even if the data-quality check rejects a recording"}});
  add_options(command,
              {{"--strict", &choice.recordings.strict,
                "end at a recording that cannot be used; else it is left out and named"}},
              Need::kFew);
  add_training_set_options(command, choice.recordings);
  add_method_options(command, choice.method);
}

// The command.

namespace {

/// The test on another recording, which is read like these.
std::string next_command(const TrainChoice& choice) {
  const recordings::SourceOptions& source = choice.recordings.source;
  std::string text = "prismcal evaluate " + choice.out + " ANOTHER-RECORDING";
  if (!source.map.empty()) text += " --map …";
  if (!source.config.empty()) text += " --config " + source.config;
  if (!source.axis.empty()) text += " --axis " + source.axis;
  if (choice.recordings.site.no_earth_rate) text += " --no-earth-rate";
  return text + " --out report";
}

/// Trains and writes one model; returns the JSON of --json, or prints the text.
Result<nlohmann::ordered_json> run_one(const TrainChoice& choice) {
  for (const auto& [option, text] : {std::pair{"--name", &choice.name}, {"--serial", &choice.serial}}) {
    if (auto good = check_text(TextRule::kText, *text, option); !good) return tl::unexpected<Error>(good.error());
  }
  auto run = train_on_recordings(choice, stop_on_interrupt());
  if (!run) return tl::unexpected<Error>(run.error());
  if (auto done = write_text_file(choice.out, run->model_text()); !done) return tl::unexpected<Error>(done.error());
  if (!choice.method.json) {
    fmt::print("{}",
               printable_lines(first_sentence(run->judgement, run->expected, run->quality, next_command(choice))));
    fmt::print("{}", run->summary.text);
  }
  return std::move(run->summary.json);
}

// "model.json" → "model-x.json"
std::string path_of_axis(const std::string& out, const std::string& axis) {
  const std::filesystem::path path(out);
  return (path.parent_path() / (path.stem().string() + "-" + axis + path.extension().string())).string();
}

/// Trains one model per axis; reports an axis that cannot be trained and continues with the others.
int run_all(const TrainChoice& choice, const std::vector<std::string>& axes) {
  nlohmann::ordered_json json;
  int code = 0;
  for (const std::string& axis : axes) {
    TrainChoice own = choice;
    own.recordings.source.axis = axis;
    own.out = path_of_axis(choice.out, axis);
    if (!own.name.empty()) own.name += " " + axis;
    if (!choice.method.json) fmt::print("{}axis {}: {}\n", axis == axes.front() ? "" : "\n", axis, own.out);
    std::fflush(stdout);
    const auto done = run_one(own);
    if (done) {
      json[axis] = *done;
    } else {
      json[axis] = {{"refused", done.error().text()}};
      code = failed(Error{"axis " + axis, done.error().text()});
    }
  }
  if (choice.method.json) fmt::print("{}\n", json_text(json, 2));
  return code;
}

Result<int> run(const TrainChoice& choice) {
  if (choice.from.empty() && choice.recordings.source.axis.empty()) {
    const auto axes = recordings::axes_of(choice.files.front(), choice.recordings.source);
    if (!axes) return tl::unexpected<Error>(axes.error());
    if (axes->size() > 1) return run_all(choice, *axes);
  }
  const auto done = choice.from.empty() ? run_one(choice) : train_from(choice);
  if (!done) return tl::unexpected<Error>(done.error());
  if (choice.method.json) fmt::print("{}\n", done->dump(2));
  return 0;
}

}  // namespace

void add_train_command(CLI::App& app, int& code) {
  const auto [command, choice] =
      new_command<TrainChoice>(app, code, "train", "train a model for prismd on recordings", run);
  add_options(command,
              {{"recordings", &choice.files, kRecordings},
               {"--out", &choice.out, "model file to write; NAME-AXIS.json for each of several axes"}},
              Need::kRequired);
  add_train_options(command, choice);
  CLI::Option* from = command.add_option(
      "--from", choice.from, "keep the shape of this model; only its constant is determined again, from time at rest");
  // The model determines everything else.
  const std::set<std::string> with_from = {"recordings", "--out",       "--from",     "--name",      "--force",
                                           "--map",      "--interval",  "--decimal",  "--time-unit", "--config",
                                           "--axis",     "--leave-out", "--latitude", "--elevation", "--azimuth",
                                           "--json",     "--quiet"};
  for (CLI::Option* option : command.get_options()) {
    const bool removed = option->get_group().empty();
    if (option != command.get_help_ptr() && !removed && !with_from.contains(option->get_name())) from->excludes(option);
  }
  constexpr const char* kMapped =
      "prismcal train chamber.csv --map rate=rate_x:deg/s,temperature=temp:degC,time=t:s "
      "--latitude 48.1 --elevation 90 --inputs T,dTdt --out model.json";
  tools::add_examples(
      command, {"prismcal train logs/ --inputs T,dTdt,U --out model.json",
                "prismcal train cycle1.pcap cycle2.pcap --config gyro.json --method stepwise --out model.json", kMapped,
                "prismcal train four-hours.csv --prior models/ --out model.json",
                "prismcal train --from model.json logs/ --out moved.json"});
}

namespace {

// 1 sigma of the logarithm of the remaining share on another day over that of held-out parts of one day, in addition to
// next_improvement(): from 16 pairs of simulated days (docs/report.md).
constexpr double kOtherDay = 0.18;

evaluation::Estimate for_another_day(evaluation::Estimate interval) {
  const auto widened = [&](double end) {
    const double left = 1 - interval.value, half = std::log((1 - end) / left);
    return 1 - left * std::exp(std::copysign(std::hypot(half, 2 * kOtherDay), half));
  };
  if (!(interval.value < 1 && interval.low < interval.value && interval.value < interval.high && interval.high < 1))
    return interval;
  interval.low = widened(interval.low);
  interval.high = widened(interval.high);
  return interval;
}

bool serves_the_mean(const training::TrainedModel& trained) {
  const auto* composite = dynamic_cast<const compensation::CompositeModel*>(trained.model.get());
  if (composite == nullptr || composite->parameters().prior) return false;
  const compensation::UncertaintySettings& trust = composite->parameters().trust;
  return compensation::evidence_of(trust.skill, trust.overlap) <= compensation::kNoSkill;
}

/// Names the methods that predict better, else what was tried; asks for a longer cycle only where it can help.
std::string advice_of(const Attempts& tried, double explained) {
  constexpr double kBetter = 0.05;  // of the explained variance: less may be chance
  std::string methods = tried.method;
  const auto best =
      std::ranges::max_element(tried.others, [](const auto& a, const auto& b) { return a.second < b.second; });
  for (const auto& other : tried.others) methods += ", " + other.first;
  const bool better = best != tried.others.end() && best->second > explained + kBetter;
  std::string text =
      better ? fmt::format(
                   "{0} predicts held-out parts better and explains {1:.0f} % of them ({2}: {3:.0f} %): train "
                   "with --method {0}",
                   best->first, 100 * best->second, tried.method, 100 * explained)
             : fmt::format("tried {} with {}", methods, tried.inputs);
  if (tried.longer_helps) return text + "; record a longer or wider cycle";
  if (better) return text;
  return text + (tried.all_inputs ? "; a longer cycle would not help: the bias follows something that is not recorded"
                                  : "; a longer cycle would not help: add inputs (--inputs auto)");
}

/// Of the model and the data quality. Another cycle does not help against a fault of the data, which comes with its own
/// advice: `advised` is false.
Judgement judge_model(const training::TrainedModel& trained, const std::optional<Expectation>& expected,
                      const evaluation::DataQuality& quality, bool advised, const std::function<Attempts()>& attempts) {
  const auto not_ready = [&](const std::string& reason, const char* advice) {
    return Judgement{Readiness::kNotReady, reason + (advised ? std::string(": ") + advice : "")};
  };
  if (quality.nothing_to_compensate)
    return not_ready("the bias changes with temperature by less than its noise", "record larger temperature changes");
  if (quality.verdict == evaluation::Verdict::kRefuse)
    return not_ready("the data quality fails, --force was given", "record a cycle without these faults");
  if (!expected)
    return not_ready(fmt::format("{} samples are too few to test the model on parts of the recording",
                                 trained.samples.fitted.size()),
                     "record a longer cycle");
  Judgement found;
  if (serves_the_mean(trained)) {
    found = {Readiness::kNotReady,
             "the halves of the recording contradict each other, so prismd would correct only the mean"};
  } else if (expected->explained <= 0) {
    found = {Readiness::kNotReady, "held-out parts of the recording get worse with it"};
  } else if (expected->improvement && expected->improvement->low < 0.005) {  // printed as 0 %
    found = {Readiness::kDoubtful, "it may also be no improvement"};
  }
  if (!found.reason.empty() && advised) found.reason += ": " + advice_of(attempts(), expected->explained);
  return found;
}

}  // namespace

std::optional<Expectation> expectation_of(const training::HeldOutErrors& held_out, const training::TrainingData& data) {
  const auto count = static_cast<std::size_t>(held_out.error.size());
  if (training::fold_count(held_out.folds) < 2 || held_out.samples.size() != count || !held_out.error.allFinite())
    return std::nullopt;
  Eigen::VectorXd before = data.target(held_out.samples), after = held_out.error;
  // 1 sigma does not contain the mean of a recording.
  const std::vector<int> runs = training::taken(training::runs_of(data), held_out.samples);
  for (const training::Rows& rows : training::fold_members(training::numbered(runs))) {
    for (Eigen::VectorXd* const values : {&before, &after}) {
      double sum = 0;
      for (const Eigen::Index i : rows) sum += (*values)[i];
      (*values)(rows).array() -= sum / static_cast<double>(rows.size());
    }
  }
  const auto sum_of_squares = [](const Eigen::VectorXd& values) {
    return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
  };
  if (!(sum_of_squares(before) > 0)) return std::nullopt;
  Expectation expected{training::fold_count(held_out.folds), count, 1 - sum_of_squares(after) / sum_of_squares(before),
                       std::nullopt};
  if (const auto interval = evaluation::next_improvement({before.data(), count}, {after.data(), count}))
    expected.improvement = for_another_day(*interval);
  return expected;
}

nlohmann::ordered_json expectation_json(const std::optional<Expectation>& expected) {
  if (!expected) return nullptr;
  nlohmann::ordered_json json = {{"explained", expected->explained}};
  if (const auto& interval = expected->improvement)
    json.update({{"improvement_percent", 100 * interval->value},
                 {"low_percent", 100 * interval->low},
                 {"high_percent", 100 * interval->high}});
  json.update({{"parts", expected->parts}, {"samples", expected->samples}});
  return json;
}

const char* readiness_text(Readiness readiness) {
  return readiness == Readiness::kReady ? "ready" : readiness == Readiness::kDoubtful ? "doubtful" : "not ready";
}

Judgement judge(const training::TrainedModel& trained, const std::optional<Expectation>& expected,
                const evaluation::DataQuality& quality, const std::vector<std::string>& questions,
                const std::function<Attempts()>& attempts) {
  Judgement model = judge_model(trained, expected, quality, questions.empty(), attempts);
  if (questions.empty()) return model;
  // The fault may be the reason of the rest.
  const std::string others = questions.size() > 1 ? fmt::format(" (and {} more, see above)", questions.size() - 1) : "";
  return {std::max(model.readiness, Readiness::kDoubtful),
          questions.front() + others + (model.reason.empty() ? "" : "; " + model.reason)};
}

std::string first_sentence(const Judgement& judgement, const std::optional<Expectation>& expected,
                           const evaluation::DataQuality& quality, const std::string& next) {
  std::string text = std::string(readiness_text(judgement.readiness)) + ": ";
  if (!judgement.reason.empty()) text += judgement.reason + "; ";
  if (expected) {
    text += fmt::format("explains {:.0f} % of held-out variation", 100 * expected->explained);
    if (const auto& i = expected->improvement)
      text += fmt::format(", expected improvement {:.0f} % ({:.0f} to {:.0f} %)", 100 * i->value, 100 * i->low,
                          100 * i->high);
    text += "; ";
  }
  text += "data quality: " + analysis::data_quality_words(quality);
  if (judgement.readiness != Readiness::kNotReady) text += "; next: " + next;
  return text + "\n";
}

}  // namespace prism::commands
