// SPDX-License-Identifier: MIT
#include "tools/prismweb/metrics_page.hpp"

#include <array>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/metrics/gyro_metrics.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using nlohmann::json;

// A scraper gives up after some 10 s, and would then know nothing of the others, too.
constexpr std::chrono::seconds kPatience{4};

struct Gathered {
  explicit Gathered(asio::io_context& io) : all_there(io, kPatience) {}
  std::map<std::string, metrics::GyroAnswers> gyros;
  int missing = 0;
  asio::steady_timer all_there;
};

void gather(const std::shared_ptr<Gathered>& gathered, InstanceProxy& proxy) {
  using Member = json metrics::GyroAnswers::*;
  static constexpr std::array<std::pair<const char*, Member>, 3> kAsked = {
      {{"status", &metrics::GyroAnswers::status},
       {"line", &metrics::GyroAnswers::line},
       {"stability", &metrics::GyroAnswers::stability}}};
  gathered->gyros[proxy.name()];
  for (const auto& [method, member] : kAsked) {
    ++gathered->missing;
    proxy.ask(method, json::object(), [gathered, name = proxy.name(), member = member](std::string_view text) {
      const json answer = json::parse("{" + std::string(text) + "}", nullptr, false);
      if (answer.is_object()) gathered->gyros[name].*member = answer.value("result", json());
      if (--gathered->missing == 0) gathered->all_there.cancel();
    });
  }
}

}  // namespace

asio::awaitable<Answer> metrics_answer(WebServer& server) {
  const auto gathered = std::make_shared<Gathered>(server.io());
  for (const auto& proxy : server.instances().all()) gather(gathered, *proxy);
  if (gathered->missing > 0) co_await gathered->all_there.async_wait(kUse);
  metrics::Exposition exposition;
  for (const auto& [name, answers] : gathered->gyros) metrics::add_gyro(exposition, name, answers);
  metrics::add_time(exposition,
                    std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
  Answer answer;
  answer.media_type = "text/plain; version=0.0.4; charset=utf-8";
  answer.body = exposition.text();
  co_return answer;
}

}  // namespace prism::prismweb
