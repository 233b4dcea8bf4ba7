// SPDX-License-Identifier: MIT
// Short trainings as scripts: all results of each method. The other tests check them against references and truths;
// these numbers are recorded, so that a change of any of them is seen.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compensation/composite_model.hpp"
#include "compensation/training/response.hpp"
#include "compensation/training/trainer.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/trained.hpp"

namespace prism::training {
namespace {

using test::next;
using Lines = std::vector<std::string>;

// A sum that depends on the place of each number.
double digest(const Eigen::VectorXd& v) {
  double sum = 0;
  for (Eigen::Index i = 0; i < v.size(); ++i) sum += v[i] * (1 + 0.01 * static_cast<double>(i));
  return sum;
}

/// A record of T and U (or dTdt), 100 s a row, with noise of 0.002 deg/h, and the settings of a training.
class TrainingPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "record") {  // ROWS [SECOND INPUT]
      const int rows = next<int>(words);
      data_ = test::record({"T", next<std::string>(words, "U")}, rows, [&](double i, double* x) {
        x[0] = 60 * std::sin(i * 0.2), x[1] = 5.5 + 0.1 * std::cos(i * 0.13);
        return 0.3 + 0.02 * std::sin(x[0] / 20) + 0.05 * (x[1] - 5.5) + 0.002 * std::sin(i * i);
      });
      data_.time_s = Eigen::VectorXd::LinSpaced(rows, 0, 100 * (rows - 1));
    } else if (command == "walk") {  // SIZE: a drift in time
      const auto size = next<double>(words);
      for (Eigen::Index i = 0; i < data_.target.size(); ++i)
        data_.target[i] += size * std::sin(static_cast<double>(i) / 7);
    } else if (command == "add") {  // SIZE ROW...
      const auto size = next<double>(words);
      for (Eigen::Index row = 0; words >> row;) data_.target[row] += size;
    } else if (command == "runs") {  // COUNT HOURS of each
      const int count = next<int>(words), rows = static_cast<int>(data_.target.size()), length = rows / count;
      const double hours = next<double>(words);
      data_.runs.clear();
      for (int i = 0; i < rows; ++i) {
        data_.runs.push_back(i * count / rows);
        data_.time_s[i] = (i % length) * 3600 * hours / (length - 1);
      }
    } else if (command == "body") {  // SECONDS: of a response, over blocks of 600 s of T and its slope
      const auto tau_s = next<double>(words);
      double body = 0;
      for (Eigen::Index i = 0; i < data_.target.size(); ++i) {
        const double at = static_cast<double>(i), t = 30 * std::sin(at * 0.35), before = 30 * std::sin((at - 1) * 0.35);
        for (int s = 0; s < 600; ++s) body += (before + (t - before) * s / 600 - body) / tau_s;
        data_.time_s[i] = 600 * at;
        data_.inputs.col(i) << (t + before) / 2, (t - before) / 600;
        data_.target[i] = 0.001 * body + 0.00002 * body * body + 0.001 * std::sin(at * at);
      }
    } else if (command == "set") {
      return set(words);
    } else if (command == "sibling") {
      const auto model = train(data_, {}, settings_);
      if (!model) return {model.error().text()};
      siblings_.push_back(model->model);
      return {};
    } else if (command == "response") {
      const auto found = find_response(data_, settings_, 600);
      if (!found) return {"none"};
      return {
          fmt::format("{} s, {:.4g} to {:.4g}, gain {:.4g}", found->tau_s, found->low_s, found->high_s, found->gain)};
    } else if (command == "train") {  // [MOST]: a sparse model of at most MOST centres
      settings_.siblings = siblings_;
      const auto most = next<Eigen::Index>(words);
      compensation::ModelInfo info;
      info.inputs = data_.names;
      const auto made = most > 0 ? settings_.method->train({data_, info, settings_, {0, 0, true, most}, runs_of(data_)})
                                 : train(data_, {}, settings_);
      return made ? shown(*made) : Lines{made.error().text()};
    } else {
      return {"unknown command"};
    }
    return {};
  }

 private:
  Lines set(std::istream& words) {
    settings_ = {};
    for (std::string word; words >> word;) {
      if (find_method(word)) {
        settings_.method = find_method(word);
        settings_.terms = word == std::string("ls") ? plain_terms(2) : second_order_terms(2);
      } else if (word == "c") {
        settings_.c = next<double>(words);
      } else if (word == "sigma2") {
        settings_.sigma2 = next<double>(words);
      } else if (word == "parameter") {
        settings_.parameter = next<double>(words);
      } else if (word == "folds") {
        settings_.folds = next<int>(words);
      } else if (word == "limit") {
        settings_.reweight.limit = next<int>(words);
      } else if (word == "iqr") {
        settings_.reweight.scale = ScaleKind::kIqr;
      } else if (word == "auto") {
        settings_.scaling = NormalisationMethod::kAuto;
      } else if (word == "open" || word == "no_drift") {
        settings_.drift = word == "open" ? Drift::kOpen : Drift::kNone;
      } else if (weight_by_name(word) != WeightKind::kNone || word == "none") {
        settings_.reweight.weight.kind = weight_by_name(word);
      } else {
        settings_.tuning = tuning_by_name(word);
      }
    }
    return {};
  }

  static Lines shown(const TrainedModel& t) {
    Lines lines;
    const auto add = [&](const char* name, const std::vector<double>& values, int digits = 5) {
      std::string text;
      for (const double value : values) text += fmt::format(" {:.{}g}", std::fabs(value) < 1e-12 ? 0 : value, digits);
      lines.push_back(name + text);
    };
    lines.push_back(fmt::format("{}, {} centres", t.model->info().kind, t.centres));
    if (t.c > 0) add("c, sigma2, parameter:", {t.c, t.sigma2, t.parameter});
    if (const auto& r = t.reweight; r && r->solves > 0)
      lines.push_back(fmt::format("{} solves{}{}, scale {:.5g}, {} dropped", r->solves, r->converged ? "" : ", no end",
                                  r->oscillating ? ", oscillating" : "", r->scale, r->dropped));
    if (t.tuning) {
      // The last digits of a kernel decide how many steps the end of a search has.
      lines.push_back(fmt::format("{} hundred evaluations, {} choices: a cost of {:.4g}", t.tuning->evaluations / 100,
                                  t.tuning->surface.size(), t.tuning->best.cost));
      double sum = 0;
      for (const TuningPoint& p : t.tuning->surface) sum += std::isfinite(p.cost) ? p.cost : 0;
      add("grid:", {sum, t.tuning->surface.front().cost, t.tuning->surface.back().cost});
    }
    if (t.polynomial) {
      lines.push_back(fmt::format("terms {}", fmt::join(t.polynomial->terms, " ")));
      add("condition, sse:", {t.polynomial->condition, t.polynomial->fit.sse});
    }
    const SampleDiagnostics& s = t.samples;
    add("alpha, weight, fitted, left out:",
        {digest(s.alpha), digest(s.weight), digest(s.fitted), digest(s.leave_one_out)});
    add("held out:",
        {digest(t.held_out.error), digest(t.held_out.model_variance),
         static_cast<double>(fold_members(t.held_out.folds).size()), static_cast<double>(t.held_out.samples.size()),
         t.held_out.samples.empty() ? 0 : static_cast<double>(t.held_out.samples.back())});
    if (const auto& e = t.model->info().spread)
      add("spread:", {e->nuisance_deg_per_h, e->offset_deg_per_h, e->noise_deg_per_h, e->factor,
                      static_cast<double>(e->blocks), static_cast<double>(e->samples)});
    if (const auto* composite = dynamic_cast<const compensation::CompositeModel*>(t.model.get())) {
      const compensation::CompositeParameters& p = composite->parameters();
      const compensation::CompositeVariances& v = p.variances;
      add("variances:",
          {v.kernel.rbf, v.kernel.length2[0], v.kernel.length2[1], v.kernel.linear, v.kernel.quadratic, v.nuisance,
           v.nuisance_time_h, v.offset, v.noise, v.warm_up},
          4);
      add("skill, level, guard, overlap:", {p.trust.skill, p.trust.level, p.trust.guard, p.trust.overlap});
      add("relevance:", p.trust.relevance);
      add("target:", {p.normalisation.target_shift, p.normalisation.target_scale, p.beta});
      if (p.prior)
        add("prior:", {p.prior->scale, p.prior->levels[0], p.prior->levels[1], t.from_siblings.value_or(-9)});
    }
    for (const std::vector<double>& x : {std::vector{20.0, 5.5}, {75.0, 5.55}}) {
      const compensation::Prediction p = t.model->predict(x), q = test::served(*t.model, x);
      add(fmt::format("at {} and {}{}:", x[0], x[1], p.extrapolating ? " (outside)" : "").c_str(),
          {p.bias_deg_per_h, p.sd_deg_per_h, p.sd_mean_deg_per_h, q.bias_deg_per_h, q.sd_deg_per_h});
    }
    for (const std::string& note : t.notes) lines.push_back("note: " + note);
    return lines;
  }

  TrainingData data_;
  TrainingSettings settings_;
  std::vector<compensation::ModelPtr> siblings_;
};

class Trainings : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scripts, Trainings, testing::Values("trainings", "composites", "tunings", "responses"));

TEST_P(Trainings, AreAsRecorded) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "other last bits may end a search elsewhere (x86-64)";
#endif
  test::expect_scripts<TrainingPlayer>(std::string("training/") + GetParam() + ".txt");
}

}  // namespace
}  // namespace prism::training
