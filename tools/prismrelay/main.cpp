// SPDX-License-Identifier: MIT
// prismrelay: sends the rows of this host's prismds to PostgreSQL, MQTT and Prometheus.
#include "tools/prismrelay/service.hpp"

int main(int argc, char** argv) { return prism::prismrelay::run(argc, argv); }
