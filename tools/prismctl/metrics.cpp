// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/outside_text.hpp"
#include "config/socket_path.hpp"
#include "tools/client/client.hpp"
#include "tools/client/instances.hpp"
#include "tools/metrics/exposition.hpp"
#include "tools/metrics/gyro_metrics.hpp"
#include "tools/prismctl/commands.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

boost::asio::awaitable<Result<void>> request(client::Client& client, metrics::GyroAnswers& answers) {
  const std::array<std::pair<const char*, nlohmann::json*>, 3> all = {
      {{"status", &answers.status}, {"line", &answers.line}, {"stability", &answers.stability}}};
  for (const auto& [method, answer] : all) {
    auto response = co_await client.ask(method);
    if (!response && response.error().code != config::kGone)
      fmt::print(stderr, "prismctl: {}: {}\n", printable(client.name()), response.error().text());
    if (!response) break;
    *answer = std::move(*response);
  }
  co_return Result<void>();
}

}  // namespace

int metrics(const std::string& socket, const std::string& name, const std::string& file) {
  std::vector<std::string> sockets, invalid;
  const char* const environment = std::getenv("PRISM_SOCKET");
  if (socket.empty() && name.empty() && (environment == nullptr || *environment == '\0')) {
    sockets = client::running_sockets(&invalid);
  } else {
    const auto found = client::find_socket(socket, name);
    if (!found) return fail(found.error());
    sockets = {*found};
  }
  for (const std::string& path : invalid)
    fmt::print(stderr, "prismctl: {}: the name is skipped, expected {}\n", path, rule_text(TextRule::kName));
  metrics::Exposition exposition;
  for (const std::string& path : sockets) {
    metrics::GyroAnswers answers;
    const client::Work work = [&](client::Client& client) { return request(client, answers); };
    if (!config::would_start(path)) (void)client::connected(path, work);  // without an answer, it is down
    metrics::add_gyro(exposition, config::instance_name(path), answers);
  }
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
