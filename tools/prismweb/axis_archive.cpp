// SPDX-License-Identifier: MIT
#include "tools/prismweb/axis_archive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "tools/prismweb/log_page.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds kUpToDate{2};
constexpr std::chrono::milliseconds kBuilding{5};  // the others have their turn between two pages
constexpr int kPagesACommit = 20;

}  // namespace

AxisArchive::AxisArchive(boost::asio::io_context& io, Hub& hub, std::string axis, const std::string& folder)
    : hub_(hub), axis_(std::move(axis)), pause_(io) {
  if (folder.empty()) return;
  auto store = Store::open(folder);
  if (!store) {
    say(store.error().text());
    return;
  }
  cursor_ = store->cursor();
  store_ = std::make_unique<Store>(std::move(*store));
}

void AxisArchive::say(const std::string& what) {
  if (std::exchange(said_, what) != what) fmt::print(stderr, "prismweb: {} {}: {}\n", hub_.name(), axis_, what);
}

void AxisArchive::follow() {
  has_log_ = true;
  behind_ = true;
  const auto history = [weak = weak_from_this()](std::string_view member) {
    if (const auto self = weak.lock()) self->take_history(member);
  };
  hub_.ask("history", {{"seconds", 3600}, {"axis", axis_}}, history);
  if (store_ && !asking_) ask();
}

void AxisArchive::take_history(std::string_view member) {
  const json answer = json::parse("{" + std::string(member) + "}", nullptr, false);
  if (!answer.is_object() || !answer.contains("result")) return;
  for (const json& window : answer["result"]) {
    if (const auto second = second_of(window)) recent_.put(*second);
  }
}

void AxisArchive::window(const json& params) {
  if (const auto second = second_of(params)) recent_.put_now(*second);
}

void AxisArchive::ask() {
  asking_ = true;
  const auto answer = [weak = weak_from_this()](std::string_view member) {
    if (const auto self = weak.lock()) self->take(member);
  };
  hub_.ask("rows", {{"after", cursor_.empty() ? "earliest" : cursor_}, {"limit", 10000}, {"axis", axis_}}, answer);
}

void AxisArchive::take(std::string_view member) {
  asking_ = false;
  take_page(member);
  if (hub_.state() != HubState::kRunning || !has_log_) return;  // follow() begins again
  pause_.expires_after(behind_ ? std::chrono::milliseconds(kBuilding) : std::chrono::milliseconds(kUpToDate));
  pause_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (self && !error && !self->asking_ && self->hub_.state() == HubState::kRunning) self->ask();
  });
}

void AxisArchive::take_page(std::string_view member) {
  const Result<LogPage> page = parse_log_page(member);
  if (!page) {
    behind_ = false;
    if (page.error().where == std::to_string(kForeignCursor)) {
      say("the log is another one: minutes and hours begin anew");
      if (const auto cleared = store_->clear(); !cleared) say(cleared.error().text());
      cursor_.clear();
    } else if (page.error().where == "-32000") {
      has_log_ = page.error().what.find("no log is written") == std::string::npos;
    }
    return;
  }
  for (const Extremes& second : page->seconds) {
    store_->push(second);
    recent_.put(second);
  }
  cursor_ = page->after;
  behind_ = page->more;
  const bool due =
      behind_ ? ++uncommitted_pages_ >= kPagesACommit : store_->has_ended_minute() || uncommitted_pages_ > 0;
  if (!due) return;
  uncommitted_pages_ = 0;
  const auto kept = store_->commit(cursor_);
  say(kept ? "" : kept.error().text());
}

void AxisArchive::finish() {
  if (store_ && !cursor_.empty() && cursor_ != store_->cursor()) (void)store_->commit(cursor_);
}

// By the time that the data reach.
std::optional<double> AxisArchive::building() const {
  if (store() == nullptr) return std::nullopt;
  if (!behind_) return 1;
  if (!store_->first_second() || recent_.empty()) return 0;
  const auto first = static_cast<double>(*store_->first_second());
  const double length_s = static_cast<double>(recent_.last_s()) - first;
  const double done_s = static_cast<double>(*store_->last_second()) - first;
  return length_s > 0 ? std::clamp(done_s / length_s, 0.0, 0.999) : 0;
}

}  // namespace prism::prismweb
