// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/c_export.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/recording_options.hpp"

namespace prism::commands {
namespace {

struct ExportChoice {
  std::string model, folder, recording, policy = "flag";
  CommonOptions common;  ///< of the recording
  c_export::COptions c;
};

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

Result<int> run(ExportChoice& choice) {
  const auto model = load_model(choice.model);
  if (!model) return tl::unexpected(model.error());
  if (choice.policy == "clamp") choice.c.policy = compensation::Extrapolation::kClamp;
  if (choice.c.max_bytes > 0) {
    auto blocks = load_blocks(choice.recording, (*model)->info().features, &(*model)->info(), choice.common);
    if (!blocks) return tl::unexpected(blocks.error());
    choice.c.loss = [&choice, model, loaded = std::move(*blocks)](const compensation::ModelPtr& fewer) {
      return loss_on(loaded, *model, fewer, choice.c.policy);
    };
  }
  const auto made = c_export::export_c(*model, choice.model, choice.c);
  if (!made) return tl::unexpected(made.error());
  const std::filesystem::path folder = choice.folder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return make_error(choice.folder, error.message());
  for (const auto& [name, text] : made->files) {
    if (auto done = write_text_file((folder / name).string(), text); !done) return tl::unexpected(done.error());
  }
  for (const std::string& remark : made->remarks) fmt::print(stderr, "prismcal: {}: {}\n", choice.model, remark);
  fmt::print("{}: {} files, {} bytes of tables\n", choice.folder, made->files.size(), made->bytes);
  return 0;
}

}  // namespace

void add_export_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("export", "write a model as C99 source for firmware");
  const auto choice = std::make_shared<ExportChoice>();
  add_options(*command,
              {{"model", &choice->model, "model file"},
               {"--c", &choice->folder, "folder for the C files; files of the same names are replaced"}},
              Need::kRequired);
  const auto options = add_options(
      *command,
      {{"--float", &choice->c.single, "numbers are float, not double"},
       {"--extrapolation", &choice->policy, "outside the training range: flag or clamp", one_of({"flag", "clamp"})},
       {"--max-bytes", &choice->c.max_bytes, "most bytes of tables: kernel models lose centres", tools::positive()},
       {"--on", &choice->recording, "recording on which the loss by this is measured"}});
  options[2]->needs(options[3]);
  options[3]->needs(options[2]);
  add_source_options(*command, choice->common.source);
  accept_site_options(*command);
  choice->common.site.no_earth_rate = true;  // the loss does not depend on it
  choice->common.quiet = true;
  tools::add_examples(*command, {"prismcal export model.json --c firmware",
                                 "prismcal export model.json --c firmware --float --max-bytes 8000 --on data/log"});
  command->callback([choice, &code] { code = exit_code(run(*choice)); });
}

}  // namespace prism::commands
