// SPDX-License-Identifier: MIT
// How long the page works, for whoever watches it with a PerformanceObserver. Nothing is kept: an hour of entries would be a leak.

/** From `begin_ms` (0: since the page was asked for) until now. */
export function measured(name, begin_ms = 0) {
  performance.measure(name, { start: begin_ms, end: performance.now() });
  performance.clearMeasures(name);
}
