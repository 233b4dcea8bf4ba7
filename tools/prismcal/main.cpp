// SPDX-License-Identifier: MIT
// prismcal: the workbench: train, fit, validate, predict, evaluate, report, verify. One file a command.
#include <fmt/format.h>

#include <cstdio>
#include <new>

#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"

int main(int argc, char** argv) {
  using namespace prism;
  using namespace prism::commands;
  constexpr int kDone = 0, kFailed = 1;
  CLI::App app("prismcal: trains, evaluates and compares bias models of laser gyros");
  int code = kDone;
  tools::use_readable_help(app);
  app.set_version_flag("--version", std::string("prismcal ") + kVersion);
  app.require_subcommand(1);
  tools::add_examples(
      app, {"prismcal train logs/ --out model.json", "prismcal evaluate model.json repeat.csv --out report"});
  for (const auto add :
       {add_train_command, add_fit_command, add_cv_command, add_predict_command, add_evaluate_command,
        add_compare_command, add_monitor_command, add_history_command, add_inspect_command, add_allan_command,
        add_convert_command, add_design_command, add_export_command, add_verify_command, add_campaign_command})
    add(app, code);
  try {
    return tools::parse(app, "prismcal", argc, argv).value_or(code);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "prismcal: out of memory\n");
    return kFailed;
  }
}
