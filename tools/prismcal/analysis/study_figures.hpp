// SPDX-License-Identifier: MIT
// The paper's figures 6 to 11 from our data, and the cost surface of the tuning.
#pragma once

#include <optional>

#include "tools/prismcal/analysis/study.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// Figure 6: the bias against T, dT/dt and U over time, on twin axes.
report::Figure inputs_figure(const recordings::BlockTable& table);
/// Figure 7: LS models, regression on the training recording and compensation of its repeat.
report::Figure least_squares_figure(const Study& study);
/// Figure 8: both stepwise models on the repeat.
report::Figure stepwise_figure(const Study& study);
/// Figures 9 and 10: the four weights for each set of inputs of `from` to `to` inputs, regression and compensation.
report::Figure weights_by_inputs_figure(const Study& study, std::size_t from, std::size_t to);
/// Figure 11: LSSVM and the best IR-LSSVM, all inputs; nothing where the study lacks one of them.
std::optional<report::Figure> lssvm_figure(const Study& study);
/// The survey's cost over (c, sigma2) of one row, with the point chosen; nothing where the row has no survey.
std::optional<report::Figure> surface_figure(const StudyRow& row);

}  // namespace prism::analysis
