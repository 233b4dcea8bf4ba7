// SPDX-License-Identifier: MIT
#include "tools/prismrelay/log_tailer.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "base/time_scale.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using std::chrono::steady_clock;

constexpr double kWait_s = 10;
constexpr std::chrono::seconds kResponseTimeout{40};
constexpr std::chrono::seconds kErrorDelay{5};
constexpr std::chrono::minutes kRefusalsEvery{10};
constexpr int kLargePage = 2000, kSmallPage = 50;  // rows

}  // namespace

LogTailer::LogTailer(boost::asio::io_context& context, RowTraffic& traffic, LogKey log)
    : traffic_(traffic), log_(std::move(log)), client_(std::make_shared<client::AsyncConnection>(context)) {}

void LogTailer::open(const std::string& socket, client::AsyncConnection::OnEnd on_disconnect) {
  client_->open(socket, nullptr, std::move(on_disconnect));
}

void LogTailer::close() {
  client_->close();
  requested_ = false;
  if (!in_batch_) release_slot();
}

void LogTailer::resume(const std::string& cursor) {
  cursor_ = cursor.empty() ? "earliest" : cursor;
  in_batch_ = false;
  ++generation_;
  request_page();
}

void LogTailer::request_page() {
  if (!traffic_.database_up || requested_ || in_batch_ || !client_->is_open() || cursor_.empty()) return;
  if (steady_clock::now() < retry_at_) return;
  if (is_behind_ && !has_slot_) {
    if (traffic_.large >= RowTraffic::kMaxLarge) return;  // retried when another tailer releases its slot
    has_slot_ = true;
    ++traffic_.large;
  }
  requested_ = true;
  requested_at_ = steady_clock::now();
  json params = {{"after", cursor_},
                 {"limit", is_behind_ && !many_refusals_ ? kLargePage : kSmallPage},
                 {"wait_s", is_behind_ ? 0 : kWait_s},
                 {"axis", log_.axis}};
  client_->call("rows", json_text(params),
                [weak = weak_from_this(), generation = generation_](std::string_view member) {
                  if (const auto self = weak.lock()) self->on_response(generation, member);
                });
}

void LogTailer::check_retention() {
  if (traffic_.database_up || requested_ || cursor_.empty() || !client_->is_open()) return;
  requested_ = true;
  requested_at_ = steady_clock::now();
  client_->call("rows", json_text(json{{"after", cursor_}, {"limit", 1}, {"axis", log_.axis}}),
                [weak = weak_from_this()](std::string_view member) {
                  const auto self = weak.lock();
                  if (!self) return;
                  self->requested_ = false;
                  if (const auto response = client::response_of_member("rows", member))
                    self->watch_retention(client::of_axis(*response, self->log_.axis));
                  self->request_page();
                });
}

void LogTailer::watch_retention(const json& page) {
  const std::uint64_t behind = count_member(page, "behind"), kept = count_member(page, "kept");
  const bool late = count_member(page, "deleted") > 0 && 2 * behind > kept;
  if (std::exchange(is_late_, late) == late) return;
  if (!late)
    return log_line(Level::kInfo,
                    fmt::format("{} {}: less than half of the kept rows behind again", log_.gyro, log_.axis));
  log_line(Level::kWarning,
           fmt::format("{} {}: {} behind, more than half of those that prismd keeps (log/keep_mib, log/keep_days): it "
                       "will delete rows that the database does not have",
                       log_.gyro, log_.axis, counted(behind, "row")));
}

void LogTailer::on_response(std::uint64_t generation, std::string_view response_text) {
  requested_ = false;
  if (!traffic_.database_up) return release_slot();  // discarded: resume() gives the position
  if (generation != generation_) {                   // not after cursor_, which resume() may have set back
    release_slot();
    return request_page();
  }
  const auto response = client::response_of_member("rows", response_text);
  if (!response) return on_error(response.error());
  const json& page = client::of_axis(*response, log_.axis);
  const json& segments = member(page, "segments");
  const bool empty = segments.is_array() && segments.empty() && member(page, "missing") == 0;
  if (empty) {  // the cursor is unchanged
    is_behind_ = flag_member(page, "more");
    if (!is_behind_) release_slot();
    if (!is_behind_)
      traffic_.state->change_log(log_, [](LogState& state) { state.caught_up = true, state.error.clear(); });
    return request_page();
  }
  watch_retention(page);
  const auto added = traffic_.batch->add_page(log_, cursor_, page);
  if (!added) return fail(added.error().text());
  page_ = *added;
  in_batch_ = true;
  traffic_.batch_extended();
}

// If the log directory was emptied, prismd has a new log: records the change and reads the new log from its start.
void LogTailer::on_error(const client::RequestError& error) {
  const std::string reason = printable(error.error.what);
  if (error.code == config::kUnknownCursor && cursor_ != "earliest") {
    log_line(Level::kWarning,
             fmt::format("{} {}: {}; reading the current log from its start", log_.gyro, log_.axis, reason));
    traffic_.batch->add_change_of_log(log_, cursor_);
    traffic_.batch_extended();
    return resume("earliest");
  }
  fail(reason);
}

void LogTailer::fail(const std::string& reason) {
  retry_at_ = steady_clock::now() + scaled(kErrorDelay);
  bool is_new = false;
  traffic_.state->change_log(log_, [&](LogState& state) { is_new = std::exchange(state.error, reason) != reason; });
  if (is_new) log_line(Level::kWarning, fmt::format("{} {}: {}", log_.gyro, log_.axis, reason));
  release_slot();
}

void LogTailer::committed(const Refusal& refusal) {
  if (!std::exchange(in_batch_, false)) return;
  const bool was_large = !std::exchange(many_refusals_, refusal.too_many || (many_refusals_ && refusal.rows > 0));
  if (refusal.too_many && was_large) return request_page();  // the same rows, in smaller pages
  if (!refusal.first.empty()) log_refusal(refusal);
  if (!refusal.error.empty()) return fail("PostgreSQL refused the cursor: " + refusal.error);
  if (refusal.rows > 0) {
    page_.rows -= refusal.rows;
    page_.invalid += refusal.rows;
    page_.error = refusal.first;
  }
  cursor_ = page_.cursor;
  is_behind_ = page_.more;
  const bool all_invalid = page_.rows == 0 && page_.invalid > 0;
  const std::string error = all_invalid ? "no valid row; last error: " + page_.error : "";
  bool is_new = false;
  traffic_.state->change_log(log_, [&](LogState& state) {
    is_new = all_invalid && state.rows_error.empty();
    if (all_invalid || page_.rows > 0) state.rows_error = error;
    state.rows += page_.rows;
    state.invalid += page_.invalid;
    state.missing += page_.missing;
    state.caught_up = !is_behind_;
    state.error.clear();
    if (page_.arrival_s == 0) return;
    state.arrival_s = page_.arrival_s;
    state.lag_s = host_time_s() - page_.arrival_s;
  });
  if (is_new) log_line(Level::kWarning, fmt::format("{} {}: {}", log_.gyro, log_.axis, error));
  if (!is_behind_ || !client_->is_open()) release_slot();
  request_page();
}

// A log may have one such row each second: logs the first, then at most one each kRefusalsEvery with their number.
void LogTailer::log_refusal(const Refusal& refusal) {
  const auto now = steady_clock::now();
  const bool is_first = refusal_logged_at_ == steady_clock::time_point();
  if (!is_first && now - refusal_logged_at_ < kRefusalsEvery) {
    unlogged_refusals_ += refusal.rows;
    return;
  }
  refusal_logged_at_ = now;
  const std::size_t further = std::exchange(unlogged_refusals_, 0) + refusal.rows - (refusal.rows > 0 ? 1 : 0);
  log_line(Level::kWarning,
           fmt::format("{} {}: PostgreSQL refused {}{}; see prism.refused_rows", log_.gyro, log_.axis, refusal.first,
                       further > 0 ? fmt::format(", and {} more", counted(further, "row")) : ""));
}

void LogTailer::discarded() {
  in_batch_ = false;
  release_slot();
}

void LogTailer::release_slot() {
  if (!std::exchange(has_slot_, false)) return;
  --traffic_.large;
  traffic_.slot_released();
}

bool LogTailer::is_unresponsive(steady_clock::time_point now) const {
  return requested_ && now - requested_at_ > kResponseTimeout;
}

}  // namespace prism::prismrelay
