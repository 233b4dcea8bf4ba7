// SPDX-License-Identifier: MIT
#include "daemon/publisher.hpp"

#include <algorithm>
#include <optional>
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

void Publisher::rows(const pipeline::Rows& rows, bool hold) {
  std::size_t next = 0;
  for (const pipeline::Rows::Window& window : rows.windows) {
    if (topics_.empty()) next = window.samples_before;
    for (; next < window.samples_before; ++next) sample(rows.samples[next].row);
    this->window(window.row);
    if (!hold) release();
  }
  if (topics_.empty()) return;
  for (; next < rows.samples.size(); ++next) sample(rows.samples[next].row);
  flush();
}

void Publisher::sample(const compensation::Compensated& row) {
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

void Publisher::flush() {
  for (Topic& topic : topics_) {
    if (topic.rows == 0) continue;
    std::optional<TextPart> shared;  // made for the first client that cannot take all at once; most can
    for (const auto& client : clients_) {
      if (client->subscription.sample_every != topic.every) continue;
      const auto sent = client->offer(topic.text.view(), topic.rows);
      if (!sent) continue;
      if (!shared) shared.emplace(std::string(topic.text.view()));
      client->enqueue(*shared, *sent);
    }
    topic.text.clear();
    topic.rows = 0;
  }
}

void Publisher::window(const compensation::CompensatedWindow& row) {
  const bool wanted =
      std::any_of(clients_.begin(), clients_.end(), [](const auto& c) { return c->subscription.windows; });
  if (!wanted) return;
  std::string text(kWindowHead);
  compensation::append_json(text, row);
  text += kTail;
  held_.emplace_back(std::move(text));
}

void Publisher::release() {
  if (held_.empty()) return;
  flush();
  for (const TextPart& text : held_) send_window(text);
  held_.clear();
}

void Publisher::send_window(const TextPart& text) {
  for (const auto& client : clients_) {
    if (client->subscription.windows) client->send(text, 1);
  }
}

void Publisher::event(const std::string& params) {
  const TextPart text(std::string(kEventHead).append(params).append(kTail));
  for (const auto& client : clients_) {
    if (client->subscription.events) client->send(text, 1);
  }
}

std::uint64_t Publisher::lost_rows() const {
  std::uint64_t lost = lost_by_gone_;
  for (const auto& client : clients_) lost += client->lost_rows();
  return lost;
}

}  // namespace prism::daemon
