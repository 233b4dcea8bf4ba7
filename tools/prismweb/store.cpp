// SPDX-License-Identifier: MIT
#include "tools/prismweb/store.hpp"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

constexpr std::int64_t kBetweenPlaces_s = 3 * 3600;

json period_json(const std::optional<Extremes>& period) {
  if (!period) return nullptr;
  json means = json::array();
  for (const KnownMean& mean : period->mean) means.push_back({mean.sum, mean.known});
  return {{"begin_s", period->begin_s},   {"least", period->least},
          {"greatest", period->greatest}, {"samples", period->samples},
          {"missing", period->missing},   {"seconds", period->seconds},
          {"good", period->good},         {"means", means}};
}

std::array<double, kQuantities> values_of(const json& list) {
  auto values = Extremes::unknown();
  for (std::size_t i = 0; i < kQuantities; ++i) {
    if (!list.at(i).is_null()) values[i] = list.at(i);
  }
  return values;
}

std::optional<Extremes> period_of_json(const json& place) {
  if (place.is_null()) return std::nullopt;
  Extremes period;
  period.begin_s = place.at("begin_s");
  period.least = values_of(place.at("least"));
  period.greatest = values_of(place.at("greatest"));
  period.samples = place.at("samples");
  period.missing = place.at("missing");
  period.seconds = place.at("seconds");
  period.good = place.at("good");
  for (std::size_t i = 0; i < kMeans; ++i)
    period.mean[i] = {place.at("means").at(i).at(0), place.at("means").at(i).at(1)};
  return period;
}

std::optional<std::int64_t> time_of_json(const json& time) {
  return time.is_number_integer() ? std::optional<std::int64_t>(time) : std::nullopt;
}

json time_json(std::optional<std::int64_t> time) { return time ? json(*time) : json(); }

void add_within(std::vector<Extremes>& found, const Extremes& period, std::int64_t from_s, std::int64_t to_s) {
  if (period.begin_s >= from_s && period.begin_s < to_s) found.push_back(period);
}

}  // namespace

Result<Store> Store::open(const std::string& folder) {
  Store store;
  store.folder_ = folder;
  std::error_code error;
  const bool is_new = std::filesystem::create_directories(folder, error);
  if (error) return refuse(folder, error.message());
  if (const Result<void> restored = store.restore(); !restored) {
    if (!is_new) store.begun_anew_ = restored.error().text();
    if (const Result<void> cleared = store.clear(); !cleared) return tl::unexpected<Error>(cleared.error());
  }
  return store;
}

Result<void> Store::restore() {
  const std::string path = folder_ + "/place.json";
  const Result<std::string> text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  try {
    const json place = json::parse(*text);
    if (place.at("version") != 1) return refuse(path, "found another version, expected 1");
    auto minutes = PeriodFile::open(folder_ + "/minutes", place.at("minutes"));
    if (!minutes) return tl::unexpected<Error>(minutes.error());
    auto hours = PeriodFile::open(folder_ + "/hours", place.at("hours"));
    if (!hours) return tl::unexpected<Error>(hours.error());
    minute_file_ = std::move(*minutes);
    hour_file_ = std::move(*hours);
    minute_.restore(period_of_json(place.at("minute")));
    hour_.restore(period_of_json(place.at("hour")));
    first_second_ = time_of_json(place.at("first_s"));
    last_second_ = time_of_json(place.at("last_s"));
    for (const json& one : place.at("places")) places_.emplace_back(one.at(0), one.at(1));
    cursor_ = place.at("cursor");
  } catch (const json::exception&) {
    return refuse(path, "is not what prismweb writes");
  }
  return {};
}

Result<void> Store::clear() {
  for (auto& [file, name] : {std::pair<PeriodFile*, const char*>(&minute_file_, "/minutes"), {&hour_file_, "/hours"}}) {
    auto empty = PeriodFile::open(folder_ + name, 0);
    if (!empty) return tl::unexpected<Error>(empty.error());
    *file = std::move(*empty);
  }
  minute_.restore({});
  hour_.restore({});
  ended_minutes_.clear();
  ended_hours_.clear();
  places_.clear();
  first_second_.reset();
  last_second_.reset();
  cursor_.clear();
  return write_place();
}

void Store::push(const Extremes& second) {
  if (const auto ended = minute_.push(second)) ended_minutes_.push_back(*ended);
  if (const auto ended = hour_.push(second)) ended_hours_.push_back(*ended);
  if (!first_second_) first_second_ = second.begin_s;
  last_second_ = second.begin_s;
}

// Whole or not at all: what was appended before the disk refused is written over by the next one.
Result<void> Store::append_ended() {
  const PeriodFile::Mark minutes = minute_file_.mark(), hours = hour_file_.mark();
  auto done = minute_file_.append(ended_minutes_);
  if (done) done = hour_file_.append(ended_hours_);
  if (done && !ended_minutes_.empty()) done = minute_file_.sync();
  if (done && !ended_hours_.empty()) done = hour_file_.sync();
  if (done) return done;
  minute_file_.back_to(minutes);
  hour_file_.back_to(hours);
  return done;
}

Result<void> Store::commit(const std::string& cursor) {
  if (Result<void> done = append_ended(); !done) return done;
  ended_minutes_.clear();
  ended_hours_.clear();
  cursor_ = cursor;
  // What comes next begins behind the last second; a cursor is kept now and then, so that seconds of long ago are
  // found.
  const std::int64_t next_s = last_second_.value_or(INT64_MIN) + 1;
  if (last_second_ &&
      (places_.empty() || next_s < places_.back().first || next_s - places_.back().first >= kBetweenPlaces_s))
    places_.emplace_back(next_s, cursor);
  return write_place();
}

Result<void> Store::write_place() const {
  json places = json::array();
  for (const auto& [begin_s, cursor] : places_) places.push_back({begin_s, cursor});
  const json place = {{"version", 1},
                      {"cursor", cursor_},
                      {"minutes", minute_file_.records()},
                      {"hours", hour_file_.records()},
                      {"minute", period_json(minute_.open())},
                      {"hour", period_json(hour_.open())},
                      {"first_s", time_json(first_second_)},
                      {"last_s", time_json(last_second_)},
                      {"places", places}};
  return write_text_file(folder_ + "/place.json", json_text(place) + "\n");
}

std::vector<std::string> Store::cursors_before(std::int64_t second) const {
  std::vector<std::string> found;
  std::int64_t run_s = INT64_MAX;  // of the places behind
  bool in_run = false;             // this run of the clock has one already
  for (auto place = places_.rbegin(); place != places_.rend(); ++place) {
    if (place->first >= run_s) in_run = false;
    run_s = place->first;
    if (!in_run && place->first <= second) {
      found.push_back(place->second);
      in_run = true;
    }
  }
  return found;
}

std::vector<Extremes> Store::minutes(std::int64_t from_s, std::int64_t to_s) const {
  std::vector<Extremes> found = minute_file_.read(from_s, to_s);
  for (const Extremes& minute : ended_minutes_) add_within(found, minute, from_s, to_s);
  if (minute_.open()) add_within(found, *minute_.open(), from_s, to_s);
  return found;
}

std::vector<Extremes> Store::hours(std::int64_t from_s, std::int64_t to_s) const {
  std::vector<Extremes> found = hour_file_.read(from_s, to_s);
  for (const Extremes& hour : ended_hours_) add_within(found, hour, from_s, to_s);
  if (hour_.open()) add_within(found, *hour_.open(), from_s, to_s);
  return found;
}

}  // namespace prism::prismweb
