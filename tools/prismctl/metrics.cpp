// SPDX-License-Identifier: MIT
#include "tools/prismctl/metrics.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "config/socket_path.hpp"
#include "tools/client/connection.hpp"
#include "tools/metrics/exposition.hpp"
#include "tools/metrics/gyro_metrics.hpp"

namespace prism::prismctl {
namespace {

metrics::GyroAnswers answers_of(const std::string& socket) {
  metrics::GyroAnswers answers;
  if (config::would_start(socket)) return answers;
  auto connection = client::DaemonConnection::open(socket);
  if (!connection) return answers;
  const auto ask = [&](const char* method, nlohmann::json& into) {
    auto answer = connection->ask(method);
    if (answer) {
      into = std::move(*answer);
    } else if (answer.error().code != config::kGone) {
      fmt::print(stderr, "prismctl: {}: {}\n", printable(config::instance_name(socket)), answer.error().text());
    }
    return answer.has_value();
  };
  if (ask("status", answers.status) && ask("line", answers.line)) ask("stability", answers.stability);
  return answers;
}

}  // namespace

int metrics(const std::string& socket, const std::string& name, const std::string& file) {
  const auto fail = [](const Error& error) {
    fmt::print(stderr, "prismctl: {}\n", error.text());
    return 1;
  };
  std::vector<std::string> sockets;
  const char* const environment = std::getenv("PRISM_SOCKET");
  const bool named = !socket.empty() || !name.empty() || (environment != nullptr && *environment != '\0');
  if (!named) {
    std::vector<std::string> invalid;
    sockets = client::running_sockets(&invalid);
    for (const std::string& path : invalid)
      fmt::print(stderr, "prismctl: {}: the name is skipped, expected {}\n", path, rule_text(TextRule::kName));
  } else {
    const auto found = client::find_socket(socket, name);
    if (!found) return fail(found.error());
    sockets = {*found};
  }
  metrics::Exposition exposition;
  for (const std::string& path : sockets) metrics::add_gyro(exposition, config::instance_name(path), answers_of(path));
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  metrics::add_time(exposition, std::chrono::duration<double>(now).count());
  if (file.empty()) {
    fmt::print("{}", exposition.text());
    return 0;
  }
  const auto written = metrics::write_exposition(file, exposition.text());
  return written ? 0 : fail(written.error());
}

}  // namespace prism::prismctl
