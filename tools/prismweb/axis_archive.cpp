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

constexpr std::chrono::milliseconds kUpToDate{2000}, kReopen{30000};
constexpr std::chrono::milliseconds kBuilding{5};  // the others have their turn between two pages

}  // namespace

AxisArchive::AxisArchive(boost::asio::io_context& io, InstanceProxy& proxy, std::string axis,
                         std::unique_ptr<AsyncStore> store)
    : proxy_(proxy), axis_(std::move(axis)), store_(std::move(store)), pause_(io) {}

void AxisArchive::say(const std::string& what) {
  if (std::exchange(said_, what) == what) return;
  fmt::print(stderr, "prismweb: {} {}: {}\n", proxy_.name(), axis_,
             what.empty() ? "minutes and hours are kept again" : what);
}

void AxisArchive::follow() {
  has_log_ = true;
  behind_ = true;
  const auto history = [weak = weak_from_this()](std::string_view member) {
    if (const auto self = weak.lock()) self->take_history(member);
  };
  proxy_.ask("history", {{"seconds", 3600}, {"axis", axis_}}, history);
  if (!store_ || std::exchange(asking_, true)) return;
  go_on();
}

void AxisArchive::go_on() {
  if (known_.open) return ask();
  store_->open([weak = weak_from_this()](const AsyncStore::Known& known) {
    if (const auto self = weak.lock()) self->on_change(known);
  });
}

void AxisArchive::on_change(const AsyncStore::Known& known) {
  known_ = known;
  say(known.trouble);
  if (known.cursor.empty()) behind_ = true;
  rest(!known.open ? kReopen : behind_ ? kBuilding : kUpToDate);
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
  const auto answer = [weak = weak_from_this(), from = known_.cursor](std::string_view member) {
    if (const auto self = weak.lock()) self->take(member, from);
  };
  const std::string after = known_.cursor.empty() ? "earliest" : known_.cursor;
  proxy_.ask("rows", {{"after", after}, {"limit", 10000}, {"axis", axis_}}, answer);
}

void AxisArchive::rest(std::chrono::milliseconds pause) {
  pause_.expires_after(pause);
  pause_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (!self || error) return;
    self->asking_ = self->has_log_ && self->proxy_.state() == InstanceState::kRunning;
    if (self->asking_) self->go_on();  // else follow() begins again
  });
}

void AxisArchive::take(std::string_view member, const std::string& from) {
  Result<LogPage> page = parse_log_page(member);
  if (!page) return take(page.error());
  for (const PeriodSummary& second : page->seconds) recent_.put(second);
  behind_ = page->more;
  store_->take(std::move(page->seconds), from, page->after, behind_);
}

void AxisArchive::take(const Error& refused) {
  if (refused.where == std::to_string(kForeignCursor)) {
    say("the log is another one: minutes and hours begin anew");
    return store_->clear();
  }
  if (refused.where == "-32000") has_log_ = refused.what.find("no log is written") == std::string::npos;
  rest(kUpToDate);
}

void AxisArchive::finish() {
  if (store_) store_->keep();
}

// By the time that the data reach.
std::optional<double> AxisArchive::building() const {
  if (!store_ || !has_log_ || (!known_.open && !known_.trouble.empty())) return std::nullopt;
  if (!behind_) return 1;
  if (!known_.first_s || recent_.empty()) return 0;
  const auto first = static_cast<double>(*known_.first_s);
  const double length_s = static_cast<double>(recent_.last_s()) - first;
  const double done_s = static_cast<double>(*known_.last_s) - first;
  return length_s > 0 ? std::clamp(done_s / length_s, 0.0, 0.999) : 0;
}

}  // namespace prism::prismweb
