// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <memory>
#include <set>
#include <type_traits>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "compensation/model_text.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/log_folder.hpp"

namespace prism::commands {
namespace {

std::atomic<bool> interrupted{false};

void interrupt(int) {
  interrupted = true;
  std::signal(SIGINT, SIG_DFL);
}

std::atomic<bool> line_drawn{false};

template <class Value>
CLI::Option* add_value(CLI::App& command, const OptionRow& row, Value& value) {
  if constexpr (std::is_same_v<Value, bool>) {
    return command.add_flag(row.flag, value, row.help);
  } else {
    CLI::Option* option = command.add_option(row.flag, value, row.help);
    if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, std::string>) {
      if (value != Value()) option->capture_default_str();
    }
    return option;
  }
}

}  // namespace

int failed(const Error& error) {
  end_progress();
  fmt::print(stderr, "prismcal: {}\n", error.text());
  return 1;
}

int exit_code(const Result<int>& done) { return done ? *done : failed(done.error()); }

Result<compensation::ModelPtr> load_model(const std::string& path) {
  return read_text_file(path, kMaxModelBytes).and_then([&](const std::string& text) {
    return compensation::parse_model(text, path);
  });
}

Result<std::vector<compensation::ModelPtr>> read_population_models(const std::string& folder,
                                                                   const std::string& own_serial) {
  std::vector<compensation::ModelPtr> models;
  std::size_t own = 0;
  for (const std::string& file : recordings::files_of(folder, ".json")) {
    auto model = load_model(file);
    if (!model) return tl::unexpected<Error>(model.error());
    const bool is_own = !own_serial.empty() && (*model)->info().gyro_serial == own_serial;
    own += is_own;
    if (!is_own) models.push_back(std::move(*model));
  }
  if (models.size() < 2) {
    return make_error(folder,
                      fmt::format("found {} models of other gyros ({} of this one), expected a folder with 2 or more",
                                  models.size(), own));
  }
  return models;
}

const std::atomic<bool>* stop_on_interrupt() {
  std::signal(SIGINT, interrupt);
  return &interrupted;
}

training::TuningProgress progress_line(bool quiet) {
  if (quiet || isatty(STDERR_FILENO) == 0) return {};
  return [](int done, int expected, const training::TuningPoint& best) {
    constexpr std::size_t kColumns = 79;  // a longer line would add a line to most terminals with each drawing
    const std::string text = fmt::format("{} of about {}, best cost {:.6g} at c {:.4g}, sigma2 {:.4g}", done, expected,
                                         best.cost, best.c, best.sigma2);
    fmt::print(stderr, "\r{}\033[K", text.substr(0, kColumns));
    line_drawn = true;
  };
}

void end_progress() {
  if (line_drawn.exchange(false)) fmt::print(stderr, "\n");
}

void refuse_removed(CLI::App& command, const char* name, const char* instead) {
  command
      .add_option_function<std::string>(name,
                                        [name, instead](const std::string&) {
                                          throw CLI::ValidationError(name, std::string("was removed: ") + instead);
                                        })
      ->expected(0, 1)
      ->group("");
}

CLI::Validator one_of(std::vector<std::string> names) { return CLI::IsMember(std::move(names)); }

std::vector<CLI::Option*> add_options(CLI::App& command, const std::vector<OptionRow>& rows, Need need) {
  std::vector<CLI::Option*> options;
  for (const OptionRow& row : rows) {
    options.push_back(std::visit([&](auto* value) { return add_value(command, row, *value); }, row.member));
    if (row.check) options.back()->check(*row.check);
    if (need == Need::kRequired) options.back()->required();
    if (need == Need::kFew) options.back()->group("Further options");
  }
  return options;
}

void add_table_options(CLI::App& command, tables::TableOptions& options) {
  add_options(command,
              {{"--decimal", &options.decimal, "sign of a table's decimals, . or , (default: as all cells say)"},
               {"--time-unit", &options.time_unit,
                "of a table's time that is a number: s, ms, us, ns, min, h or d (default: by its header)",
                one_of({"s", "ms", "us", "ns", "min", "h", "d"})}});
  for (const char* name : {"--separator", "--encoding", "--header-row", "--time-format"})
    refuse_removed(command, name, "prismcal reads plain tables; prism-import reads others");
  // Each file once, also if a command reads it several times.
  options.announce = [said = std::make_shared<std::set<std::string>>()](const std::string& line) {
    if (said->insert(line).second) fmt::print(stderr, "{}\n", printable(line));
  };
}

void add_source_options(CLI::App& command, recordings::SourceOptions& options) {
  const auto table = add_options(
      command, {{"--map", &options.map,
                 "plain table: QUANTITY=COLUMN:UNIT[*SCALE][+OFFSET] for rate, temperature, uhfo, time and sensors "
                 "(LINE.NAME); repeat or list"},
                {"--interval", &options.table.interval_s, "seconds between rows, if a mapped table has no time",
                 tools::positive()}});
  table[0]->delimiter(',');
  add_table_options(command, options.table);
  const auto any = add_options(
      command, {{"--config", &options.config, "captures: configuration of the prismd that recorded them"},
                {"--axis", &options.axis, "axis to use, if the recording has several"},
                {"--leave-out", &options.leave_out,
                 "FROM..TO: times not to use, as dates, or s of a table's time or since the start; repeatable"}});
  any[2]->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_site_options(CLI::App& command, recordings::SiteOptions& options) {
  const auto site = add_options(
      command,
      {{"--latitude", &options.latitude_deg, "site latitude, deg (default: from the log)", tools::within(-90, 90)},
       {"--elevation", &options.elevation_deg, "elevation of the input axis above the horizon, deg",
        tools::within(-90, 90)},
       {"--azimuth", &options.azimuth_deg, "azimuth of the input axis from north towards east, deg",
        tools::within(-360, 360)},
       {"--no-earth-rate", &options.no_earth_rate,
        "do not subtract the Earth rate: means become offsets, sigmas do not change"},
       {"--accept-unit", &options.accept_unit, "use a recording whose mean rate is the Earth rate in another unit"}});
  site[3]->excludes(site[0])->excludes(site[1]);
}

void accept_site_options(CLI::App& command) {
  const auto unused = std::make_shared<recordings::SiteOptions>();
  CLI::App* group = command.add_option_group("site", "");
  group->group("");
  add_site_options(*group, *unused);
  group->callback([unused] {});  // keeps the options' values
}

void add_window_options(CLI::App& command, recordings::TrainingSetOptions& o) {
  add_options(
      command,
      {{"--window", &o.features.length_s, "window of the means and the slope, s", tools::within(1, 3600)},
       {"--slope", &o.slope, "difference (the paper) or least_squares", one_of({"difference", "least_squares"})},
       {"--end-mean", &o.features.end_mean_s, "seconds averaged at each end for --slope difference",
        tools::within(1, 3600)},
       {"--max-gap", &o.features.max_gap_s, "longest gap in a window, s; a longer one restarts it",
        tools::within(0, 3600)}},
      Need::kFew);
  refuse_removed(command, "--lag", "a gyro that follows its thermometer slowly has --response");
}

void add_training_set_options(CLI::App& command, recordings::TrainingSetOptions& o) {
  add_source_options(command, o.source);
  add_site_options(command, o.site);
  add_window_options(command, o);
  refuse_removed(command, "--hold-out",
                 "the first line of train has what held-out parts show; evaluate tests another recording");
}

}  // namespace prism::commands
