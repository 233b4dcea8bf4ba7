// SPDX-License-Identifier: MIT
// The shrink policy: which weight a prediction gets by what the halves of its record say, and beyond the edge.
#include "compensation/extrapolation.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace prism::compensation {
namespace {

// A prediction of 5 over a mean of 1, of a model without uncertainty at this point.
Prediction predicted(double skill, double overlap) {
  Prediction p;
  p.bias_deg_per_h = 5;
  p.mean_deg_per_h = 1;
  p.knowledge = {0, 4, skill, 0, {}, true, overlap, PredictiveUncertainty::Edge{5, 0}};
  return p;
}

TEST(Shrunk, DistinguishesHalvesThatAgreeDisagreeAndDoNotOverlap) {
  EXPECT_EQ(shrunk(predicted(0.7, 1)).bias_deg_per_h, 5) << "overlap and agree";
  EXPECT_EQ(shrunk(predicted(0.05, 1)).bias_deg_per_h, 1) << "overlap and disagree";
  EXPECT_EQ(shrunk(predicted(-3, 0.5)).bias_deg_per_h, 1) << "what overlaps disagrees";
  EXPECT_NEAR(shrunk(predicted(0.05, 0.5)).bias_deg_per_h, 1 + 4 * (0.05 + 0.45 - 0.1) / 0.5, 1e-12)
      << "do not overlap: no evidence against the model";
  EXPECT_GT(shrunk(predicted(0.05, 0.5)).sd_deg_per_h, shrunk(predicted(0.7, 1)).sd_deg_per_h);
}

TEST(Shrunk, KeepsTheBiasOfTheEdgeBeyondIt) {
  Prediction far = predicted(1, 1);
  far.knowledge->edge = PredictiveUncertainty::Edge{3, 0};
  far.knowledge->excess = 10;
  far.knowledge->model_variance = 40;  // ten times the target's
  const double e = 9.85 * 9.85, at_edge = 1 / (1 + 5 + e / 2), beyond = 1 / (1 + 10 + 10 * e);
  EXPECT_NEAR(shrunk(far).bias_deg_per_h, 1 + at_edge * 2 + beyond * 2, 1e-12);
  far.knowledge->excess = 0.15;  // near: the edge's own certainty counts
  EXPECT_NEAR(shrunk(far).bias_deg_per_h, 1 + 2 / 6.0 + 2 / 11.0, 1e-12);
  Prediction inside = predicted(1, 1);
  EXPECT_GT(shrunk(far).sd_deg_per_h, shrunk(inside).sd_deg_per_h);
}

// Models of version 0.2 have no edge: their policy stays.
TEST(Shrunk, ServesOlderModelsAsBefore) {
  Prediction old = predicted(0.35, 1);
  old.knowledge->edge.reset();
  old.knowledge->excess = 0.65;
  old.knowledge->model_variance = 2;
  const double w = 0.5 / (1 + 0.5 + 20 * 0.25);
  const Prediction p = shrunk(old);
  EXPECT_NEAR(p.bias_deg_per_h, 1 + 4 * w, 1e-12);
  EXPECT_NEAR(p.sd_deg_per_h, std::sqrt(1.25 * (2 + (1 - w) * (4 + 16))), 1e-12);
}

}  // namespace
}  // namespace prism::compensation
