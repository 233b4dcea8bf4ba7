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

void History::add(const std::string& row) {
  if (blocks_.empty() || blocks_.back().begins.size() == kBlockRows) blocks_.emplace_back();
  if (blocks_.size() > kRows / kBlockRows + 1) blocks_.pop_front();
  Block& last = blocks_.back();
  last.text->append(1, ',');
  last.begins.push_back(last.text->size());
  last.text->append(row);
}

void History::append_to(std::vector<Piece>& pieces, std::size_t count) const {
  std::size_t skipped = stored() - std::min(count, size());
  bool is_first = true;
  for (const Block& block : blocks_) {
    if (skipped >= block.begins.size()) {
      skipped -= block.begins.size();
      continue;
    }
    const Text text = &block == &blocks_.back() ? std::make_shared<const std::string>(*block.text) : block.text;
    pieces.push_back({text, is_first ? block.begins[skipped] : 0});
    is_first = false;
    skipped = 0;
  }
}

namespace {

// Start of the JSON of a row: {"axis":"x"
std::string row_head(std::string_view axis) { return R"({"axis":)" + json_text(nlohmann::json(axis)); }

// Appends a row that starts with its axis: `head` replaces its '{'.
template <class Row>
void append_row(std::string& text, std::string_view head, const Row& row) {
  text += head;
  const std::size_t comma = text.size();
  compensation::append_json(text, row);
  text[comma] = ',';
}

constexpr std::string_view kSampleHead = R"({"jsonrpc":"2.0","method":"sample","params":)";
constexpr std::string_view kWindowHead = R"({"jsonrpc":"2.0","method":"window","params":)";
constexpr std::string_view kEventHead = R"({"jsonrpc":"2.0","method":"event","params":)";
constexpr std::string_view kTail = "}\n";

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
    append_row(topic.text, head, sample.row);
    topic.text += kTail;
    ++topic.rows;
  }
}

void Publisher::flush() {
  for (Topic& topic : topics_) {
    if (topic.rows == 0) continue;
    const auto text = std::make_shared<const std::string>(topic.text);
    for (const auto& client : clients_) {
      const bool own = client->subscription.sample_every == topic.every && client->subscription.axes == topic.axes;
      if (own) client->send(text, topic.rows);
    }
    topic.text.clear();
    topic.rows = 0;
  }
}

void Publisher::window(const pipeline::Rows::Window& window) {
  const auto axis = static_cast<std::uint32_t>(window.axis);
  std::string row;
  append_row(row, row_head((*axes_)[axis]), window.row);
  const auto wants = [&](const auto& client) { return choice_of(*client).wants(axis); };
  if (std::any_of(clients_.begin(), clients_.end(), wants))
    held_.push_back({axis, std::string(kWindowHead).append(row).append(kTail)});
  histories_[axis].add(row);
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
  const auto shared = std::make_shared<const std::string>(std::move(text));
  for (const auto& client : clients_) {
    if (choice_of(*client) == choice) client->send(shared, rows);
  }
}

void Publisher::event(const Event& event) {
  std::string text = std::string(kEventHead).append(event.json).append(kTail);
  const bool about_rows = event.kind == "quality" || event.kind == "implausible";
  if (about_rows && !held_.empty()) {
    held_.push_back({kEvent, std::move(text)});
    return;
  }
  const auto shared = std::make_shared<const std::string>(std::move(text));
  for (const auto& client : clients_) {
    if (client->subscription.events) client->send(shared, 1);
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
