// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/program.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <new>

#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"

namespace prism::commands {
namespace {

constexpr int kDone = 0, kFailed = 1, kUsage = 64;

}  // namespace

int run(int argc, char** argv) {
  CLI::App app("prismcal: trains, evaluates and compares bias models of laser gyros");
  int code = kDone;
  tools::use_readable_help(app);
  app.set_version_flag("--version", std::string("prismcal ") + kVersion);
  app.require_subcommand(1);
  tools::add_examples(
      app, {"prismcal train logs/ --out model.json", "prismcal evaluate model.json repeat.csv --out report"});
  add_train_command(app, code);
  add_fit_command(app, code);
  add_cv_command(app, code);
  add_predict_command(app, code);
  add_evaluate_command(app, code);
  add_compare_command(app, code);
  add_inspect_command(app, code);
  add_allan_command(app, code);
  add_convert_command(app, code);
  add_design_command(app, code);
  add_export_command(app, code);
  add_verify_command(app, code);
  add_campaign_command(app, code);
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

}  // namespace prism::commands
