// SPDX-License-Identifier: MIT
// Measures of the page for a PerformanceObserver. Entries are not kept, because they would fill the memory.

/** Reports the time from `begin_ms` (0: start of the navigation) until now. */
export function measured(name, begin_ms = 0) {
  performance.measure(name, { start: begin_ms, end: performance.now() });
  performance.clearMeasures(name);
}
