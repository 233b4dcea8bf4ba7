// SPDX-License-Identifier: MIT
// The lines of prismd's stderr: with a time for a terminal, with a priority for the journal.
#include "daemon/logging.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace prism::daemon {
namespace {

using pipeline::Severity;

/// The output for one event of each severity, one of which was repeated.
std::string logged(const std::string& level) {
  testing::internal::CaptureStderr();
  begin_logging(level);
  for (const Severity severity : {Severity::kDebug, Severity::kInfo, Severity::kWarning, Severity::kError}) {
    socket::Event event;
    event.severity = severity;
    event.text = fmt::format("{} {{}} \a", socket::severity_name(severity));
    event.repeats = severity == Severity::kWarning ? 1 : 0;
    log_event(event);
  }
  finish_logging();
  return testing::internal::GetCapturedStderr();
}

TEST(Logging, TheJournalGetsThePriority) {
  ::setenv("JOURNAL_STREAM", "8:1", 1);
  const std::string debug = "<7>debug {} \\x07\n", info = "<6>info {} \\x07\n", error = "<3>error {} \\x07\n",
                    warning = "<4>warning {} \\x07 (1 more times since the last message)\n";
  EXPECT_EQ(logged("debug"), debug + info + warning + error);
  EXPECT_EQ(logged("info"), info + warning + error);
  EXPECT_EQ(logged("warning"), warning + error);
  EXPECT_EQ(logged("error"), error);
}

TEST(Logging, ATerminalGetsTheTime) {
  ::unsetenv("JOURNAL_STREAM");
  EXPECT_THAT(logged("error"),
              testing::MatchesRegex("2[0-9]{3}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}\\.[0-9]{3}Z "
                                    "prismd: error: error \\{\\} \\\\x07\n"));
}

}  // namespace
}  // namespace prism::daemon
