// SPDX-License-Identifier: MIT
// The reference numbers: one case = data, folds and the results by LS-SVMlab's conventions (tests/golden/README.md).
#pragma once

#include <Eigen/Core>
#include <charconv>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "compensation/training/held_out.hpp"
#include "compensation/training/robust.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::test {

using Columns = std::map<std::string, std::vector<double>>;

inline Columns read_columns(const std::filesystem::path& path) {
  std::istringstream in(read_file(path));
  std::string line, field;
  std::vector<std::string> names;
  std::getline(in, line);
  for (std::istringstream header(line); std::getline(header, field, ',');) names.push_back(field);
  Columns columns;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    for (const std::string& name : names) {
      std::getline(row, field, ',');
      columns[name].push_back(std::strtod(field.c_str(), nullptr));
    }
  }
  return columns;
}

inline Eigen::VectorXd vector_of(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

/// One case with one set of hyper-parameters.
struct Golden {
  nlohmann::json about, expected;
  Columns train, test, train_expected, test_expected;
  double c, sigma2, tolerance, scale;
  Eigen::MatrixXd x, x_test;  ///< normalised, d × N
  Eigen::VectorXd y;
  training::Folds folds;

  Golden(const std::string& name, const std::string& id) {
    const auto dir = golden_dir(name);
    about = nlohmann::json::parse(read_file(dir / "case.json"));
    expected = nlohmann::json::parse(read_file(dir / (id + ".json")));
    train = read_columns(dir / "train.csv");
    test = read_columns(dir / "test.csv");
    train_expected = read_columns(dir / (id + "_train.csv"));
    test_expected = read_columns(dir / (id + "_test.csv"));
    c = expected["hyperparameters"]["c"];
    sigma2 = expected["hyperparameters"]["sigma2"];
    scale = about["y_scale"];
    tolerance = std::max(1e-10, 1e-14 * expected["unweighted"]["cond_est"].get<double>());
    x = normalised(inputs(train));
    x_test = normalised(inputs(test));
    y = ((vector_of(train["y"]).array() - about["y_shift"].get<double>()) / scale).matrix();
    folds = *training::folds_from(train["fold"]);
  }

  /// Raw, d × N.
  Eigen::MatrixXd inputs(Columns& from) const {
    const auto names = about["inputs"].get<std::vector<std::string>>();
    Eigen::MatrixXd m(names.size(), from[names[0]].size());
    for (std::size_t i = 0; i < names.size(); ++i)
      m.row(static_cast<Eigen::Index>(i)) = vector_of(from[names[i]]).transpose();
    return m;
  }

  /// With the case's own constants; equals the n_ columns of the full set, bit for bit.
  Eigen::MatrixXd normalised(Eigen::MatrixXd m) const {
    const auto shift = about["x_shift"].get<std::vector<double>>(), by = about["x_scale"].get<std::vector<double>>();
    return (m.colwise() - vector_of(shift)).array().colwise() / vector_of(by).array();
  }

  Eigen::VectorXd column(const std::string& name) { return vector_of(train_expected[name]); }

  /// Of N values, those with an expected value: column() has them at the samples i = 1 … N that it lists.
  Eigen::VectorXd kept(const Eigen::VectorXd& all) {
    std::vector<Eigen::Index> rows;
    for (const double i : train_expected["i"]) rows.push_back(static_cast<Eigen::Index>(i) - 1);
    return all(rows);
  }

  /// In original units, like the pred_* columns.
  Eigen::VectorXd predict(const Eigen::VectorXd& alpha, double b) const {
    Eigen::VectorXd f(x_test.cols());
    for (Eigen::Index j = 0; j < f.size(); ++j) {
      f[j] = b;
      for (Eigen::Index k = 0; k < x.cols(); ++k)
        f[j] += alpha[k] * std::exp(-(x.col(k) - x_test.col(j)).squaredNorm() / (2 * sigma2));
    }
    return (f.array() * scale + about["y_shift"].get<double>()).matrix();
  }

  training::WeightFunction weight(training::WeightKind kind) const {
    const auto& h = expected["hyperparameters"];
    const double parameter = kind == training::WeightKind::kHuber ? h["huber_beta"] : h["myriad_delta"];
    return {kind, parameter, h["hampel_floor"]};
  }
};

/// Largest difference, relative to the largest expected magnitude.
inline double relative(const Eigen::VectorXd& found, const Eigen::VectorXd& expected) {
  return (found - expected).cwiseAbs().maxCoeff() / std::max(1e-300, expected.cwiseAbs().maxCoeff());
}
inline double relative(double found, double expected) {
  return std::fabs(found - expected) / std::max(1e-300, std::fabs(expected));
}

struct GoldenName {
  std::string name, id;
};
inline void PrintTo(const GoldenName& g, std::ostream* out) { *out << g.name << '_' << g.id; }

/// The cases of the data sets that exist; the full set is in ../shared.
inline std::vector<GoldenName> golden_names() {
  std::vector<GoldenName> names;
  for (const char* name : {"boston400_auto", "gyro924", "gyro924_T", "gyro924_U", "mcycle133", "sinc150", "yacht250"}) {
    if (!std::filesystem::exists(golden_dir(name))) continue;
    const auto about = nlohmann::json::parse(read_file(golden_dir(name) / "case.json"));
    for (const auto& hyperparameters : about["hyperparameters"]) names.push_back({name, hyperparameters["id"]});
  }
  return names;
}

}  // namespace prism::test
