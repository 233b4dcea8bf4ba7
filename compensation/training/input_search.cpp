// SPDX-License-Identifier: MIT
#include "compensation/training/input_search.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "compensation/training/folds.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kFewestToChoose = 40;
constexpr int kHeldOutParts = 10;

class Judge {
 public:
  explicit Judge(const TrainingData& data)
      : data_(data),
        parts_(fold_members(blocked_folds(runs_of(data), kHeldOutParts))),
        inputs_(data.inputs.transpose()) {
    for (Eigen::Index i = 0; i < inputs_.cols(); ++i) {
      const double mean = inputs_.col(i).mean();
      inputs_.col(i).array() -= mean;
      const double sd = std::sqrt(inputs_.col(i).squaredNorm() / static_cast<double>(inputs_.rows()));
      moves_.push_back(sd > 1e-9 * (1 + std::abs(mean)));
      if (moves_.back()) inputs_.col(i) /= sd;
    }
  }

  bool moves(std::size_t candidate) const { return moves_[candidate]; }

  InputSet judge(const std::vector<std::size_t>& chosen) const {
    const Eigen::MatrixXd columns = design(chosen);
    const double count = static_cast<double>(data_.target.size());
    double squares = 0, scatter = 0;
    std::vector<double> means;
    for (const auto& part : parts_) {
      const std::vector<Eigen::Index> rest = others(part, data_.target.size());
      const Eigen::VectorXd fit = columns(rest, Eigen::all).colPivHouseholderQr().solve(data_.target(rest));
      const double own = (data_.target(part) - columns(part, Eigen::all) * fit).squaredNorm();
      squares += own;
      means.push_back(own / static_cast<double>(part.size()));
    }
    const double mean = squares / count, parts = static_cast<double>(means.size());
    for (const double own : means) scatter += (own - mean) * (own - mean);
    InputSet set;
    for (const std::size_t i : chosen) set.inputs.push_back(data_.names[i]);
    set.error_deg_per_h = std::sqrt(mean);
    if (mean > 0 && parts > 1)
      set.standard_error_deg_per_h = std::sqrt(scatter / (parts - 1) / parts) / (2 * set.error_deg_per_h);
    return set;
  }

 private:
  // 1, the inputs, their squares and products.
  Eigen::MatrixXd design(const std::vector<std::size_t>& chosen) const {
    const TermPowers powers = second_order_terms(chosen.size());
    Eigen::MatrixXd columns = Eigen::MatrixXd::Ones(inputs_.rows(), static_cast<Eigen::Index>(powers.size()) + 1);
    for (std::size_t j = 0; j < powers.size(); ++j) {
      for (std::size_t i = 0; i < chosen.size(); ++i) {
        for (int power = 0; power < powers[j][i]; ++power)
          columns.col(static_cast<Eigen::Index>(j) + 1).array() *=
              inputs_.col(static_cast<Eigen::Index>(chosen[i])).array();
      }
    }
    return columns;
  }

  const TrainingData& data_;
  std::vector<std::vector<Eigen::Index>> parts_;
  Eigen::MatrixXd inputs_;  // N × d, scaled
  std::vector<bool> moves_;
};

}  // namespace

Result<InputSearch> search_inputs(const TrainingData& data, std::size_t most) {
  if (data.target.size() < kFewestToChoose)
    return make_error("inputs", fmt::format("found {} samples, expected at least {} to choose inputs by",
                                            data.target.size(), kFewestToChoose));
  const Judge judge(data);
  InputSearch search;
  search.without_deg_per_h = judge.judge({}).error_deg_per_h;
  std::vector<std::size_t> left, chosen;
  for (std::size_t i = 0; i < data.names.size(); ++i) {
    if (!judge.moves(i)) continue;
    left.push_back(i);
    search.alone.push_back(judge.judge({i}));
  }
  if (left.empty()) return make_error("inputs", "found only constant inputs, expected one that changes");
  while (!left.empty() && chosen.size() < most) {
    InputSet best;
    std::size_t which = 0;
    for (std::size_t k = 0; k < left.size(); ++k) {
      std::vector<std::size_t> with = chosen;
      with.push_back(left[k]);
      const InputSet set = judge.judge(with);
      if (k == 0 || set.error_deg_per_h < best.error_deg_per_h) best = set, which = k;
    }
    chosen.push_back(left[which]);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(which));
    search.path.push_back(std::move(best));
  }
  const auto best = std::min_element(search.path.begin(), search.path.end(), [](const InputSet& a, const InputSet& b) {
    return a.error_deg_per_h < b.error_deg_per_h;
  });
  const double enough = best->error_deg_per_h + best->standard_error_deg_per_h;
  while (search.path[search.chosen].error_deg_per_h > enough) ++search.chosen;
  return search;
}

}  // namespace prism::training
