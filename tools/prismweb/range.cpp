// SPDX-License-Identifier: MIT
#include "tools/prismweb/range.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/log_page.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

constexpr double kMaxTime_s = 9e9;
constexpr std::int64_t kMaxLogLength_s = 7200, kFar_s = 6 * 3600, kFresh_s = 60;
constexpr std::size_t kMaxEpochs = 4;
constexpr int kMaxPages = 40;  // of up to 256 KiB: covers the range and the interval of stored cursors

// The requested series.
struct View {
  std::int64_t from_s, to_s, step_s;  // limits of the periods' begins
  const char* source;
  /// AxisArchive::building() when the rows were requested.
  std::optional<double> building = std::nullopt;
};

json columns() {
  json names = {"time_s"};
  for (std::size_t i = 0; i < kRangeColumns; ++i) names.push_back(kPeriodColumns[i]);
  return names;
}

json row_of(const PeriodSummary& step, std::int64_t step_s) {
  json row = {step.begin_s + step_s};
  const PeriodValues values = values_of(step);
  for (std::size_t i = 0; i < kRangeColumns; ++i)
    row.push_back(i < kFirstCount ? json(values[i]) : json(static_cast<std::uint32_t>(values[i])));
  return row;
}

std::optional<std::int64_t> first_of(const AxisArchive& axis) {
  const auto stored = axis.store_status() != nullptr ? axis.store_status()->first_s : std::nullopt;
  if (axis.recent().empty()) return stored;
  return std::min(axis.recent().first_s(), stored.value_or(INT64_MAX));
}

std::optional<std::int64_t> last_of(const AxisArchive& axis) {
  if (!axis.recent().empty()) return axis.recent().last_s();
  return axis.store_status() != nullptr ? axis.store_status()->last_s : std::nullopt;
}

std::string result_of(const AxisArchive& axis, const View& view, const std::vector<PeriodSummary>& periods) {
  json rows = json::array();
  for (const PeriodSummary& step : downsample(periods, view.from_s, view.to_s, view.step_s))
    rows.push_back(row_of(step, view.step_s));
  const auto first = first_of(axis), last = last_of(axis);
  auto building = axis.building();  // rows that were read before it was complete are not
  if (building && view.building) building = std::min(*building, *view.building);
  const json result = {{"axis", axis.name()},
                       {"from_s", view.from_s},
                       {"to_s", view.to_s},
                       {"step_s", view.step_s},
                       {"source", view.source},
                       {"columns", columns()},
                       {"rows", std::move(rows)},
                       {"first_s", first ? json(*first + 1) : json()},
                       {"last_s", last ? json(*last + 1) : json()},
                       {"building", building ? json(*building) : json()},
                       {"store_problem", axis.problem().empty() ? json() : json(axis.problem())}};
  return "\"result\":" + json_text(result);
}

// Appends the seconds that the store does not have yet.
std::vector<PeriodSummary> with_newer(const AsyncStore::Periods& stored, const AxisArchive& axis) {
  std::vector<PeriodSummary> periods = stored.steps;
  for (const PeriodSummary& second : axis.recent().all()) {
    if (second.begin_s > stored.last_s.value_or(INT64_MIN)) periods.push_back(second);
  }
  return periods;
}

std::string disk_error(const Error& error) { return error_member(kFailed, error.text()); }

// Responds with minutes or hours of the store and newer seconds from memory.
void answer_periods(AxisArchive& axis, View view, int points, const InstanceProxy::Answer& answer) {
  view.step_s = step_for(static_cast<double>(view.to_s - view.from_s), points, 60);
  view.source = view.step_s >= 3600 ? "hours" : "minutes";
  view.from_s = floor_to(view.from_s, view.step_s);
  const auto take = [self = axis.shared_from_this(), view, answer](const Result<AsyncStore::Periods>& stored) {
    answer(stored ? result_of(*self, view, with_newer(*stored, *self)) : disk_error(stored.error()));
  };
  axis.store_turns().run([self = axis.shared_from_this(), view, take](const TurnQueue::End& end) {
    const auto take_and_end = [take, end](const Result<AsyncStore::Periods>& stored) {
      take(stored);
      end();
    };
    self->store().periods({view.from_s, view.to_s, view.step_s}, take_and_end);
  });
}

// Reads seconds that are not in memory from prismd's log, page by page, from a cursor before them to the first second
// in memory.
struct Fetch : std::enable_shared_from_this<Fetch> {
  Fetch(InstanceProxy& proxy_, std::shared_ptr<AxisArchive> axis_, View view_, int points_,
        InstanceProxy::Answer answer_)
      : proxy(proxy_), axis(std::move(axis_)), view(view_), points(points_), answer(std::move(answer_)) {}

  void begin(const TurnQueue::End& end) {
    answer = [answer = std::move(answer), end](std::string_view member) {
      answer(member);
      end();
    };
    const RecentSeconds& recent = axis->recent();
    if (!recent.empty() && view.from_s < recent.first_s()) memory_s = recent.first_s();
    const auto take_cursors = [self = shared_from_this()](const Result<std::vector<std::string>>& known) {
      if (!known) return self->answer(disk_error(known.error()));
      self->cursors = *known;
      if (self->cursors.empty()) self->cursors.emplace_back("earliest");
      if (self->cursors.size() > kMaxEpochs) self->cursors.resize(kMaxEpochs);
      std::reverse(self->cursors.begin(), self->cursors.end());
      self->next_epoch();
    };
    axis->store().cursors_before(view.from_s, take_cursors);
  }

  // If the clock restarted, a time may occur in several clock epochs: the last epoch with data is returned.
  void next_epoch() {
    if (!found.empty() || cursors.empty()) return done();
    const std::string cursor = std::move(cursors.back());
    cursors.pop_back();
    pages = 0;
    request_page(cursor);
  }

  void request_page(const std::string& cursor) {
    const auto take = [self = shared_from_this()](std::string_view member) { self->take(member); };
    proxy.call("rows", {{"after", cursor}, {"limit", 10000}, {"axis", axis->name()}}, take);
  }

  void take(std::string_view member) {
    const auto page = parse_log_page(member, axis->name());
    if (!page) return answer(error_member(page.error().code, page.error().error.what));
    // Retention deleted the rows; the store still has their minutes.
    const bool is_deleted =
        page->missing > 0 && found.empty() && (page->seconds.empty() || page->seconds.front().begin_s > view.from_s);
    if (is_deleted) return answer_periods(*axis, view, points, answer);
    const std::int64_t end_s = std::min(view.to_s, memory_s);
    for (const PeriodSummary& second : page->seconds) {
      if (second.begin_s >= view.from_s && second.begin_s < end_s) found.push_back(second);
    }
    const bool past = !page->seconds.empty() && page->seconds.back().begin_s >= end_s;
    if (past || !page->more || ++pages >= kMaxPages) return next_epoch();
    request_page(page->after);
  }

  void done() {
    for (const PeriodSummary& second : axis->recent().all()) {
      if (second.begin_s >= memory_s) found.push_back(second);
    }
    answer(result_of(*axis, view, found));
  }

  InstanceProxy& proxy;
  std::shared_ptr<AxisArchive> axis;
  View view;
  int points;
  InstanceProxy::Answer answer;
  std::int64_t memory_s = INT64_MAX;  ///< first second in memory
  std::vector<std::string> cursors;   ///< of the clock epochs not yet read, the next one last
  std::vector<PeriodSummary> found;
  int pages = 0;
};

}  // namespace

Result<RangeQuery> parse_range(const json& params) {
  RangeQuery query;
  const auto wrong = [] {
    return make_error("range",
                      "expected {\"axis\": NAME, \"from_s\": T or \"seconds\": N, \"to_s\": T, \"points\": 2 to 5000}");
  };
  if (params.is_null()) return query;
  if (!params.is_object()) return wrong();
  const auto time = [&](const char* key, std::optional<double>& value) {
    if (!params.contains(key)) return true;
    if (!params[key].is_number() || !(std::fabs(params[key].get<double>()) <= kMaxTime_s)) return false;
    value = params[key].get<double>();
    return true;
  };
  std::optional<double> seconds, points;
  if (!time("from_s", query.from_s) || !time("to_s", query.to_s) || !time("seconds", seconds) ||
      !time("points", points))
    return wrong();
  if (seconds && (query.from_s || !(*seconds >= 1))) return wrong();
  if (points && !(*points >= 2 && *points <= 5000 && *points == std::floor(*points))) return wrong();
  query.seconds = seconds.value_or(query.seconds);
  query.points = static_cast<int>(points.value_or(query.points));
  if (query.from_s && query.to_s && *query.from_s >= *query.to_s) return wrong();
  return query;
}

void answer_range(InstanceProxy& proxy, AxisArchive& axis, const RangeQuery& query,
                  const InstanceProxy::Answer& answer) {
  const std::int64_t last_s = last_of(axis).value_or(0) + 1;
  const double to_s = query.to_s.value_or(std::max(static_cast<double>(last_s), query.from_s.value_or(0)));
  const double from_s = query.from_s.value_or(to_s - query.seconds);
  View view{static_cast<std::int64_t>(std::floor(from_s)), static_cast<std::int64_t>(std::ceil(to_s)), 1, "seconds",
            axis.building()};
  const double length_s = std::max(to_s - from_s, 1.0);
  view.step_s = step_for(length_s, query.points, 1);
  view.from_s = floor_to(view.from_s, view.step_s);  // the first step is complete
  // Times after the last second in memory may be of an earlier clock epoch.
  const RecentSeconds& recent = axis.recent();
  const auto* const status = axis.store_status();
  const bool has_all = proxy.state() != InstanceState::kRunning && !recent.empty() && status != nullptr &&
                       status->first_s == recent.first_s();  // prismd cannot return seconds of the log
  const bool in_memory =
      !recent.empty() && (view.from_s >= recent.first_s() || has_all) && view.from_s <= recent.last_s() + kFresh_s;
  if (status == nullptr || in_memory || !status->first_s) return answer(result_of(axis, view, axis.recent().all()));
  // While the store is built, a view far ahead of it is not read from the log: that may be days of rows.
  const bool is_far = axis.building().value_or(1) < 1 && *status->last_s + kFar_s < view.from_s;
  if (is_far) return answer(result_of(axis, view, axis.recent().all()));
  if (length_s <= kMaxLogLength_s && proxy.state() == InstanceState::kRunning) {
    const auto fetch = std::make_shared<Fetch>(proxy, axis.shared_from_this(), view, query.points, answer);
    return axis.log_turns().run([fetch](const TurnQueue::End& end) { fetch->begin(end); });
  }
  answer_periods(axis, view, query.points, answer);
}

}  // namespace prism::prismweb
