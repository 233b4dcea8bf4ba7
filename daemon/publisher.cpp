// SPDX-License-Identifier: MIT
#include "daemon/publisher.hpp"

#include <algorithm>
#include <utility>

#include "compensation/compensated_text.hpp"

namespace prism::daemon {
namespace {

constexpr std::string_view kSampleHead = R"({"jsonrpc":"2.0","method":"sample","params":)";
constexpr std::string_view kWindowHead = R"({"jsonrpc":"2.0","method":"window","params":)";
constexpr std::string_view kEventHead = R"({"jsonrpc":"2.0","method":"event","params":)";
constexpr std::string_view kTail = "}\n";

char* put(char* at, std::string_view text) { return std::copy_n(text.data(), text.size(), at); }

}  // namespace

void Publisher::add(std::shared_ptr<Client> client) { clients_.push_back(std::move(client)); }

void Publisher::remove(const Client* client) {
  const auto gone = std::find_if(clients_.begin(), clients_.end(), [&](const auto& c) { return c.get() == client; });
  if (gone == clients_.end()) return;
  lost_by_gone_ += (*gone)->lost_rows();
  clients_.erase(gone);
  update();
}

void Publisher::update() {
  flush();
  std::vector<Topic> topics;
  for (const auto& client : clients_) {
    const std::uint32_t every = client->subscription.sample_every;
    const auto same = [every](const Topic& topic) { return topic.every == every; };
    if (every == 0 || std::any_of(topics.begin(), topics.end(), same)) continue;
    const auto old = std::find_if(topics_.begin(), topics_.end(), same);
    topics.push_back(old != topics_.end() ? std::move(*old) : Topic{every, 1, 0, {}});
  }
  topics_ = std::move(topics);
}

[[gnu::hot]] void Publisher::sample(const compensation::Compensated& row) {
  for (Topic& topic : topics_) {
    if (--topic.due > 0) continue;
    topic.due = topic.every;
    char* at = topic.text.room(kSampleHead.size() + compensation::kJsonChars + kTail.size());
    at = put(at, kSampleHead);
    at = compensation::put_json(at, row);
    topic.text.end_at(put(at, kTail));
    ++topic.rows;
  }
}

[[gnu::hot]] void Publisher::flush() {
  for (Topic& topic : topics_) {
    if (topic.rows == 0) continue;
    ReportPtr report;  // made for the first client that cannot take all at once; most can, and cost no allocation
    for (const auto& client : clients_) {
      if (client->subscription.sample_every != topic.every) continue;
      const auto sent = client->offer(topic.text.view(), topic.rows);
      if (!sent) continue;
      if (!report) report = std::make_shared<const Report>(Report{std::string(topic.text.view()), topic.rows});
      client->enqueue(report, *sent);
    }
    topic.text.clear();
    topic.rows = 0;
  }
}

void Publisher::window(const compensation::CompensatedWindow& row) {
  const bool wanted =
      std::any_of(clients_.begin(), clients_.end(), [](const auto& c) { return c->subscription.windows; });
  if (!wanted) return;
  flush();
  std::string text(kWindowHead);
  compensation::append_json(text, row);
  text += kTail;
  const auto report = std::make_shared<const Report>(Report{std::move(text), 1});
  for (const auto& client : clients_) {
    if (client->subscription.windows) client->send(report);
  }
}

void Publisher::event(const std::string& params) {
  flush();
  const auto report = std::make_shared<const Report>(Report{std::string(kEventHead).append(params).append(kTail), 1});
  for (const auto& client : clients_) {
    if (client->subscription.events) client->send(report);
  }
}

std::uint64_t Publisher::lost_rows() const {
  std::uint64_t lost = lost_by_gone_;
  for (const auto& client : clients_) lost += client->lost_rows();
  return lost;
}

}  // namespace prism::daemon
