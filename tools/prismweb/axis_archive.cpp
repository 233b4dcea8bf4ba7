// SPDX-License-Identifier: MIT
#include "tools/prismweb/axis_archive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/time_scale.hpp"
#include "tools/prismweb/log_page.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kUpToDate{2000}, kReopen{30000};
constexpr std::chrono::milliseconds kBuilding{5};  // between pages, for other work of the loop

}  // namespace

AxisArchive::AxisArchive(boost::asio::io_context& io, InstanceProxy& proxy, std::string axis,
                         std::unique_ptr<AsyncStore> store)
    : proxy_(proxy), axis_(std::move(axis)), store_(std::move(store)), pause_(io) {}

void AxisArchive::report(const std::string& what) {
  if (std::exchange(store_problem_, what) == what) return;
  fmt::print(stderr, "prismweb: {} {}: {}\n", proxy_.name(), axis_,
             what.empty() ? "minutes and hours are stored again" : what);
}

void AxisArchive::follow() {
  has_log_ = true;
  behind_ = true;
  recent_.forget_now();
  const auto history = [weak = weak_from_this()](std::string_view member) {
    if (const auto self = weak.lock()) self->take_history(member);
  };
  proxy_.call("history", {{"seconds", 3600}, {"axis", axis_}}, history);
  if (!store_ || std::exchange(reading_, true)) return;
  continue_reading();
}

void AxisArchive::continue_reading() {
  if (status_.open) return request_page();
  store_->open([weak = weak_from_this()](const AsyncStore::Status& status) {
    if (const auto self = weak.lock()) self->on_change(status);
  });
}

void AxisArchive::on_change(const AsyncStore::Status& status) {
  status_ = status;
  report(status.problem);
  if (status.cursor.empty()) behind_ = true;
  continue_after(!status.open ? kReopen : behind_ ? kBuilding : kUpToDate);
}

void AxisArchive::take_history(std::string_view member) {
  const client::Response history = client::response_of_member("history", member);
  if (!history) return;
  std::vector<PeriodSummary> since_reset;
  for (const json& window : client::of_axis(*history, axis_)) {
    const auto second = second_of(window);
    if (!second) continue;
    if (!since_reset.empty() && second->begin_s < since_reset.back().begin_s) since_reset.clear();
    since_reset.push_back(*second);
  }
  if (!since_reset.empty()) recent_.put_now(since_reset.back());
  for (const PeriodSummary& second : since_reset) recent_.put(second);
}

void AxisArchive::window(const json& params) {
  if (const auto second = second_of(params)) recent_.put_now(*second);
}

void AxisArchive::request_page() {
  const auto answer = [weak = weak_from_this(), from = status_.cursor](std::string_view member) {
    if (const auto self = weak.lock()) self->store_page(member, from);
  };
  const std::string after = status_.cursor.empty() ? "earliest" : status_.cursor;
  proxy_.call("rows", {{"after", after}, {"limit", 10000}, {"axis", axis_}}, answer);
}

void AxisArchive::continue_after(std::chrono::milliseconds pause) {
  pause_.expires_after(scaled(pause));
  pause_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (!self || error) return;
    self->reading_ = self->has_log_ && self->proxy_.state() == InstanceState::kRunning;
    if (self->reading_) self->continue_reading();  // else follow() restarts it
  });
}

void AxisArchive::store_page(std::string_view member, const std::string& from) {
  auto page = parse_log_page(member, axis_);
  if (!page) return handle_error(page.error());
  for (const PeriodSummary& second : page->seconds) recent_.put(second);
  behind_ = page->more;
  store_->push(std::move(page->seconds), from, page->after, behind_);
}

void AxisArchive::handle_error(const client::RequestError& error) {
  if (error.code == kUnknownCursor) {
    report("log replaced: rebuilding minutes and hours");
    return store_->clear();
  }
  has_log_ = error.code != kNoLog;
  continue_after(kUpToDate);
}

void AxisArchive::finish() {
  if (store_) store_->commit();
}

// Share of the data's time range.
std::optional<double> AxisArchive::building() const {
  if (!store_ || !has_log_ || (!status_.open && !status_.problem.empty())) return std::nullopt;
  if (!behind_) return 1;
  if (!status_.first_s || recent_.empty()) return 0;
  const auto first = static_cast<double>(*status_.first_s);
  const double length_s = static_cast<double>(recent_.last_s()) - first;
  const double done_s = static_cast<double>(*status_.last_s) - first;
  return length_s > 0 ? std::clamp(done_s / length_s, 0.0, 0.999) : 0;
}

}  // namespace prism::prismweb
