// SPDX-License-Identifier: MIT
// The Allan deviation of the data in the charts, raw and corrected, in a log-log plot. dygraphs cannot draw one with grid lines only at
// decades.
import { allanDeviation } from "./allan.js";
import { el, setText, svg } from "./dom.js";
import { span } from "./charts/format.js";

const kWidth = 360, kHeight = 230, kLeft = 58, kBottom = 30, kTop = 8, kRight = 10;
const kCurves = [["raw_1s", "raw", "raw"], ["corrected_1s", "corrected", "corrected"]];

/** A step with a smaller fraction of its seconds is a gap: its mean has more noise and another centre. */
const kMinFraction = 0.9;
const isComplete = (row, step_s) => !(row.seconds < kMinFraction * step_s);

/** Returns the values of one quantity, one per step; NaN for a missing or incomplete step. Exported for its test. */
export function evenly(rows, step_s, key) {
  const values = [];
  for (const row of rows) {
    const index = Math.round((row.time_s - rows[0].time_s) / step_s);
    while (values.length < index) values.push(NaN);
    values[index] = isComplete(row, step_s) ? row[key]?.[1] ?? NaN : NaN;
  }
  return values;
}

const decades = (low, high) => [Math.floor(Math.log10(low) + 1e-9), Math.ceil(Math.log10(high) - 1e-9)];
const power = (exponent) => (exponent >= -2 && exponent <= 4 ? String(10 ** exponent) : `1e${exponent}`);

function draw(plot, curves) {
  plot.replaceChildren();
  const points = curves.flatMap((curve) => curve.points).filter((point) => point.deviation > 0);
  if (points.length === 0) return;
  const x0 = Math.log10(Math.min(...points.map((point) => point.tau_s))), x1 = Math.log10(Math.max(...points.map((point) => point.tau_s)));
  const [y0, y1] = decades(Math.min(...points.map((point) => point.deviation)), Math.max(...points.map((point) => point.deviation)));
  const x = (tau_s) => kLeft + ((Math.log10(tau_s) - x0) / Math.max(x1 - x0, 0.1)) * (kWidth - kLeft - kRight);
  const y = (value) => kHeight - kBottom - ((Math.log10(value) - y0) / Math.max(y1 - y0, 1)) * (kHeight - kBottom - kTop);
  for (let k = Math.ceil(x0 - 1e-9); k <= x1 + 1e-9; k++) {
    plot.append(svg("line", { class: "grid", x1: x(10 ** k), x2: x(10 ** k), y1: kTop, y2: kHeight - kBottom }),
      svg("text", { x: x(10 ** k), y: kHeight - kBottom + 14, "text-anchor": "middle" }, power(k)));
  }
  for (let k = y0; k <= Math.max(y1, y0 + 1); k++) {
    plot.append(svg("line", { class: "grid", x1: kLeft, x2: kWidth - kRight, y1: y(10 ** k), y2: y(10 ** k) }),
      svg("text", { x: kLeft - 6, y: y(10 ** k) + 4, "text-anchor": "end" }, power(k)));
  }
  plot.append(svg("text", { x: (kWidth + kLeft) / 2, y: kHeight - 2, "text-anchor": "middle", class: "axis-name" }, "averaging time, s"));
  for (const curve of curves) {
    const known = curve.points.filter((point) => point.deviation > 0);
    plot.append(svg("polyline", { class: `curve ${curve.name}`, points: known.map((point) => `${x(point.tau_s).toFixed(1)},${y(point.deviation).toFixed(1)}`).join(" ") }));
  }
}

/** Makes the plot in `parent`; update(steps) computes and draws. */
export function makeAllan(parent) {
  const plot = svg("svg", { viewBox: `0 0 ${kWidth} ${kHeight}`, class: "allan", role: "img", "aria-label": "Allan deviation" });
  const note = el("p", { class: "note" });
  const legend = el("ul", { class: "legend" }, ...kCurves.map(([, name, label]) => el("li", {}, el("span", { class: `swatch c--${name}`, "aria-hidden": "true" }), el("span", { class: "label" }, label))));
  parent.append(legend, plot, note);
  return {
    update({ rows: all, step_s, hasMeans }) {
      const rows = hasMeans ? all : [], used = rows.filter((row) => isComplete(row, step_s)).length;
      const curves = kCurves.map(([key, name, label]) => ({ name, label, points: rows.length > 2 ? allanDeviation(evenly(rows, step_s, key), step_s) : [] }));
      draw(plot, curves);
      const minima = curves.map(({ label, points }) => {
        const lowest = points.reduce((a, b) => (a && a.deviation <= b.deviation ? a : b), null);
        return lowest && `${label}: minimum ${lowest.deviation.toPrecision(3)} deg/h at ${span(lowest.tau_s)}`;
      }).filter(Boolean);
      setText(note, !hasMeans ? "A view this long has only minima and maxima: zoom in." : minima.length > 0 ? `Overlapping, deg/h, of ${span(used * step_s)} from means of ${span(step_s)}; ${minima.join("; ")}` : "Not enough rows.");
      plot.setAttribute("aria-label", note.textContent);
      return curves;
    },
  };
}
