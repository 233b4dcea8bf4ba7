// SPDX-License-Identifier: MIT
// A spark line: the last ten minutes of one quantity, on its own scale.
import { svg, setAttribute } from "./dom.js";

const kWidth = 240, kHeight = 44, kPad = 3, kMaxStep_s = 2.5;

/** Path of member `part` of a trace, with a gap at a missing or unknown second; "" for fewer than two values. Exported for its test. */
export function sparkPath(trace, span_s, part = 1) {
  const known = trace.filter((row) => Number.isFinite(row[part])).map((row) => [row[0], row[part]]);
  if (known.length < 2) return "";
  const end_s = trace[trace.length - 1][0];
  let low = Infinity, high = -Infinity;
  for (const [, value] of known) [low, high] = [Math.min(low, value), Math.max(high, value)];
  const scale = high > low ? (kHeight - 2 * kPad) / (high - low) : 0;
  return known
    .map(([time_s, value], i) => {
      const x = kWidth * (1 - (end_s - time_s) / span_s), y = scale ? kHeight - kPad - (value - low) * scale : kHeight / 2;
      const isNext = i > 0 && time_s - known[i - 1][0] < kMaxStep_s;
      return `${isNext ? "L" : "M"}${x.toFixed(1)},${y.toFixed(1)}`;
    })
    .join("");
}

export function makeSpark() {
  const line = svg("path", { class: "spark-line", d: "" });
  const element = svg("svg", { class: "spark", viewBox: `0 0 ${kWidth} ${kHeight}`, preserveAspectRatio: "none", "aria-hidden": "true" }, line);
  let drawn = "";
  return {
    element,
    /** Draws only a changed trace, because a page with many gyros has a path of 600 points for each. */
    draw(trace, span_s, part) {
      const now = `${part} ${trace.length} ${trace[0]} ${trace.at(-1)}`;
      if (now !== drawn) setAttribute(line, "d", sparkPath(trace, span_s, part));
      drawn = now;
    },
  };
}
