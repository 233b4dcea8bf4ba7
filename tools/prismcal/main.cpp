// SPDX-License-Identifier: MIT
// prismcal: the workbench: train, fit, validate, predict, evaluate, report. One file a command.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>
#include <new>

#include "config/version.hpp"
#include "tools/prismcal/commands/allan_command.hpp"
#include "tools/prismcal/commands/compare_command.hpp"
#include "tools/prismcal/commands/convert_command.hpp"
#include "tools/prismcal/commands/cv_command.hpp"
#include "tools/prismcal/commands/evaluate_command.hpp"
#include "tools/prismcal/commands/fit_command.hpp"
#include "tools/prismcal/commands/predict_command.hpp"
#include "tools/prismcal/commands/report_command.hpp"
#include "tools/prismcal/commands/train_command.hpp"

namespace prism::commands {
namespace {

constexpr int kDone = 0, kFailed = 1, kUsage = 64;

int run(int argc, char** argv) {
  CLI::App app("prismcal: makes, judges and compares bias models of laser gyros");
  int code = kDone;
  app.set_version_flag("--version", std::string("prismcal ") + kVersion);
  app.require_subcommand(1);
  add_train_command(app, code);
  add_fit_command(app, code);
  add_cv_command(app, code);
  add_predict_command(app, code);
  add_evaluate_command(app, code);
  add_compare_command(app, code);
  add_report_command(app, code);
  add_allan_command(app, code);
  add_convert_command(app, code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "prismcal: {}; see prismcal --help\n", error.what());
    return kUsage;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "prismcal: out of memory\n");
    return kFailed;
  }
  return code;
}

}  // namespace
}  // namespace prism::commands

int main(int argc, char** argv) { return prism::commands::run(argc, argv); }
