// SPDX-License-Identifier: MIT
// Scripts of a recording's seconds: a table that is read, what is found in the values, and its blocks.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "tests/support/scripts.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::recordings {
namespace {

using compensation::SecondMean;

/// Commands: see the pages.
class SecondsPlayer {
 public:
  std::vector<std::string> play(const std::string& command, std::istream& words) {
    lines_.clear();
    if (command == "table") {
      std::ofstream(folder_.file("x.csv"), std::ios::binary) << test::rest_of(words);
    } else if (command == "read") {
      read(words);
    } else if (command == "suggest") {
      suggest(words);
    } else if (command == "seconds") {
      const auto first = test::next<std::int64_t>(words);
      const auto count = test::next<std::int64_t>(words);
      const double rate = number(words), degc = number(words), volt = number(words), noise = number(words, 0);
      for (std::int64_t i = 0; i < count; ++i) {
        SecondMean mean;
        mean.second = first + i;
        mean.samples = 1;
        mean.rate_deg_per_h = rate + noise * static_cast<double>(i * 7919 % 211 - 105) / 100;
        mean.temperature_degc = degc;
        mean.uhfo_v = volt;
        seconds_.push_back(mean);
      }
    } else if (command == "set") {
      const auto field = test::next<std::string>(words);
      const auto first = test::next<std::size_t>(words), count = test::next<std::size_t>(words);
      const double value = number(words), step = number(words, 0);
      for (std::size_t i = 0; i < count; ++i) set(seconds_.at(first + i), field, value + step * static_cast<double>(i));
    } else if (command == "session") {
      sessions_.insert(test::next<std::size_t>(words));
    } else if (command == "judge") {
      judge(test::next<std::string>(words) == "date");
    } else if (command == "rows") {
      rows(words);
    } else if (command == "jumps") {
      JumpFinder finder;
      for (std::size_t i = 0; i < seconds_.size(); ++i) finder.push(seconds_[i], sessions_.contains(i));
      print(finder.findings(test::next<std::string>(words) == "date"));
    } else if (command == "blocks") {
      blocks(words);
    } else if (command == "overlap") {
      overlap(words);
    } else if (command == "mean") {
      mean(words);
    } else if (command == "leave_out") {
      leave_out(words);
    }
    return lines_;
  }

 private:
  static double number(std::istream& words, double otherwise = kUnknown) {
    const auto word = test::next<std::string>(words);
    return word.empty() ? otherwise : std::stod(word);
  }

  template <class... Args>
  void give(fmt::format_string<Args...> format, Args&&... args) {
    lines_.push_back(fmt::format(format, std::forward<Args>(args)...));
  }

  void give_error(const Error& error) {
    std::string text = error.text();
    const std::string path = folder_.file("x.csv");
    for (std::size_t at = 0; (at = text.find(path, at)) != std::string::npos;) text.replace(at, path.size(), "x.csv");
    give("{}", text);
  }

  void print(const std::vector<Finding>& findings) {
    for (const Finding& finding : findings)
      give("{} {} to {}: {}{}", finding.kind, finding.begin, finding.end, finding.line(),
           finding.severity == Severity::kQuestion ? " (question)" : "");
  }

  static void set(SecondMean& mean, const std::string& field, double value) {
    const auto flag = value != 0;
    if (field == "second") mean.second = static_cast<std::int64_t>(value);
    if (field == "rate") mean.rate_deg_per_h = value;
    if (field == "more") mean.rate_deg_per_h += value;
    if (field == "T") mean.temperature_degc = value;
    if (field == "U") mean.uhfo_v = value;
    if (field == "partial") mean.partial = flag;
    if (field == "clocks") mean.clocks_differ = flag;
    if (field == "frames") mean.missing_frames = static_cast<std::uint32_t>(value);
    if (field == "any_T") mean.implausible.temperature = flag;
    if (field == "all_T") mean.implausible.temperature = mean.all_implausible.temperature = flag;
    if (field == "all_rate") mean.implausible.rate = mean.all_implausible.rate = flag;
  }

  void print(const SecondMean& mean) {
    std::string text = fmt::format("{}: {} of rate {:.9g}", mean.second, mean.samples, mean.rate_deg_per_h);
    if (std::isfinite(mean.temperature_degc)) text += fmt::format(", T {:.9g}", mean.temperature_degc);
    if (std::isfinite(mean.uhfo_v)) text += fmt::format(", U {:.9g}", mean.uhfo_v);
    const std::vector<SensorName> names = sensors_of_list(mean.sensor_list);
    for (std::size_t i = 0; i < mean.sensors.size(); ++i)
      text += fmt::format(", {} {:.9g} {}", names[i].name, mean.sensors[i], names[i].unit);
    text += mean.partial ? ", partial" : "";
    for (const auto& [set, name] : {std::pair(mean.implausible, "implausible"), {mean.all_implausible, "all"}}) {
      if (set.any())
        text +=
            fmt::format(", {}{}{}{}", name, set.rate ? " rate" : "", set.temperature ? " T" : "", set.uhfo ? " U" : "");
    }
    give("{}", text);
  }

  void read(std::istream& words) {
    SourceOptions options;
    for (std::string word; words >> word;) {
      const std::size_t equals = word.find('=');
      const std::string key = word.substr(0, equals), value = word.substr(equals + 1);
      if (key == "interval")
        options.table.interval_s = std::stod(value);
      else if (key == "unit")
        options.table.time_unit = value;
      else if (key == "leave_out")
        options.leave_out.push_back(value);
      else if (key == "unjudged")
        options.judged = false;
      else
        options.map.push_back(word);
    }
    const std::string path = folder_.file("x.csv");
    options.table.announce = [&](const std::string& line) { give("{}", line.substr(path.size() + 2)); };
    std::vector<SecondMean> found;
    const auto recording = read_recording(path, options, [&](const Recording&, const SecondMean& mean, bool) {
      found.push_back(mean);
      return Result<void>();
    });
    if (!recording) return give_error(recording.error());
    if (const auto good = UnmatchedRanges(recording->unmatched).finish(); !good) return give_error(good.error());
    for (const SecondMean& mean : found) print(mean);
  }

  void suggest(std::istream& words) {
    tables::TableOptions options;
    options.decimal = test::next<std::string>(words);
    options.time_unit = test::next<std::string>(words);
    options.interval_s = number(words, 0);
    if (options.decimal == "-") options.decimal.clear();
    if (options.time_unit == "-") options.time_unit.clear();
    const std::string path = folder_.file("x.csv");
    const auto table = tables::PlainTable::open(path, options);
    if (!table) return give_error(table.error());
    std::string text = train_command(*table, options);
    give("{}", text.replace(text.find(path), path.size(), "x.csv"));
  }

  void judge(bool is_date) {
    const std::vector<SecondMean> before = seconds_;
    const auto findings = judge_seconds(seconds_, is_date);
    for (const auto& some : findings) print(some);
    const std::pair<const char*, double SecondMean::*> quantities[] = {
        {"rate", &SecondMean::rate_deg_per_h}, {"T", &SecondMean::temperature_degc}, {"U", &SecondMean::uhfo_v}};
    for (const auto& [name, value] : quantities) {
      std::size_t unknown = 0;
      for (std::size_t i = 0; i < seconds_.size(); ++i)
        unknown += std::isfinite(before[i].*value) && !std::isfinite(seconds_[i].*value);
      if (unknown > 0) give("{} of {} not used", unknown, name);
    }
    std::size_t forgiven = 0;
    for (std::size_t i = 0; i < seconds_.size(); ++i)
      forgiven += before[i].implausible.any() && !seconds_[i].implausible.any();
    if (forgiven > 0) give("{} forgiven", forgiven);
  }

  void rows(std::istream& words) {
    RateRows rows;
    rows.unit_deg_per_h = number(words, 1);
    rows.interval_s = number(words, 1);
    std::vector<double> rates;
    std::vector<std::int64_t> stamps_ns;
    for (const SecondMean& mean : seconds_) rates.push_back(mean.rate_deg_per_h);
    for (const SecondMean& mean : seconds_) stamps_ns.push_back(mean.second * 1'000'000'000 + 123'456'789);
    const auto stamps = test::next<std::string>(words);
    rows.is_date = stamps == "date";
    if (!stamps.empty()) rows.stamps_ns = stamps_ns;
    print(judge_rates(rates, rows));
  }

  void blocks(std::istream& words) {
    compensation::FeatureDefinition features;
    features.length_s = test::next<int>(words, 10);
    features.end_mean_s = test::next<int>(words, 2);
    features.max_gap_s = test::next<int>(words, 5);
    BlockTableBuilder builder(features, 8, "x");
    for (std::size_t i = 0; i < seconds_.size(); ++i) {
      if (const auto done = builder.push(seconds_[i], sessions_.contains(i)); !done) return give_error(done.error());
    }
    auto table = builder.finish();
    if (!table) return give_error(table.error());
    table_ = std::move(*table);
    std::vector<std::string> ends;
    for (std::size_t i = 0; i < table_.size(); ++i)
      ends.push_back(fmt::format("{}{}", table_.follows[i] ? "+" : "", table_.second(i)));
    give("ends {}; warming {}", fmt::join(ends, " "), table_.warming.size());
    give("missing {} s, unused {} s, gaps {}, frames {}", table_.missing_s, table_.unused_s, table_.gaps,
         table_.missing_frames);
    give("{} to {}; starts {}; restarts {}", table_.first_s, table_.last_s, fmt::join(table_.starts, " "),
         fmt::join(table_.restarts, " "));
    give("mean {:.6g}, bias {:.6g}, hours {:.4g}, sd {:.4g}", table_.mean_rate_deg_per_h(),
         fmt::join(table_.bias_deg_per_h, " "), fmt::join(table_.hours(), " "), fmt::join(table_.second_sds(), " "));
    if (table_.rate_step_deg_per_h > 0) give("rounded to {:.4g}", table_.rate_step_deg_per_h);
    if (!table_.spikes.empty()) give("{}", table_.spikes);
  }

  /// Of the blocks with a model of the same data, its times later and its rates higher in turn.
  void overlap(std::istream& words) {
    const auto later = test::next<std::int64_t>(words);
    const double higher = number(words, 0);
    const auto points = test::next<std::size_t>(words, 32);
    const auto other = test::next<std::size_t>(words);  // these are of another recording
    nlohmann::json fingerprint = nlohmann::json::array();
    for (const auto& point : fingerprint_json(table_)) {
      if (fingerprint.size() == points) break;
      const std::size_t i = fingerprint.size();
      fingerprint.push_back({point[0].get<std::int64_t>() + later,
                             point[1].get<double>() + (i < other ? 5 : (i % 2 == 0 ? higher : -higher))});
    }
    const std::string text =
        overlap_text(nlohmann::json{{"recordings", {{{"fingerprint", fingerprint}}}}}.dump(), {}, table_);
    give("{}", text.empty() ? "no overlap" : text);
  }

  void mean(std::istream& words) {
    const double mean = number(words), earth = number(words);
    const auto unit = likely_unit(mean, earth);
    const auto good = check_unit(mean, earth, "x");
    const auto question = sign_question(mean, earth);
    give("{}", unit ? "in " + *unit : question ? question->text : good ? "good" : good.error().text());
  }

  void leave_out(std::istream& words) {
    LeaveOut leave_out({test::next<std::string>(words)});
    const auto first = test::next<std::int64_t>(words);
    const bool is_date = test::next<std::string>(words) == "date";
    if (const auto good = leave_out.begin(first, is_date); !good) return give_error(good.error());
    std::vector<std::int64_t> left;
    for (std::int64_t second = first; second < first + 10; ++second) {
      if (leave_out.contains(second)) left.push_back(second - first);
      leave_out.contains(second);  // of another axis: counted once
    }
    give("{}: {}", fmt::join(leave_out.notes(), ""), fmt::join(left, " "));
  }

  std::vector<std::string> lines_;
  const test::TemporaryFolder folder_;
  std::vector<SecondMean> seconds_;
  std::set<std::size_t> sessions_;
  BlockTable table_;
};

TEST(MappedTables, Scripts) { test::expect_scripts<SecondsPlayer>("prismcal/mapped_tables.txt"); }
TEST(Findings, Scripts) { test::expect_scripts<SecondsPlayer>("prismcal/findings.txt"); }
TEST(BlockTables, Scripts) { test::expect_scripts<SecondsPlayer>("prismcal/block_tables.txt"); }

}  // namespace
}  // namespace prism::recordings
