// SPDX-License-Identifier: MIT
// `prismcal train --from MODEL`: a new constant for a model, from a log at rest; its shape is kept.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/text_number.hpp"
#include "compensation/at_rest.hpp"
#include "compensation/compensation_engine.hpp"
#include "compensation/composite_model.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model_text.hpp"
#include "compensation/polynomial_model.hpp"
#include "config/config.hpp"
#include "config/version.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/training_run.hpp"

namespace prism::commands {
namespace {

using compensation::AtRest;
using compensation::Model, compensation::ModelPtr;
using nlohmann::ordered_json;

/// Half hours at rest, each with its difference from the Earth rate.
struct Rest {
  std::vector<AtRest::Difference> halves;

  double mean() const {
    double sum = 0;
    for (const auto& half : halves) sum += half.deg_per_h;
    return sum / static_cast<double>(halves.size());
  }
  /// Model and mount have the same error in all halves; the scatter of the halves is added.
  double sd() const {
    const double middle = mean(), count = static_cast<double>(halves.size());
    double stated = 0, scatter = 0;
    for (const auto& half : halves) {
      stated += half.sd_deg_per_h * half.sd_deg_per_h / count;
      scatter += (half.deg_per_h - middle) * (half.deg_per_h - middle);
    }
    return std::sqrt(stated + (count > 1 ? scatter / (count - 1) / count : 0));
  }
};

/// Feeds the seconds of a recording to the model, and keeps what it leaves at rest.
class RestFinder {
 public:
  explicit RestFinder(ModelPtr model) : model_(std::move(model)) {}

  Result<void> begin(const compensation::AxisPlacement& placement, double direction_rad) {
    at_rest_ = AtRest(placement, direction_rad, model_);
    return engine_.use(model_, nullptr);
  }
  Result<void> push(const compensation::SecondMean& second_mean, bool begins_session) {
    if (begins_session) engine_.reset(), at_rest_.reset();
    if (second_mean.partial || !at_rest_.push(engine_.push(second_mean))) return {};
    const auto found = at_rest_.difference();
    if (!found || found->seen_s < AtRest::kSeenS) return {};
    found_.halves.push_back(*found);
    at_rest_.reset();
    return {};
  }
  const Rest& found() const { return found_; }
  /// Why the last block is not at rest.
  const char* reason() const { return compensation::kNoDifferenceNames[static_cast<std::size_t>(at_rest_.reason())]; }

 private:
  ModelPtr model_;
  compensation::CompensationEngine engine_;
  AtRest at_rest_;
  Rest found_;
};

/// The model with a constant added to its bias.
Result<ModelPtr> with_constant(const Model& model, compensation::ModelInfo info, double added_deg_per_h) {
  if (const auto* polynomial = dynamic_cast<const compensation::PolynomialModel*>(&model)) {
    std::vector<compensation::Term> terms = polynomial->terms();
    const std::vector<int> none(info.inputs.size(), 0);
    auto constant = std::find_if(terms.begin(), terms.end(), [&](const auto& term) { return term.powers == none; });
    if (constant == terms.end()) constant = terms.insert(terms.begin(), compensation::Term{none, 0});
    constant->coefficient += added_deg_per_h;
    return std::make_shared<compensation::PolynomialModel>(std::move(info), terms, polynomial->sd_deg_per_h());
  }
  if (const auto* composite = dynamic_cast<const compensation::CompositeModel*>(&model)) {
    compensation::CompositeParameters parameters = composite->parameters();
    parameters.normalisation.target_shift += added_deg_per_h;
    return compensation::CompositeModel::make(std::move(info), std::move(parameters));
  }
  compensation::LssvmParameters parameters = dynamic_cast<const compensation::LssvmModel&>(model).parameters();
  parameters.normalisation.target_shift += added_deg_per_h;
  return compensation::LssvmModel::make(std::move(info), std::move(parameters));
}

/// That of the first model, with the recording that gave the constant.
std::string provenance(const Model& model, const recordings::Recording& recording, const ordered_json& constant) {
  ordered_json files = ordered_json::array();
  for (const recordings::SourceFile& file : recording.files)
    files.push_back({{"path", file.path}, {"sha256", file.sha256}, {"rows", file.rows}});
  ordered_json json = ordered_json::parse(model.info().provenance_json);
  json["tool"] = std::string("prismcal ") + kVersion;
  json["made"] = utc_text(std::time(nullptr));
  json["recordings"].push_back({{"name", recording.name}, {"files", std::move(files)}});
  json["constant"] = constant;
  return json_text(json);
}

}  // namespace

Result<ordered_json> train_from(const TrainChoice& choice) {
  if (choice.files.size() != 1)
    return make_error("--from", fmt::format("found {} recordings, expected one", choice.files.size()));
  const auto loaded = load_model(choice.from);
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  const Model& model = **loaded;
  double direction_mrad = config::AxisConfig().direction_mrad;
  recordings::SourceOptions source = choice.recordings.source;
  if (choice.method.quiet) source.table.silence();
  if (!source.config.empty()) {
    const auto config = config::load_config(source.config);
    if (!config) return tl::unexpected<Error>(config.error());
    if (const auto* axis = config::find_axis(*config, source.axis)) direction_mrad = axis->direction_mrad;
  }
  RestFinder finder(*loaded);
  const auto begin = [&](const recordings::Recording& recording) -> Result<void> {
    if (auto same = check_gyro(recording.name, recording, model.info(), {}); !same) return same;
    const auto placement = recordings::placement_of(recording, choice.recordings.site);
    if (!placement) return tl::unexpected<Error>(placement.error());
    return finder.begin(*placement, direction_mrad / 1000);
  };
  const auto recording = recordings::read_recording(
      choice.files.front(), source,
      {begin, [&](const auto& second_mean, bool begins) { return finder.push(second_mean, begins); }});
  if (!recording) return tl::unexpected<Error>(recording.error());
  const Rest& rest = finder.found();
  if (rest.halves.empty())
    return make_error(
        recording->name,
        fmt::format("found no half hour at rest with a good correction ({}), expected one", finder.reason()));
  const double moved = rest.mean(), half = 2 * rest.sd();
  if (std::abs(moved) <= half && !choice.force)
    return make_error(recording->name,
                      fmt::format("the bias moved by {:+.4f} ± {:.4f} deg/h (2 sd), which may be none: the "
                                  "model stays; --force writes it anyway",
                                  moved, half));
  const ordered_json constant = {{"from", model.info().id},
                                 {"moved_deg_per_h", moved},
                                 {"interval_deg_per_h", {moved - half, moved + half}},
                                 {"at_rest_s", rest.halves.size() * AtRest::kSeenS}};
  compensation::ModelInfo info = model.info();
  if (!choice.name.empty()) info.name = choice.name;
  const auto made = with_constant(model, std::move(info), moved);
  if (!made) return tl::unexpected<Error>(made.error());
  const std::string text =
      compensation::format_model(**made, provenance(model, *recording, constant), (*made)->info().noise);
  if (auto done = write_text_file(choice.out, text); !done) return tl::unexpected<Error>(done.error());
  if (!choice.method.json)
    fmt::print(
        "the bias moved by {:+.4f} ± {:.4f} deg/h (2 sd) in {:.1f} h at rest; {} has it in its constant, and the shape "
        "of model {:.12}; next: check it on another log, then prismctl reload\n",
        moved, half, static_cast<double>(rest.halves.size()) * AtRest::kSeenS / 3600, choice.out, model.info().id);
  ordered_json summary = constant;
  summary["id"] = (*made)->info().id;
  return summary;
}

}  // namespace prism::commands
