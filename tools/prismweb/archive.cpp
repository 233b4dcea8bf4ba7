// SPDX-License-Identifier: MIT
#include "tools/prismweb/archive.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/methods.hpp"
#include "tools/prismweb/range.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

constexpr std::int64_t kMaxRows_s = RecentSeconds::kLength_s;
constexpr std::array<std::string_view, 2> kRowsParams = {"axis", "seconds"};

json row_json(const PeriodSummary& second) {
  static constexpr std::array<const char*, kQuantities> kNames = {
      "rate_deg_per_h",   "corrected_deg_per_h", "bias_deg_per_h", "sd_deg_per_h",
      "temperature_degc", "slope_degc_per_s",    "uhfo_v"};
  json row = {{"time_s", second.begin_s + 1},
              {"samples", second.samples},
              {"missing", second.missing},
              {"good", second.good > 0}};
  for (std::size_t i = 0; i < kQuantities; ++i) row[kNames[i]] = second.min[i];
  return row;
}

}  // namespace

std::string path_part(const std::string& name) {
  std::string part;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) || c == '_' || c == '-' || (c == '.' && !part.empty());
    part += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return part;
}

Archive::Archive(boost::asio::io_context& io, InstanceProxy& proxy, DiskThread& disk, std::string folder)
    : io_(io), proxy_(proxy), disk_(disk), folder_(std::move(folder)) {}

std::unique_ptr<AsyncStore> Archive::store_of(const std::string& axis) const {
  if (folder_.empty()) return nullptr;
  return std::make_unique<AsyncStore>(io_, disk_, folder_ + "/" + path_part(proxy_.name()) + "/" + path_part(axis));
}

void Archive::connected() {
  for (const std::string& axis : proxy_.axes()) {
    auto& archive = axes_[axis];
    if (!archive) archive = std::make_shared<AxisArchive>(io_, proxy_, axis, store_of(axis));
    archive->follow();
  }
}

void Archive::notified(const Notification& notification) {
  if (notification.method != "window") return;
  const auto axis = axes_.find(std::string(notification.axis));
  const json message = json::parse(notification.line, nullptr, false);
  if (axis != axes_.end() && message.is_object()) axis->second->window(message.value("params", json()));
}

void Archive::finish() {
  for (const auto& [name, axis] : axes_) axis->finish();
}

AxisArchive* Archive::axis_of(const json& params) {
  const json axis = params.is_object() ? params.value("axis", json()) : json();
  if (axis.is_null() && axes_.size() == 1) return axes_.begin()->second.get();
  const auto found = axis.is_string() ? axes_.find(axis.get<std::string>()) : axes_.end();
  return found == axes_.end() ? nullptr : found->second.get();
}

std::string Archive::wrong_axis() const {
  if (axes_.empty()) return error_member(kGone, proxy_.name() + " has not been connected yet");
  return error_member(kInvalidParams, fmt::format("expected \"axis\", one of {}", fmt::join(proxy_.axes(), ", ")));
}

void Archive::range(const json& params, const InstanceProxy::Answer& answer) {
  AxisArchive* const axis = axis_of(params);
  if (axis == nullptr) return answer(wrong_axis());
  const Result<RangeQuery> query = parse_range(params);
  if (!query) return answer(error_member(kInvalidParams, query.error().text()));
  answer_range(proxy_, *axis, *query, answer);
}

void Archive::rows(const json& params, const InstanceProxy::Answer& answer) {
  const std::string unknown = unknown_param("rows", params, kRowsParams);
  if (!unknown.empty()) return answer(error_member(kInvalidParams, unknown));
  AxisArchive* const axis = axis_of(params);
  if (axis == nullptr) return answer(wrong_axis());
  if (proxy_.state() != InstanceState::kRunning) return answer(error_member(kGone, proxy_.name() + " is not running"));
  const json seconds = params.is_object() ? params.value("seconds", json(60)) : json(60);
  if (!seconds.is_number_integer() || seconds < 1 || seconds > kMaxRows_s)
    return answer(error_member(kInvalidParams, fmt::format("expected seconds, 1 to {}", kMaxRows_s)));
  json rows = json::array();
  const auto& all = axis->recent().all();
  const std::size_t count = std::min<std::size_t>(all.size(), seconds.get<std::size_t>());
  for (std::size_t i = all.size() - count; i < all.size(); ++i) rows.push_back(row_json(all[i]));
  answer("\"result\":" + json_text(rows));
}

}  // namespace prism::prismweb
