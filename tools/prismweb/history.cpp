// SPDX-License-Identifier: MIT
#include "tools/prismweb/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cmath>
#include <exception>
#include <set>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/time_scale.hpp"
#include "compensation/compensated_text.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using client::error_member;
using client::kUse;
using nlohmann::json;

constexpr std::chrono::milliseconds kUpToDate{4000}, kNotConnected{500}, kReopen{30000};
constexpr int kPagesPerCommit = 20;  // while the store is filled
constexpr double kMaxTime_s = 9e9;
constexpr std::int64_t kMaxLogLength_s = 7200, kFar_s = 6 * 3600, kFresh_s = 60;
constexpr std::size_t kMaxRuns = 4;  // of the gyro's clock
constexpr int kMaxPages = 40;        // of up to 256 KiB: covers the range and the interval of stored cursors

// The columns and the rows of a response.
std::pair<json, json> table_of(std::vector<Period> steps, std::int64_t step_s) {
  std::set<std::string> sensors;
  for (const Period& step : steps)
    for (const auto& [name, range] : step.sensors) sensors.insert(name);
  json columns = {"time_s"}, rows = json::array();
  for (std::size_t i = 0; i < kRateKnown; ++i)
    columns.push_back(i == kRateSum ? "rate_mean" : i == kCorrectedSum ? "corrected_mean" : kColumnNames[i]);
  for (const std::string& name : sensors)
    for (const char* const part : {"_min", "_max"}) columns.push_back("sensors." + name + part);
  for (Period& step : steps) {
    step.values[kRateSum] /= step.values[kRateKnown];
    step.values[kCorrectedSum] /= step.values[kCorrectedKnown];
    json row = {step.begin_s + step_s};
    for (std::size_t i = 0; i < kRateKnown; ++i)
      row.push_back(i < kSamples ? json(step.values[i]) : json(static_cast<std::uint32_t>(step.values[i])));
    for (const std::string& name : sensors) {
      const auto found = step.sensors.find(name);
      for (const std::size_t part : {0U, 1U})
        row.push_back(found == step.sensors.end() ? json() : json(found->second[part]));
    }
    rows.push_back(std::move(row));
  }
  return {std::move(columns), std::move(rows)};
}

}  // namespace

void RecentSeconds::put(const Period& second) {
  if (now_s_ && second.begin_s > *now_s_) return;
  seconds_.insert_or_assign(second.begin_s, second);
  seconds_.erase(seconds_.begin(), seconds_.upper_bound(last_s() - kLength_s));
}

void RecentSeconds::put_now(const Period& second) {
  if (!empty() && second.begin_s < last_s() - kClockReset_s) seconds_.clear();
  now_s_ = second.begin_s;
  put(second);
}

std::vector<Period> RecentSeconds::after(std::int64_t begin_s) const {
  std::vector<Period> found;
  for (auto at = seconds_.upper_bound(begin_s); at != seconds_.end(); ++at) found.push_back(at->second);
  return found;
}

asio::awaitable<std::shared_ptr<void>> Turns::take() {
  while (running_ >= max_) co_await next_.async_wait(kUse);
  ++running_;
  const auto end = [this](void*) {
    --running_;
    next_.cancel_one();
  };
  co_return std::shared_ptr<void>(nullptr, end);
}

/// A page of prismd's `rows`.
struct History::Page {
  std::string from, after;      ///< cursors before the first and after the last row
  std::vector<Period> seconds;  ///< in log order
  bool more = false;
  std::uint64_t missing = 0;  ///< deleted rows between the cursor and the first row
  double fraction = 1;        ///< of the log's rows, up to this page
};

/// The requested series.
struct History::View {
  std::int64_t from_s, to_s, step_s;  ///< limits of the periods' begins
  int points;
  const char* source;
  std::optional<double> building;  ///< before the rows are read
};

History::History(asio::io_context& io, DiskThread& disk, client::Client& log, std::string axis, std::string folder)
    : io_(io),
      disk_(disk),
      log_(log),
      axis_(std::move(axis)),
      store_(folder.empty() ? nullptr : std::make_shared<PeriodStore>(std::move(folder))),
      log_turns_(io, 2),
      store_turns_(io, 2) {}

// Runs `work` on the disk's thread. A query fails if the disk does not respond in time; the status is taken also later.
template <class T>
asio::awaitable<Result<T>> History::on_disk(std::function<Result<T>(PeriodStore&)> work, bool is_query) {
  struct Pending {
    asio::steady_timer done;
    std::optional<Result<T>> result;
  };
  auto timed_out = make_error("", fmt::format("the disk has not answered for {} s", kDiskTimeout.count()));
  if (is_query && disk_.busy_for() >= kDiskTimeout) co_return timed_out;
  const std::shared_ptr<Pending> pending(new Pending{asio::steady_timer(io_), std::nullopt});
  pending->done.expires_after(is_query ? kDiskTimeout : std::chrono::hours(24 * 365));
  auto task = [pending, weak = weak_from_this(), store = store_, &io = io_, work = std::move(work)] {
    Result<T> result;
    try {
      result = work(*store);
    } catch (const std::exception& error) {
      result = make_error("", error.what());  // out of memory
    }
    asio::post(io, [pending, weak, status = store->status(), result = std::move(result)] {
      if (const auto self = weak.lock()) self->take_status(status);
      pending->result = result;
      pending->done.cancel();
    });
  };
  disk_.post(0, std::move(task));
  co_await pending->done.async_wait(kUse);
  if (!pending->result) co_return timed_out;
  co_return std::move(*pending->result);
}

// Reports a problem once, not at each retry.
void History::take_status(const PeriodStore::Status& status) {
  if (status.problem != status_.problem)
    fmt::print(stderr, "prismweb: {} {}: {}\n", log_.name(), axis_,
               status.problem.empty() ? "minutes and hours are stored again" : status.problem);
  status_ = status;
  if (!status.cursor.empty()) return;
  is_behind_ = true;
  fraction_ = 0;
}

asio::awaitable<void> History::follow() {
  asio::steady_timer pause(io_);
  while (store_) {
    const auto time = co_await read_page();
    pause.expires_after(scaled(time));
    co_await pause.async_wait(kUse);
  }
}

// Returns the pause until the next page. One page at a time, until the store has it, so that a blocked disk does not
// fill the memory.
asio::awaitable<std::chrono::milliseconds> History::read_page() {
  if (log_.state() != client::State::kConnected) co_return kNotConnected;
  std::function<Result<PeriodStore::Status>(PeriodStore&)> work = [](PeriodStore& store) { return store.open(); };
  std::string after;
  if (status_.is_open) {
    auto page = co_await page_after(status_.cursor);
    has_log_ = page || page.error().code != config::kNoLog;
    if (!page && page.error().code != config::kUnknownCursor) co_return kUpToDate;
    if (page) {
      for (const Period& second : page->seconds) recent_.put(second);
      is_behind_ = page->more;
      fraction_ = page->fraction;
      after = page->after;
      uncommitted_pages_ = is_behind_ ? (uncommitted_pages_ + 1) % kPagesPerCommit : 0;
      work = [page = std::move(*page), commit = uncommitted_pages_ == 0](PeriodStore& store) {
        return store.add(page.from, page.seconds, page.after, commit);
      };
    } else {
      fmt::print(stderr, "prismweb: {} {}: log replaced: filling minutes and hours again\n", log_.name(), axis_);
      work = [](PeriodStore& store) { return store.clear(); };
    }
  }
  co_await on_disk<PeriodStore::Status>(std::move(work), false);
  if (!status_.is_open) co_return kReopen;
  co_return is_behind_ && (after.empty() || status_.cursor == after) ? std::chrono::milliseconds(0) : kUpToDate;
}

asio::awaitable<tl::expected<History::Page, client::RequestError>> History::page_after(std::string cursor) {
  const json params = {{"after", cursor.empty() ? "earliest" : cursor}, {"limit", 10000}, {"axis", axis_}};
  const client::Response response = co_await log_.ask("rows", params);
  if (!response) co_return tl::unexpected(response.error());
  Page page;
  page.from = std::move(cursor);
  try {
    const json& result = client::of_axis(*response, axis_);
    for (const json& segment : result.at("segments")) {
      const std::string names = "# sensors: " + text_member(member(segment, "metadata"), "sensors") + "\n";
      const auto sensors = std::make_shared<const std::vector<SensorName>>(compensation::sensors_in(names));
      const auto& columns = segment.at("columns").get_ref<const std::string&>();
      const auto layout = compensation::CsvLayout::parse(columns, "rows", sensors);
      if (!layout) continue;
      for (const json& line : segment.at("rows")) {
        const auto row = compensation::parse_csv(line.get_ref<const std::string&>(), "rows", *layout);
        if (row) page.seconds.push_back(second_of(*row));
      }
    }
    page.after = result.at("after");
    page.more = result.at("more");
    page.missing = count_member(result, "missing");
    const double kept = number_member(result, "kept"), behind = number_member(result, "behind");
    if (page.more && kept > 0) page.fraction = std::clamp(1 - behind / kept, 0.0, 0.999);
  } catch (const json::exception&) {
    co_return tl::unexpected(
        client::RequestError{config::kFailed, {"prismd", "found an invalid response to \"rows\""}});
  }
  co_return page;
}

asio::awaitable<void> History::load() {
  const auto self = shared_from_this();
  recent_.forget_now();
  const json params = {{"seconds", 3600}, {"axis", axis_}};
  const client::Response history = co_await log_.ask("history", params);
  if (!history) co_return;
  std::vector<Period> since_reset;
  for (const json& window : client::of_axis(*history, axis_)) {
    const auto second = second_of(window);
    if (!second) continue;
    if (!since_reset.empty() && second->begin_s < since_reset.back().begin_s) since_reset.clear();
    since_reset.push_back(*second);
  }
  if (!since_reset.empty()) recent_.put_now(since_reset.back());
  for (const Period& second : since_reset) recent_.put(second);
}

void History::window(const json& params) {
  if (const auto second = second_of(params)) recent_.put_now(*second);
}

std::optional<double> History::building() const {
  if (!store_ || !has_log_ || (!status_.is_open && !status_.problem.empty())) return std::nullopt;
  return is_behind_ ? fraction_ : 1;
}

// Returns nullopt if a param of `range` is invalid.
std::optional<History::View> History::view_of(const json& params) const {
  if (!params.is_null() && !params.is_object()) return std::nullopt;
  bool is_valid = true;
  const auto number = [&](const char* key, double min, double max, double otherwise) {
    const json& value = member(params, key);
    if (value.is_null()) return otherwise;
    is_valid = is_valid && value.is_number() && value >= min && value <= max;
    return is_valid ? value.get<double>() : otherwise;
  };
  const auto has = [&](const char* key) { return !member(params, key).is_null(); };
  const auto stored_s = is_stored() ? status_.last_s : std::nullopt;
  const auto last_s = static_cast<double>((recent_.empty() ? stored_s.value_or(0) : recent_.last_s()) + 1);
  const double to_s =
      number("to_s", -kMaxTime_s, kMaxTime_s, std::max(last_s, number("from_s", -kMaxTime_s, kMaxTime_s, 0)));
  const double from_s = number("from_s", -kMaxTime_s, kMaxTime_s, to_s - number("seconds", 1, kMaxTime_s, 3600));
  const double points = number("points", 2, 5000, 1000);
  if (!is_valid || points != std::floor(points) || (has("from_s") && has("seconds")) || (has("to_s") && from_s >= to_s))
    return std::nullopt;
  const std::int64_t step_s = step_for(std::max(to_s - from_s, 1.0), static_cast<int>(points), 1);
  const auto start_s = floor_to(static_cast<std::int64_t>(std::floor(from_s)), step_s);  // the first step is complete
  return View{start_s,   static_cast<std::int64_t>(std::ceil(to_s)), step_s, static_cast<int>(points), "seconds",
              building()};
}

std::string History::result_of(const View& view, const std::vector<Period>& periods) const {
  auto [columns, rows] = table_of(downsample(periods, view.from_s, view.to_s, view.step_s), view.step_s);
  json first, last;
  if (is_stored() && status_.first_s) {
    first = *status_.first_s + 1;
    last = *status_.last_s + 1;
  }
  if (!recent_.empty()) {
    first = first.is_null() ? recent_.first_s() + 1 : std::min(recent_.first_s() + 1, first.get<std::int64_t>());
    last = recent_.last_s() + 1;
  }
  const json result = {{"axis", axis_},
                       {"from_s", view.from_s},
                       {"to_s", view.to_s},
                       {"step_s", view.step_s},
                       {"source", view.source},
                       {"columns", std::move(columns)},
                       {"rows", std::move(rows)},
                       {"first_s", first},
                       {"last_s", last},
                       {"building", view.building ? json(*view.building) : json()},
                       {"store_problem", status_.problem.empty() ? json() : json(status_.problem)}};
  return "\"result\":" + json_text(result);
}

asio::awaitable<std::string> History::range(json params) {
  const auto self = shared_from_this();
  std::optional<View> wanted = view_of(params);
  if (!wanted)
    co_return error_member(config::kInvalidParams,
                           "range: expected {\"axis\": NAME, \"from_s\": T or \"seconds\": N, \"to_s\": T, "
                           "\"points\": 2 to 5000}");
  View view = *wanted;
  // Times after the last second in memory may be of an earlier run of the gyro's clock.
  const bool is_connected = log_.state() == client::State::kConnected;
  const bool has_all = !is_connected && !recent_.empty() && status_.first_s == recent_.first_s();
  const bool in_memory =
      !recent_.empty() && (view.from_s >= recent_.first_s() || has_all) && view.from_s <= recent_.last_s() + kFresh_s;
  if (!is_stored() || !status_.first_s || in_memory) co_return result_of(view, recent_.after(INT64_MIN));
  if (is_connected && view.to_s - view.from_s <= kMaxLogLength_s) {
    const auto turn = co_await log_turns_.take();
    const Result<std::vector<Period>> seconds = co_await seconds_of_log(view);
    if (!seconds) co_return error_member(config::kFailed, seconds.error().text());
    if (!seconds->empty()) co_return result_of(view, *seconds);
  }
  const auto turn = co_await store_turns_.take();
  view.step_s = step_for(static_cast<double>(view.to_s - view.from_s), view.points, 60);
  view.source = view.step_s >= 3600 ? "hours" : "minutes";
  view.from_s = floor_to(view.from_s, view.step_s);
  std::function<Result<PeriodStore::Periods>(PeriodStore&)> work = [view](PeriodStore& store) {
    return store.periods(view.from_s, view.to_s, view.step_s);
  };
  Result<PeriodStore::Periods> stored = co_await on_disk<PeriodStore::Periods>(std::move(work), true);
  if (!stored) co_return error_member(config::kFailed, stored.error().text());
  // After a reset of the clock, the store may have none of the seconds in memory yet.
  const bool is_reset = !recent_.empty() && stored->last_s > recent_.last_s() + RecentSeconds::kClockReset_s;
  for (const Period& second : recent_.after(is_reset ? INT64_MIN : stored->last_s.value_or(INT64_MIN)))
    stored->steps.push_back(second);
  co_return result_of(view, stored->steps);
}

// Reads the log page by page, from a cursor before the view to the first second in memory. If the gyro's clock was
// reset, a time may occur in several of its runs: returns the seconds of the last run that has some. Returns nothing if
// retention deleted the seconds, or if the store does not know where they are.
asio::awaitable<Result<std::vector<Period>>> History::seconds_of_log(View view) {
  std::function<Result<PeriodStore::Cursors>(PeriodStore&)> work = [view](PeriodStore& store) {
    return store.cursors_before(view.from_s);
  };
  Result<PeriodStore::Cursors> cursors = co_await on_disk<PeriodStore::Cursors>(std::move(work), true);
  if (!cursors) co_return tl::unexpected<Error>(cursors.error());
  if (cursors->empty() && status_.first_s) cursors->emplace_back(*status_.first_s, "");
  if (cursors->size() > kMaxRuns) cursors->resize(kMaxRuns);
  std::int64_t memory_s = INT64_MAX;
  if (!recent_.empty() && view.from_s < recent_.first_s()) memory_s = recent_.first_s();
  const std::int64_t end_s = std::min(view.to_s, memory_s);
  std::vector<Period> found;
  for (std::size_t i = 0; i < cursors->size() && found.empty(); ++i) {
    auto [begin_s, cursor] = (*cursors)[i];
    if (is_behind_ && begin_s + kFar_s < view.from_s) continue;  // that may be days of rows
    bool is_past = false;
    for (int count = 0; count < kMaxPages && !is_past; ++count) {
      const auto page = co_await page_after(cursor);
      if (!page) co_return tl::unexpected<Error>(page.error().error);
      const bool begins_later = page->seconds.empty() || page->seconds.front().begin_s > view.from_s;
      if (page->missing > 0 && found.empty() && begins_later) co_return found;
      for (const Period& second : page->seconds) {
        if (second.begin_s >= view.from_s && second.begin_s < end_s) found.push_back(second);
      }
      is_past = !page->more || (!page->seconds.empty() && page->seconds.back().begin_s >= end_s);
      cursor = page->after;
    }
  }
  const std::vector<Period> newer = recent_.after(memory_s - 1);
  found.insert(found.end(), newer.begin(), newer.end());
  co_return found;
}

}  // namespace prism::prismweb
