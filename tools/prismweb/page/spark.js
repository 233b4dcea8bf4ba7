// SPDX-License-Identifier: MIT
// A spark line: the last ten minutes of one quantity, on its own scale.
import { svg, setAttribute } from "./dom.js";

const kWidth = 240, kHeight = 44, kPad = 3;

/** The points of a polyline in a box of kWidth × kHeight; "" where there is nothing to draw. Exported for its test. */
export function sparkPoints(trace, span_s) {
  const known = trace.filter(([, value]) => Number.isFinite(value));
  if (known.length < 2) return "";
  const end_s = trace[trace.length - 1][0];
  let low = Infinity, high = -Infinity;
  for (const [, value] of known) [low, high] = [Math.min(low, value), Math.max(high, value)];
  const scale = high > low ? (kHeight - 2 * kPad) / (high - low) : 0;
  return known
    .map(([time_s, value]) => {
      const x = kWidth * (1 - (end_s - time_s) / span_s), y = scale ? kHeight - kPad - (value - low) * scale : kHeight / 2;
      return `${x.toFixed(1)},${y.toFixed(1)}`;
    })
    .join(" ");
}

export function makeSpark() {
  const line = svg("polyline", { class: "spark-line", points: "" });
  const element = svg("svg", { class: "spark", viewBox: `0 0 ${kWidth} ${kHeight}`, preserveAspectRatio: "none", "aria-hidden": "true" }, line);
  return { element, draw: (trace, span_s) => setAttribute(line, "points", sparkPoints(trace, span_s)) };
}
