// SPDX-License-Identifier: MIT
// The documents list the methods and error codes of the tables, and no others.
#include "config/socket_protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "config/socket_path.hpp"
#include "tests/support/document.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::config {
namespace {

/// As in docs/protocol.md.
constexpr std::pair<SocketError, const char*> kErrorNames[] = {{kParseError, "parse_error"},
                                                               {kInvalidRequest, "invalid_request"},
                                                               {kUnknownMethod, "no_method"},
                                                               {kInvalidParams, "invalid_params"},
                                                               {kFailed, "failed"},
                                                               {kNotPermitted, "not_permitted"},
                                                               {kUnknownCursor, "unknown_cursor"},
                                                               {kGone, "gone"},
                                                               {kBusy, "busy"},
                                                               {kNoLog, "no_log"},
                                                               {kTimeout, "timeout"},
                                                               {kRowsGone, "rows_gone"}};

/// First groups of all matches, in order.
std::vector<std::string> found_in(const std::string& text, const char* pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at) found.push_back((*at)[1]);
  return found;
}

TEST(SocketProtocol, IsDocumented) {
  std::vector<std::string> methods, errors;
  for (const SocketMethod& method : kSocketMethods) methods.emplace_back(method.name);
  for (const auto& [code, name] : kErrorNames) errors.push_back(std::to_string(-code) + "|`" + std::string(name) + "`");
  EXPECT_EQ(found_in(test::document_section("protocol.md", "## Requests"), "\n\\|`([a-z]+)`\\|"), methods);
  EXPECT_THAT(found_in(test::document_section("protocol.md", "## Errors"), "\n\\|−([0-9]+\\|`[a-z_]+`)\\|"),
              testing::UnorderedElementsAreArray(errors));
}

TEST(SocketProtocol, FindsMethodsByName) {
  EXPECT_EQ(find_method("rows")->name, "rows");
  EXPECT_EQ(find_method("row"), nullptr);
  for (const SocketMethod& method : kSocketMethods) EXPECT_EQ(find_method(method.name), &method);
}

namespace fs = std::filesystem;

TEST(SocketPlace, DetectsASocketThatWouldStartAnInstance) {
  const test::TemporaryFolder folder;
  const std::string socket = folder.file("gyro1.sock");
  EXPECT_FALSE(would_start(socket)) << "a prismd started by hand listens itself";
  fs::create_directory(folder.file("activated"));
  fs::create_symlink(socket, folder.file("activated/gyro1.sock"));
  EXPECT_TRUE(would_start(socket)) << "it was stopped, or not started yet";
  fs::create_directories(folder.file("running/gyro1"));
  EXPECT_FALSE(would_start(socket)) << "it is running";
  EXPECT_FALSE(would_start(folder.file("gyro2.sock")));
}

}  // namespace
}  // namespace prism::config
