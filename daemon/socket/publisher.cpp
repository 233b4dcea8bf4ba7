// SPDX-License-Identifier: MIT
#include "daemon/socket/publisher.hpp"

#include <nlohmann/json.hpp>
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

void Publisher::add(std::shared_ptr<Client> client) {
  clients_.push_back(std::move(client));
  update();
}

void Publisher::remove(const Client* client) {
  const auto gone = std::find_if(clients_.begin(), clients_.end(), [&](const auto& c) { return c.get() == client; });
  if (gone == clients_.end()) return;
  lost_by_gone_ += (*gone)->lost_rows();
  clients_.erase(gone);
  update();
}

void Publisher::update() {
  std::vector<Feed> feeds;
  for (const auto& client : clients_) {
    const Subscription& wanted = client->subscription;
    const auto same = [&](const Feed& feed) { return feed.wanted == wanted; };
    if (wanted.is_empty() || std::any_of(feeds.begin(), feeds.end(), same)) continue;
    const auto old = std::find_if(feeds_.begin(), feeds_.end(), same);
    feeds.push_back(old != feeds_.end() ? std::move(*old) : Feed{wanted, std::vector<std::uint32_t>(heads_.size(), 1)});
  }
  feeds_ = std::move(feeds);
}

// A new pipeline may have other axis names.
void Publisher::use_axes(const pipeline::Rows& rows) {
  const bool same = axes_ && *axes_ == *rows.axes;
  axes_ = rows.axes;
  if (same) return;
  heads_.clear();
  for (const std::string& axis : *axes_) heads_.push_back(std::string(kSampleHead) + row_head(axis));
  for (Feed& feed : feeds_) feed.due.assign(heads_.size(), 1);
  histories_.resize(heads_.size());
}

void Publisher::rows(const pipeline::Rows& rows, bool unwritten) {
  if (!rows.axes) return;  // not from a pipeline: no rows
  if (axes_ != rows.axes) use_axes(rows);
  if (feeds_.empty() && rows.windows.empty()) return;
  std::size_t next = 0;
  for (const pipeline::Rows::Window& window : rows.windows) {
    for (; next < window.samples_before; ++next) sample(rows.samples[next]);
    this->window(window);
    if (!unwritten || disk_late_) release_held();
  }
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
  for (Feed& feed : feeds_) {
    if (feed.wanted.sample_every == 0 || !feed.wanted.has(sample.axis) || --feed.due[sample.axis] > 0) continue;
    feed.due[sample.axis] = feed.wanted.sample_every;
    append_row(feed.text, head, sample.row);
    feed.text += kTail;
    ++feed.lines;
  }
}

void Publisher::window(const pipeline::Rows::Window& window) {
  std::string row;
  append_row(row, row_head((*axes_)[window.axis]), window.row);
  histories_[window.axis].add(row);
  held_.push_back({window.axis, std::string(kWindowHead).append(row).append(kTail)});
}

void Publisher::pass(const Line& line) {
  for (Feed& feed : feeds_) {
    const Subscription& wanted = feed.wanted;
    if (line.axis == kEvent ? !wanted.events : !wanted.windows || !wanted.has(line.axis)) continue;
    feed.text += line.text;
    ++feed.lines;
  }
}

void Publisher::release_held() {
  for (const Line& line : std::exchange(held_, {})) pass(line);
}

void Publisher::release() {
  release_held();
  flush();
}

void Publisher::flush() {
  for (Feed& feed : feeds_) {
    if (feed.lines == 0) continue;
    const auto text = std::make_shared<const std::string>(feed.text);
    for (const auto& client : clients_) {
      if (client->subscription == feed.wanted) client->send(text, feed.lines);
    }
    feed.text.clear();
    feed.lines = 0;
  }
}

void Publisher::event(const Event& event) {
  Line line{kEvent, std::string(kEventHead).append(event.json).append(kTail)};
  const bool about_rows = event.kind == "quality" || event.kind == "implausible";
  if (about_rows && !held_.empty()) return held_.push_back(std::move(line));
  pass(line);
  flush();
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
