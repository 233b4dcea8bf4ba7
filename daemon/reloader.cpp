// SPDX-License-Identifier: MIT
#include "daemon/reloader.hpp"

#include <boost/asio/post.hpp>

#include "base/notify.hpp"

namespace prism::daemon {

void Reloader::reload(Done done) {
  waiting_.push_back(std::move(done));
  if (running_.empty()) begin();
}

void Reloader::begin() {
  running_ = std::exchange(waiting_, {});
  notify_reloading();
  const auto loaded = [io = &io_, reloader = weak_from_this()](Result<pipeline::Setup> found) {
    auto setup = std::make_shared<Result<pipeline::Setup>>(std::move(found));
    boost::asio::post(*io, [setup, reloader] {
      if (const auto self = reloader.lock()) self->finish(std::move(*setup));
    });
  };
  loader_.post(
      0, [load = parts_.load, loaded] { loaded(load()); },
      [loaded](const std::string& why) { loaded(make_error("reload", why)); });
}

void Reloader::finish(Result<pipeline::Setup> setup) {
  const Result<std::string> outcome = take(std::move(setup));
  if (outcome) {
    for (const std::string& key : parts_.device.setup.config.removed_keys)
      parts_.tell(pipeline::Severity::kWarning, "removed_key", key);
    parts_.tell(pipeline::Severity::kInfo, "reloaded", "reloaded: " + *outcome);
  } else {
    parts_.tell(pipeline::Severity::kError, "reload_refused",
                "reload failed, the old configuration stays in use: " + outcome.error().text());
  }
  notify_ready(parts_.summary());
  for (const Done& done : std::exchange(running_, {})) done(outcome);
  if (!waiting_.empty()) begin();
}

Result<std::string> Reloader::take(Result<pipeline::Setup> setup) {
  if (!setup) return tl::unexpected<Error>(setup.error());
  const std::vector<pipeline::Setup::Output> outputs = parts_.device.setup.outputs;
  const auto reopen = parts_.device.reconfigure(std::move(*setup));
  if (!reopen) return tl::unexpected<Error>(reopen.error());
  if (*reopen) parts_.lines_changed();
  const pipeline::Setup& now = parts_.device.setup;
  if (outputs != now.outputs) parts_.outputs_changed();
  return now.config.path + " in use, model " + pipeline::models_text(now);
}

}  // namespace prism::daemon
