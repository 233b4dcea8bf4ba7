// SPDX-License-Identifier: MIT
#include "daemon/reloader.hpp"

#include <memory>
#include <utility>

#include "daemon/notify.hpp"
#include "daemon/service.hpp"

namespace prism::daemon {

Reloader::Reloader(EventLoop& loop, DiskThread& disk, Options options, Station& station,
                   std::function<void()> line_changed)
    : loop_(loop),
      disk_(disk),
      options_(std::move(options)),
      station_(station),
      line_changed_(std::move(line_changed)) {}

void Reloader::reload(Done done) {
  waiting_.push_back(std::move(done));
  if (running_.empty()) begin();
}

void Reloader::begin() {
  running_ = std::exchange(waiting_, {});
  notify_reloading();
  disk_.post(0, [this] {
    auto setup = std::make_shared<Result<Setup>>(load_setup(options_));
    loop_.post([this, setup] { finish(std::move(*setup)); });
  });
}

void Reloader::finish(Result<Setup> setup) {
  Result<std::string> outcome = std::string();
  Result<bool> taken =
      setup ? station_.reconfigure(std::move(*setup)) : Result<bool>(tl::unexpected<Error>(setup.error()));
  if (taken) {
    const compensation::ModelPtr& model = station_.setup().model;
    *outcome = station_.setup().config.path + " in force, model " +
               (model ? model->info().id.substr(0, 12) + " " + model->info().name : "none");
    station_.tell(Severity::kInfo, "reloaded", "reloaded: " + *outcome);
    if (*taken) line_changed_();
  } else {
    outcome = tl::unexpected<Error>(taken.error());
    station_.tell(Severity::kError, "reload_refused",
                  "reload refused, everything stays as it was: " + taken.error().text());
  }
  notify_ready(station_.summary());
  for (const Done& done : std::exchange(running_, {})) done(outcome);
  if (!waiting_.empty()) begin();
}

}  // namespace prism::daemon
