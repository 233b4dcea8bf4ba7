// SPDX-License-Identifier: MIT
#include "tools/prismrelay/log_tailer.hpp"

#include <fmt/format.h>

#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using std::chrono::steady_clock;

constexpr int kForeignCursor = -32002;  // docs/protocol.md
constexpr double kWait_s = 10;
constexpr std::chrono::seconds kDeaf{40};
constexpr std::chrono::seconds kAfterRefusal{5};
constexpr int kLarge = 2000, kSmall = 50;  // rows of a page

}  // namespace

LogTailer::LogTailer(boost::asio::io_context& context, RowTraffic& traffic, LogKey log, std::string axis_asked)
    : traffic_(traffic),
      log_(std::move(log)),
      axis_asked_(std::move(axis_asked)),
      client_(std::make_shared<LineClient>(context)) {}

void LogTailer::open(const std::string& socket, Gone gone) { client_->open(socket, nullptr, std::move(gone)); }

void LogTailer::close() {
  client_->close();
  asking_ = false;
  if (!gathered_) release_slot();
}

void LogTailer::resume(const std::string& cursor) {
  cursor_ = cursor.empty() ? "earliest" : cursor;
  gathered_ = false;
  ask();
}

void LogTailer::ask() {
  if (!traffic_.open || asking_ || gathered_ || !client_->is_open() || cursor_.empty()) return;
  if (steady_clock::now() < retry_at_) return;
  if (lags_ && !large_) {
    if (traffic_.large >= RowTraffic::kLargeMax) return;  // asked again when another one has its rows in the ledger
    large_ = true;
    ++traffic_.large;
  }
  asking_ = true;
  requested_at_ = steady_clock::now();
  json params = {{"after", cursor_},
                 {"limit", lags_ ? kLarge : kSmall},
                 {"wait_s", lags_ ? 0 : kWait_s},
                 {"name", traffic_.follower}};
  if (!axis_asked_.empty()) params["axis"] = axis_asked_;
  client_->ask("rows", params, [weak = weak_from_this()](const json& message) {
    if (const auto self = weak.lock()) self->answer(message);
  });
}

void LogTailer::answer(const json& message) {
  asking_ = false;
  if (!traffic_.open) return release_slot();  // the ledger went meanwhile: it will say where to go on
  if (const auto error = message.find("error"); error != message.end()) return refused(*error);
  const json& page = member(message, "result");
  const json& segments = member(page, "segments");
  const bool nothing = segments.is_array() && segments.empty() && member(page, "missing") == 0;
  if (nothing) {  // the place behind nothing is the place before
    lags_ = flag_member(page, "more");
    if (!lags_) release_slot();
    if (!lags_) traffic_.state->log(log_, [](LogState& own) { own.caught_up = true, own.error.clear(); });
    return ask();
  }
  const auto facts = traffic_.batch->add_page(log_, cursor_, page);
  if (!facts) return fail(facts.error().text());
  next_cursor_ = facts->cursor;
  next_arrival_s_ = facts->arrival_s;
  next_rows_ = facts->rows;
  next_refused_ = facts->refused;
  next_missing_ = facts->missing;
  next_more_ = facts->more;
  next_why_ = facts->why;
  gathered_ = true;
  traffic_.gathered();
}

// A folder that was emptied is another log: it is begun at its beginning, and that one ended is kept.
void LogTailer::refused(const json& error) {
  const std::string why = printable(text_member(error, "message", "refused"));
  if (member(error, "code") == kForeignCursor && cursor_ != "earliest") {
    say(Level::kWarning, fmt::format("{} {}: {}; beginning the log that is there", log_.gyro, log_.axis, why));
    traffic_.batch->add_change_of_log(log_, cursor_);
    traffic_.gathered();
    return resume("earliest");
  }
  fail(why);
}

void LogTailer::fail(const std::string& why) {
  retry_at_ = steady_clock::now() + kAfterRefusal;
  bool is_new = false;
  traffic_.state->log(log_, [&](LogState& own) { is_new = std::exchange(own.error, why) != why; });
  if (is_new) say(Level::kWarning, fmt::format("{} {}: {}", log_.gyro, log_.axis, why));
  release_slot();
}

void LogTailer::committed() {
  if (!std::exchange(gathered_, false)) return;
  cursor_ = next_cursor_;
  lags_ = next_more_;
  const bool none = next_rows_ == 0 && next_refused_ > 0;
  const std::string why = none ? "no line of the log is a row: " + next_why_ : "";
  bool is_new = false;
  traffic_.state->log(log_, [&](LogState& own) {
    is_new = none && own.rows_error.empty();
    if (none || next_rows_ > 0) own.rows_error = why;
    own.rows += next_rows_;
    own.refused += next_refused_;
    own.missing += next_missing_;
    own.caught_up = !lags_;
    own.error.clear();
    if (next_arrival_s_ == 0) return;
    own.arrival_s = next_arrival_s_;
    own.lag_s = host_time_s() - next_arrival_s_;
  });
  if (is_new) say(Level::kWarning, fmt::format("{} {}: {}", log_.gyro, log_.axis, why));
  if (!lags_ || !client_->is_open()) release_slot();
  ask();
}

void LogTailer::dropped() {
  gathered_ = false;
  release_slot();
}

void LogTailer::release_slot() {
  if (!std::exchange(large_, false)) return;
  --traffic_.large;
  traffic_.freed();
}

bool LogTailer::is_unresponsive(steady_clock::time_point now) const { return asking_ && now - requested_at_ > kDeaf; }

}  // namespace prism::prismrelay
