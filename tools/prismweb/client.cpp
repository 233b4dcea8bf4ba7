// SPDX-License-Identifier: MIT
#include "tools/prismweb/client.hpp"

#include "tools/prismweb/site.hpp"

namespace prism::prismweb {

Client::Client(Site& site, Channel& channel) : site_(site), there_(site.weak_from_this()), channel_(channel) {}

Client::~Client() {
  const auto site = there_.lock();
  if (!site) return;
  site->remove(this);
  for (const auto& hub : site->instances().all()) hub->wish(this, {});
}

void Client::enter() { site_.add(this); }

}  // namespace prism::prismweb
