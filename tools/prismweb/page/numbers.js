// SPDX-License-Identifier: MIT
// The numbers of one axis above its charts.
import { el, setAttribute, setText } from "./dom.js";
import { fixed, plusMinus, span } from "./format.js";
import { ageOf, isValid, kMarks, modelName, rateOf, readable, stabilityText } from "./state.js";

/** Cell name: [label, unit, function of (window row, axis, decimals of the rate) that returns the text]. */
const kCells = {
  raw: ["raw", "deg/h", (row, axis, decimals) => fixed(isValid(row) ? row.mean_rate_deg_per_h : null, decimals)],
  bias: ["bias ± sd", "deg/h", (row) => plusMinus(row.bias_deg_per_h, row.sd_deg_per_h)],
  temperature: ["temperature", "°C", (row) => fixed(row.mean_temperature_degc, 3)],
  slope: ["slope", "°C/s", (row) => fixed(row.slope_degc_per_s, 6)],
  uhfo: ["UHFO", "V", (row) => fixed(row.mean_uhfo_v, 4)],
  stability: ["stability since start", "deg/h", (row, axis) => stabilityText(axis.stability)],
  model: ["model", "", (row, axis) => modelName(axis)],
};

export function makeNumbers() {
  const values = {}, mark = el("span", { class: "mark", "aria-hidden": "true" }), word = el("span", { class: "word", role: "status" }), count = el("span", { class: "count" });
  const label = el("span", { class: "label" }), rate = el("span", { class: "value big" }), sd = el("span", { class: "value sd" }), why = el("p", { class: "why" }), age = el("span", { class: "age" });
  const name = el("h1"), cells = Object.entries(kCells).map(([key, [title, unit]]) => {
    values[key] = el("span", { class: "value" });
    return el("div", { class: `cell ${key}` }, el("dt", {}, title), el("dd", {}, values[key], unit ? el("span", { class: "unit" }, ` ${unit}`) : null));
  });
  const element = el("section", { class: "numbers", "aria-label": "current values" },
    el("div", { class: "hero" }, name, el("p", { class: "verdict" }, mark, word, count),
      el("p", { class: "rate" }, label, rate, sd, el("span", { class: "unit" }, "deg/h"), age), why),
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
      setText(rate, main.text);
      setText(sd, main.sd);
      setText(age, status.old ? ageOf(axis, now_ms) : "");
      for (const [key, [, , text]] of Object.entries(kCells)) setText(values[key], text(row, axis, main.decimals));
    },
  };
}
