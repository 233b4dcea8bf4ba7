// SPDX-License-Identifier: MIT
#include "tools/prismsim/obedient_device.hpp"

#include <algorithm>
#include <utility>

namespace prism::prismsim {
namespace {

constexpr std::size_t kMostHeard = 4096;

std::vector<wire::Command> sending(const std::optional<std::vector<wire::Command>>& steps) {
  std::vector<wire::Command> sent = steps.value_or(std::vector<wire::Command>());
  std::erase_if(sent, [](const wire::Command& step) { return step.send.empty(); });
  return sent;
}

}  // namespace

ObedientDevice::ObedientDevice(const wire::Commands& commands)
    : start_(sending(commands.start)),
      stop_(sending(commands.stop)),
      requests_(commands.poll ? commands.poll->requests : std::vector<wire::PollRequest>()) {}

void ObedientDevice::restart() {
  heard_.clear();
  start_step_ = stop_step_ = asked_ = 0;
}

bool ObedientDevice::sends_frame() {
  if (start_step_ < start_.size()) return false;
  if (requests_.empty()) return true;
  if (asked_ == 0) return false;
  --asked_;
  return true;
}

std::vector<std::uint8_t> ObedientDevice::received(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> answers;
  for (const std::uint8_t byte : bytes) {
    heard_.push_back(byte);
    if (heard_.size() > kMostHeard) heard_.erase(heard_.begin());
    if (!start_.empty() && start_step_ == start_.size() && ends_with(start_[0].send)) start_step_ = 0;  // started again
    follow(start_, start_step_, answers);
    follow(stop_, stop_step_, answers);
    if (!stop_.empty() && stop_step_ == stop_.size()) start_step_ = stop_step_ = 0;
    for (const wire::PollRequest& request : requests_) {
      if (start_step_ < start_.size() || !ends_with(request.send)) continue;
      ++asked_;
      heard_.clear();
      break;
    }
  }
  return answers;
}

bool ObedientDevice::ends_with(const wire::CommandBytes& command) const {
  return heard_.size() >= command.size() && std::equal(command.rbegin(), command.rend(), heard_.rbegin());
}

void ObedientDevice::follow(const std::vector<wire::Command>& steps, std::size_t& next,
                            std::vector<std::uint8_t>& answers) {
  if (next >= steps.size() || !ends_with(steps[next].send)) return;
  answers.insert(answers.end(), steps[next].expect.begin(), steps[next].expect.end());
  ++next;
}

}  // namespace prism::prismsim
