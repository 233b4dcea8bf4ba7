// SPDX-License-Identifier: MIT
#include "tools/prismrelay/row_follower.hpp"

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

RowFollower::RowFollower(boost::asio::io_context& context, RowTraffic& traffic, LogKey log, std::string axis_asked)
    : traffic_(traffic),
      log_(std::move(log)),
      axis_asked_(std::move(axis_asked)),
      client_(std::make_shared<LineClient>(context)) {}

void RowFollower::open(const std::string& socket, Gone gone) { client_->open(socket, nullptr, std::move(gone)); }

void RowFollower::close() {
  client_->close();
  asking_ = false;
  if (!gathered_) give_back();
}

void RowFollower::go_on(const std::string& cursor) {
  cursor_ = cursor.empty() ? "earliest" : cursor;
  gathered_ = false;
  ask();
}

void RowFollower::ask() {
  if (!traffic_.open || asking_ || gathered_ || !client_->is_open() || cursor_.empty()) return;
  if (steady_clock::now() < ask_again_at_) return;
  if (lags_ && !large_) {
    if (traffic_.large >= RowTraffic::kMostLarge) return;  // asked again when another one has its rows in the ledger
    large_ = true;
    ++traffic_.large;
  }
  asking_ = true;
  asked_at_ = steady_clock::now();
  json params = {{"after", cursor_},
                 {"limit", lags_ ? kLarge : kSmall},
                 {"wait_s", lags_ ? 0 : kWait_s},
                 {"name", traffic_.follower}};
  if (!axis_asked_.empty()) params["axis"] = axis_asked_;
  client_->ask("rows", params, [weak = weak_from_this()](const json& message) {
    if (const auto self = weak.lock()) self->answer(message);
  });
}

void RowFollower::answer(const json& message) {
  asking_ = false;
  if (!traffic_.open) return give_back();  // the ledger went meanwhile: it will say where to go on
  if (const auto error = message.find("error"); error != message.end()) return refused(*error);
  const json& page = member(message, "result");
  const json& segments = member(page, "segments");
  const bool nothing = segments.is_array() && segments.empty() && member(page, "missing") == 0;
  if (nothing) {  // the place behind nothing is the place before
    lags_ = flag_member(page, "more");
    if (!lags_) give_back();
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
void RowFollower::refused(const json& error) {
  const std::string why = printable(text_member(error, "message", "refused"));
  if (member(error, "code") == kForeignCursor && cursor_ != "earliest") {
    say(Level::kWarning, fmt::format("{} {}: {}; beginning the log that is there", log_.gyro, log_.axis, why));
    traffic_.batch->add_change_of_log(log_, cursor_);
    traffic_.gathered();
    return go_on("earliest");
  }
  fail(why);
}

void RowFollower::fail(const std::string& why) {
  ask_again_at_ = steady_clock::now() + kAfterRefusal;
  bool is_new = false;
  traffic_.state->log(log_, [&](LogState& own) { is_new = std::exchange(own.error, why) != why; });
  if (is_new) say(Level::kWarning, fmt::format("{} {}: {}", log_.gyro, log_.axis, why));
  give_back();
}

void RowFollower::committed() {
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
  if (!lags_ || !client_->is_open()) give_back();
  ask();
}

void RowFollower::dropped() {
  gathered_ = false;
  give_back();
}

void RowFollower::give_back() {
  if (!std::exchange(large_, false)) return;
  --traffic_.large;
  traffic_.freed();
}

bool RowFollower::deaf(steady_clock::time_point now) const { return asking_ && now - asked_at_ > kDeaf; }

}  // namespace prism::prismrelay
