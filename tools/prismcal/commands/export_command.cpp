// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "base/file.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/c_export/c_export.hpp"
#include "tools/prismcal/commands/commands.hpp"

namespace prism::commands {
namespace {

struct ExportChoice {
  std::string model, folder, policy = "flag";
  bool single = false;
};

Result<int> run(const ExportChoice& choice) {
  const auto model = load_model(choice.model);
  if (!model) return tl::unexpected(model.error());
  const auto made = c_export::export_c(*model, choice.model, {choice.single, choice.policy == "clamp"});
  if (!made) return tl::unexpected(made.error());
  const std::filesystem::path folder = choice.folder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return make_error(choice.folder, error.message());
  for (const c_export::CFile& file : made->files) {
    if (auto done = write_text_file((folder / file.name).string(), file.text); !done)
      return tl::unexpected(done.error());
  }
  for (const std::string& remark : made->remarks) fmt::print(stderr, "prismcal: {}: {}\n", choice.model, remark);
  fmt::print("{}: {} files\n", choice.folder, made->files.size());
  return 0;
}

}  // namespace

void add_export_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("export", "write a model as C99 source for firmware");
  const auto choice = std::make_shared<ExportChoice>();
  command->add_option("model", choice->model, "model file")->required();
  command->add_option("--c", choice->folder, "folder for the C files; files of the same names are replaced")
      ->required();
  command->add_flag("--float", choice->single, "numbers are float, not double");
  command->add_option("--extrapolation", choice->policy, "outside the training range: flag or clamp")
      ->check(CLI::IsMember({"flag", "clamp"}))
      ->capture_default_str();
  tools::add_examples(*command, {"prismcal export model.json --c firmware"});
  command->callback([choice, &code] {
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
