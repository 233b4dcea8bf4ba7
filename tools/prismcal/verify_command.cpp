// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/verify.hpp"

namespace prism::commands {
namespace {

using nlohmann::ordered_json;
using verification::FileState;
using verification::Finding;
using verification::LogSession;
using verification::VerificationResult;

struct VerifyChoice {
  std::vector<std::string> paths;
  bool json = false;
};

std::string position(const std::string& path, std::size_t line) {
  return line > 0 ? fmt::format("{}:{}", path, line) : path;
}

const char* word(FileState state) { return verification::kStateNames[static_cast<std::size_t>(state)]; }

void print_session(const LogSession& session) {
  constexpr std::size_t kMaxGaps = 10;
  const std::string missing =
      session.missing_s == 0 && session.missing_frames == 0
          ? "complete"
          : fmt::format("missing: {} s in {}, {}", session.missing_s, counted(session.gaps.size(), "gap"),
                        counted(session.missing_frames, "frame"));
  fmt::print("{}: {}session {} to {}: {}, {} of them partial; {}\n", session.log,
             session.axis.empty() ? "" : "axis " + session.axis + ", ", utc_text(session.first_s),
             utc_text(session.last_s), counted(session.rows, "row"), session.partial, missing);
  for (std::size_t i = 0; i < std::min(kMaxGaps, session.gaps.size()); ++i) {
    const verification::Gap& gap = session.gaps[i];
    fmt::print("  no row: {} s, {} to {}\n", gap.last_s - gap.first_s + 1, utc_text(gap.first_s), utc_text(gap.last_s));
  }
  if (session.gaps.size() > kMaxGaps)
    fmt::print("  and {} more gaps (--json lists all)\n", session.gaps.size() - kMaxGaps);
}

void print(const VerificationResult& result) {
  std::size_t skipped = 0;
  for (const Finding& finding : result.findings) {
    skipped += finding.state == FileState::kSkipped;
    if (finding.state != FileState::kSkipped)
      fmt::print("{}: {}: {}\n", position(finding.path, finding.line), word(finding.state), finding.text);
  }
  for (const LogSession& session : result.sessions) print_session(session);
  const auto good = static_cast<std::size_t>(std::count_if(
      result.findings.begin(), result.findings.end(),
      [](const Finding& finding) { return finding.state == FileState::kIntact || finding.state == FileState::kOpen; }));
  fmt::print("faults: {}; intact files: {}; other files: {}\n", result.faults(), good, skipped);
}

ordered_json json_of(const VerificationResult& result) {
  ordered_json findings = ordered_json::array(), sessions = ordered_json::array();
  for (const Finding& finding : result.findings) {
    ordered_json json = {{"path", finding.path}, {"state", word(finding.state)}, {"text", finding.text}};
    if (finding.line > 0) json["line"] = finding.line;
    json["fault"] = verification::is_fault(finding.state);
    findings.push_back(std::move(json));
  }
  for (const LogSession& session : result.sessions) {
    ordered_json gaps = ordered_json::array();
    for (const auto& gap : session.gaps) gaps.push_back({{"first_s", gap.first_s}, {"last_s", gap.last_s}});
    sessions.push_back({{"log", session.log},
                        {"axis", session.axis.empty() ? ordered_json() : ordered_json(session.axis)},
                        {"first_s", session.first_s},
                        {"last_s", session.last_s},
                        {"rows", session.rows},
                        {"partial", session.partial},
                        {"missing_s", session.missing_s},
                        {"missing_frames", session.missing_frames},
                        {"holes", std::move(gaps)}});
  }
  return {{"faults", result.faults()}, {"findings", std::move(findings)}, {"sessions", std::move(sessions)}};
}

int run(const VerifyChoice& choice) {
  VerificationResult result;
  for (const std::string& path : choice.paths) {
    VerificationResult one = verification::verify(path, read_progress());
    std::move(one.findings.begin(), one.findings.end(), std::back_inserter(result.findings));
    std::move(one.sessions.begin(), one.sessions.end(), std::back_inserter(result.sessions));
  }
  if (!choice.json) print(result);
  if (choice.json) fmt::print("{}\n", json_text(json_of(result), 2));
  return result.faults() == 0 ? 0 : 1;
}

}  // namespace

void add_verify_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("verify", "check logs and captures for damage");
  const auto choice = std::make_shared<VerifyChoice>();
  add_options(*command, {{"path", &choice->paths, "logs and captures; or folders"}}, Need::kRequired);
  add_options(*command, {{"--json", &choice->json, "print JSON"}});
  tools::add_examples(*command, {"prismcal verify /var/log/prismd/gyro1"});
  command->callback([choice, &code] { code = run(*choice); });
}

}  // namespace prism::commands
