// SPDX-License-Identifier: MIT
#include "tools/prismweb/metrics_page.hpp"

#include <array>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "tools/client/response.hpp"
#include "tools/metrics/gyro_metrics.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using nlohmann::json;

// Scrapers time out after about 10 s, and would then miss the other instances, too.
constexpr std::chrono::seconds kScrapeTimeout{4};

struct MetricsResponses {
  explicit MetricsResponses(asio::io_context& io) : complete(io, kScrapeTimeout) {}
  std::map<std::string, metrics::GyroAnswers> gyros;
  int missing = 0;
  asio::steady_timer complete;
};

void request_metrics(const std::shared_ptr<MetricsResponses>& responses, InstanceProxy& proxy) {
  using Member = json metrics::GyroAnswers::*;
  static constexpr std::array<std::pair<const char*, Member>, 3> kRequests = {
      {{"status", &metrics::GyroAnswers::status},
       {"line", &metrics::GyroAnswers::line},
       {"stability", &metrics::GyroAnswers::stability}}};
  responses->gyros[proxy.name()];
  for (const auto& [method, member] : kRequests) {
    ++responses->missing;
    proxy.call(method, json::object(),
               [responses, name = proxy.name(), method = method, member = member](std::string_view text) {
                 if (client::Response response = client::response_of_member(method, text))
                   responses->gyros[name].*member = std::move(*response);
                 if (--responses->missing == 0) responses->complete.cancel();
               });
  }
}

}  // namespace

asio::awaitable<Answer> metrics_answer(WebServer& server) {
  const auto responses = std::make_shared<MetricsResponses>(server.io());
  for (const auto& proxy : server.instances().all()) request_metrics(responses, *proxy);
  if (responses->missing > 0) co_await responses->complete.async_wait(kUse);
  metrics::Exposition exposition;
  for (const auto& [name, answers] : responses->gyros) metrics::add_gyro(exposition, name, answers);
  metrics::add_time(exposition,
                    std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
  Answer answer;
  answer.media_type = "text/plain; version=0.0.4; charset=utf-8";
  answer.body = exposition.text();
  co_return answer;
}

}  // namespace prism::prismweb
