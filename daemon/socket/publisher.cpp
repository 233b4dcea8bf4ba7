// SPDX-License-Identifier: MIT
#include "daemon/socket/publisher.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "base/escape.hpp"
#include "compensation/compensated_text.hpp"

namespace prism::socket {

std::string_view History::add(const compensation::CompensatedWindow& row, std::string_view axis) {
  if (blocks_.empty() || blocks_.back()->begins.size() == kBlockRows) blocks_.push_back(std::make_shared<Block>());
  Block& block = *blocks_.back();
  block.begins.push_back(block.text.size());
  append_row(block.text, axis, row);
  block.text += ',';
  if (blocks_.size() > kRows / kBlockRows + 1) blocks_.pop_front();
  return std::string_view(block.text).substr(block.begins.back(), block.text.size() - 1 - block.begins.back());
}

std::size_t History::kept() const {
  return blocks_.empty() ? 0 : (blocks_.size() - 1) * kBlockRows + blocks_.back()->begins.size();
}

std::size_t History::size() const { return std::min(kRows, kept()); }

std::vector<TextPart> History::json(std::size_t count) const {
  std::vector<TextPart> parts{TextPart("[")};
  std::size_t skip = kept() - std::min(count, size());
  for (const std::shared_ptr<Block>& block : blocks_) {
    const std::size_t rows = block->begins.size();
    const std::size_t skipped = std::min(rows, skip);
    skip -= skipped;
    if (skipped == rows) continue;
    const std::string_view text = std::string_view(block->text).substr(block->begins[skipped]);
    block == blocks_.back() ? parts.emplace_back(std::string(text.substr(0, text.size() - 1)))
                            : parts.emplace_back(std::shared_ptr<const void>(block), text);
  }
  parts.emplace_back("]");
  return parts;
}

std::string row_head(std::string_view axis) { return R"({"axis":)" + json_text(nlohmann::json(axis)); }

// Replaces the row's '{' by a comma.
char* put_row(char* at, std::string_view head, const compensation::Compensated& row) {
  char* const comma = std::copy_n(head.data(), head.size(), at);
  char* const end = compensation::put_json(comma, row);
  *comma = ',';
  return end;
}

void append_row(std::string& text, std::string_view axis, const compensation::CompensatedWindow& row) {
  text += row_head(axis);
  const std::size_t comma = text.size();
  compensation::append_json(text, row);
  text[comma] = ',';
}

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
    const std::uint32_t every = client->subscription.sample_every, axes = client->subscription.axes;
    const auto same = [&](const Topic& topic) { return topic.every == every && topic.axes == axes; };
    if (every == 0 || std::any_of(topics.begin(), topics.end(), same)) continue;
    const auto old = std::find_if(topics_.begin(), topics_.end(), same);
    topics.push_back(old != topics_.end() ? std::move(*old)
                                          : Topic{every, axes, std::vector<std::uint32_t>(heads_.size(), 1), 0, {}});
  }
  topics_ = std::move(topics);
}

// A new pipeline may have other axis names.
void Publisher::use_axes(const pipeline::Rows& rows) {
  const bool same = axes_ && *axes_ == *rows.axes;
  axes_ = rows.axes;
  if (same) return;
  heads_.clear();
  for (const std::string& axis : *axes_) heads_.push_back(std::string(kSampleHead) + row_head(axis));
  for (Topic& topic : topics_) topic.due.assign(heads_.size(), 1);
  histories_.resize(heads_.size());
}

void Publisher::rows(const pipeline::Rows& rows, bool unwritten) {
  if (!rows.axes) return;  // not from a pipeline: no rows
  if (axes_ != rows.axes) use_axes(rows);
  const bool hold = unwritten && !disk_late_;
  std::size_t next = 0;
  for (std::size_t i = 0; i < rows.windows.size(); ++i) {
    const pipeline::Rows::Window& window = rows.windows[i];
    if (topics_.empty()) next = window.samples_before;
    for (; next < window.samples_before; ++next) sample(rows.samples[next]);
    this->window(window);
    const bool last = i + 1 == rows.windows.size() || rows.windows[i + 1].samples_before != window.samples_before;
    if (!hold && last) release();
  }
  if (topics_.empty()) return;
  for (; next < rows.samples.size(); ++next) sample(rows.samples[next]);
  flush();
}

void Publisher::rows_written() {
  held_before_ = disk_late_ = false;
  release();
}

void Publisher::release_late() {
  if (!std::exchange(held_before_, !held_.empty()) || held_.empty()) return;
  disk_late_ = true;
  release();
}

void Publisher::sample(const pipeline::Rows::Sample& sample) {
  const std::string& head = heads_[sample.axis];
  for (Topic& topic : topics_) {
    if ((topic.axes >> sample.axis & 1) == 0 || --topic.due[sample.axis] > 0) continue;
    topic.due[sample.axis] = topic.every;
    char* const at = topic.text.room(head.size() + compensation::kJsonChars + kTail.size());
    topic.text.end_at(put(put_row(at, head, sample.row), kTail));
    ++topic.rows;
  }
}

void Publisher::flush() {
  for (Topic& topic : topics_) {
    if (topic.rows == 0) continue;
    std::optional<TextPart> shared;  // created for the first client whose socket is full, which is rare
    for (const auto& client : clients_) {
      if (client->subscription.sample_every != topic.every || client->subscription.axes != topic.axes) continue;
      const auto sent = client->offer(topic.text.view(), topic.rows);
      if (!sent) continue;
      if (!shared) shared.emplace(std::string(topic.text.view()));
      client->enqueue(*shared, *sent);
    }
    topic.text.clear();
    topic.rows = 0;
  }
}

void Publisher::window(const pipeline::Rows::Window& window) {
  const auto axis = static_cast<std::uint32_t>(window.axis);
  const std::string_view row = histories_[axis].add(window.row, (*axes_)[axis]);
  const auto wants = [&](const auto& client) { return choice_of(*client).wants(axis); };
  if (std::none_of(clients_.begin(), clients_.end(), wants)) return;
  held_.push_back({axis, std::string(kWindowHead).append(row).append(kTail)});
}

Publisher::Choice Publisher::choice_of(const Client& client) {
  return {client.subscription.axes, client.subscription.windows, client.subscription.events};
}

void Publisher::release() {
  if (held_.empty()) return;
  flush();
  std::set<Choice> choices;
  for (const auto& client : clients_) choices.insert(choice_of(*client));
  for (const Choice& choice : choices) send_held(choice);
  held_.clear();
}

// One text for all clients with the same choice.
void Publisher::send_held(const Choice& choice) {
  std::string text;
  std::uint64_t rows = 0;
  for (const Held& held : held_) {
    if (!choice.wants(held.axis)) continue;
    text += held.text;
    ++rows;
  }
  if (rows == 0) return;
  const TextPart part(std::move(text));
  for (const auto& client : clients_) {
    if (choice_of(*client) == choice) client->send(part, rows);
  }
}

void Publisher::event(const Event& event) {
  std::string text = std::string(kEventHead).append(event.json).append(kTail);
  const bool about_rows = event.kind == "quality" || event.kind == "implausible";
  if (about_rows && !held_.empty()) {
    held_.push_back({kEvent, std::move(text)});
    return;
  }
  const TextPart part(std::move(text));
  for (const auto& client : clients_) {
    if (client->subscription.events) client->send(part, 1);
  }
}

// Before the first row: empty.
const History& Publisher::history(std::size_t axis) const {
  static const History kNone;
  return axis < histories_.size() ? histories_[axis] : kNone;
}

std::uint64_t Publisher::lost_rows() const {
  std::uint64_t lost = lost_by_gone_;
  for (const auto& client : clients_) lost += client->lost_rows();
  return lost;
}

}  // namespace prism::socket
