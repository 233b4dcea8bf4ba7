// SPDX-License-Identifier: MIT
// The numbers of one axis above its charts.
import { el, setAttribute, setText } from "./dom.js";
import { count as counted, fixed, kUnknown, plusMinus, span } from "./charts/format.js";
import { kMarks } from "./quality.js";
import { ageOf, isValid, modelName, rateOf, readable } from "./state.js";

/** Cell name: [label, unit, function of (window row, axis, gyro) that returns the text]. */
const kCells = {
  raw: ["raw", "deg/h", (row) => fixed(isValid(row) ? row.mean_rate_deg_per_h : null, 5)],
  bias: ["bias ± sd", "deg/h", (row) => plusMinus(row.bias_deg_per_h, row.sd_deg_per_h, 5)],
  temperature: ["temperature", "°C", (row) => fixed(row.mean_temperature_degc, 3)],
  slope: ["slope", "°C/s", (row) => fixed(row.slope_degc_per_s, 6)],
  uhfo: ["UHFO", "V", (row) => fixed(row.mean_uhfo_v, 4)],
  stability: ["stability since start, deg/h", "", (row, axis) => stability(axis.stability)],
  frames: ["frames good, rejected, missing", "", (row, axis, gyro) => frames(gyro.status)],
  model: ["model", "", (row, axis) => modelName(axis)],
};

function stability(result) {
  if (!Number.isFinite(result?.corrected?.sd_deg_per_h)) return fixed(result?.all?.sd_deg_per_h, 5);
  const change = Number.isFinite(result.improvement) ? ` (${fixed(100 * Math.abs(result.improvement), 0)} % ${result.improvement < 0 ? "more" : "less"})` : "";
  return `${fixed(result.raw.sd_deg_per_h, 5)} → ${fixed(result.corrected.sd_deg_per_h, 5)}${change}`;
}

function frames(status) {
  if (!status?.line) return kUnknown;
  const rejected = ["bad_check", "bad_length", "bad_body", "refused"].reduce((sum, key) => sum + (status.line[key] ?? 0), 0);
  return `${counted(status.line.frames)}, ${counted(rejected)}, ${counted(status.timing?.missing_frames)}`;
}

export function makeNumbers() {
  const values = {}, mark = el("span", { class: "mark", "aria-hidden": "true" }), word = el("span", { class: "word", role: "status" }), count = el("span", { class: "count" });
  const label = el("span", { class: "label" }), rate = el("span", { class: "value big" }), why = el("p", { class: "why" }), age = el("span", { class: "age" });
  const name = el("h1"), cells = Object.entries(kCells).map(([key, [title, unit]]) => {
    values[key] = el("span", { class: "value" });
    return el("div", { class: `cell ${key}` }, el("dt", {}, title), el("dd", {}, values[key], unit ? el("span", { class: "unit" }, ` ${unit}`) : null));
  });
  const element = el("section", { class: "numbers", "aria-label": "current values" },
    el("div", { class: "hero" }, name, el("p", { class: "verdict" }, mark, word, count),
      el("p", { class: "rate" }, label, rate, el("span", { class: "unit" }, "deg/h"), age), why),
    el("dl", { class: "cells" }, ...cells));
  return {
    element,
    draw(gyro, axis, status, now_ms) {
      const shown = readable(axis, status.old), row = shown.window ?? {};
      setAttribute(element, "class", `numbers ${status.level}${status.old ? " old" : ""}`);
      setText(name, `${gyro.name} ${axis.name}`);
      setText(mark, kMarks[status.level]);
      setText(word, status.word);
      setText(count, status.count ?? "");
      setText(why, `${status.why}; means of ${span(axis.window_s ?? 100)}`);
      const main = rateOf(shown);
      setText(label, main.what);
      setText(rate, fixed(main.deg_per_h, 5));
      setText(age, status.old ? ageOf(axis, now_ms) : "");
      for (const [key, [, , text]] of Object.entries(kCells)) setText(values[key], text(row, axis, gyro));
    },
  };
}
