// SPDX-License-Identifier: MIT
// All gyros and axes of the host: one tile per axis, with its status first.
import { el, setAttribute, setText } from "./dom.js";
import { fixed, kUnknown, plusMinus, withUnit } from "./charts/format.js";
import { kMarks } from "./quality.js";
import { makeSpark } from "./spark.js";
import { ageOf, statusOf, kTrace_s, modelName, partOfTrace, rateOf, readable } from "./state.js";

function makeTile(gyro, axis) {
  const value = (name) => el("dd", { class: `value ${name}` });
  const part = {
    mark: el("span", { class: "mark", "aria-hidden": "true" }),
    word: el("span", { class: "word" }),
    count: el("span", { class: "count" }),
    note: el("p", { class: "note" }),
    what: el("span", { class: "label" }),
    rate: el("span", { class: "value big" }),
    age: el("span", { class: "age" }),
    bias: value("bias"), temperature: value("temperature"), stability: value("stability"), model: value("model"),
    spark: makeSpark(),
  };
  const pair = (label, element) => el("div", {}, el("dt", {}, label), element);
  const tile = el("a", { class: "tile", href: `#/${encodeURIComponent(gyro.name)}/${encodeURIComponent(axis.name)}` },
    el("header", {}, el("h2", {}, gyro.name, el("span", { class: "axis" }, ` ${axis.name}`)), el("span", { class: "verdict" }, part.mark, part.word, part.count)),
    el("p", { class: "rate" }, part.what, part.rate, el("span", { class: "unit" }, "deg/h"), part.age),
    part.spark.element, part.note,
    el("dl", {}, pair("bias ± sd, deg/h", part.bias), pair("temperature", part.temperature),
      pair("stability since start, deg/h", part.stability), pair("model", part.model)));
  return { element: tile, ...part };
}

/** "0.01552 → 0.00677": standard deviation of 100 s means, raw and corrected. */
function stabilityText(stability) {
  const raw = stability?.raw?.sd_deg_per_h, corrected = stability?.corrected?.sd_deg_per_h;
  if (!Number.isFinite(raw) && !Number.isFinite(stability?.all?.sd_deg_per_h)) return kUnknown;
  if (!Number.isFinite(corrected)) return `${fixed(raw ?? stability.all.sd_deg_per_h, 5)} raw`;
  return `${fixed(raw, 5)} → ${fixed(corrected, 5)}`;
}

function drawTile(tile, gyro, axis, linked, now_ms) {
  const status = statusOf(gyro, axis, linked, now_ms), shown = readable(axis, status.old), row = shown.window ?? {};
  setAttribute(tile.element, "class", `tile ${status.level}${status.old ? " old" : ""}`);
  setText(tile.mark, kMarks[status.level]);
  setText(tile.word, status.word);
  setText(tile.count, status.count ?? "");
  setText(tile.note, axis.trace.length === 0 ? "" : status.old ? "last 10 min received" : "last 10 min");
  setAttribute(tile.element, "title", status.why);
  const rate = rateOf(shown);
  setText(tile.what, rate.what);
  setText(tile.rate, fixed(rate.deg_per_h, 5));
  setText(tile.age, status.old ? ageOf(axis, now_ms) : "");
  setText(tile.bias, plusMinus(row.bias_deg_per_h, row.sd_deg_per_h, 5));
  setText(tile.temperature, withUnit(row.mean_temperature_degc, 3, "°C"));
  setText(tile.stability, stabilityText(axis.stability));
  setText(tile.model, modelName(axis));
  const texts = [`${gyro.name} axis ${axis.name}: ${status.word}`, status.why, `${rate.what} ${tile.rate.textContent} deg/h`, tile.age.textContent];
  setAttribute(tile.element, "aria-label", texts.filter(Boolean).join(", "));
  tile.spark.draw(axis.trace, kTrace_s, partOfTrace(axis));
}

/** "3 gyros, 5 axes: 4 good, 1 to check". */
function sumUp(gyros, linked, now_ms) {
  const counts = { good: 0, care: 0, bad: 0 };
  let axes = 0;
  for (const gyro of gyros.values()) {
    if (gyro.axes.size === 0) counts[gyro.gone ? "bad" : "care"]++;
    for (const axis of gyro.axes.values()) { counts[statusOf(gyro, axis, linked, now_ms).level]++; axes++; }
  }
  const parts = [`${counts.good} good`, counts.care && `${counts.care} caution`, counts.bad && `${counts.bad} to check`];
  const plural = (n, one, many) => `${n} ${n === 1 ? one : many}`;
  return `${plural(gyros.size, "gyro", "gyros")}, ${plural(axes, "axis", "axes")}: ${parts.filter(Boolean).join(", ")}`;
}

/** Makes the overview in `parent`; call draw() after each change. */
export function makeOverview(parent) {
  const tiles = new Map();
  const sum = el("p", { class: "sum", role: "status" }), grid = el("div", { class: "tiles" });
  const empty = el("p", { class: "empty", hidden: true }, "No prismd is running on this host.");
  parent.append(sum, grid, empty);
  const remove = (key) => { tiles.get(key).element.remove(); tiles.delete(key); };
  const tileOf = (key, gyro, axis) => {
    if (!tiles.has(key)) { tiles.set(key, makeTile(gyro, axis)); grid.append(tiles.get(key).element); }
    return tiles.get(key);
  };
  return {
    draw(gyros, linked, now_ms) {
      const seen = new Set();
      for (const gyro of gyros.values()) {
        const axes = gyro.axes.size > 0 ? [...gyro.axes.values()] : [{ name: "", window: null, window_ms: -Infinity, trace: [], quality: "no_data", model: undefined }];
        for (const axis of axes) {
          const key = JSON.stringify([gyro.name, axis.name]);
          seen.add(key);
          drawTile(tileOf(key, gyro, axis), gyro, axis, linked, now_ms);
        }
      }
      for (const key of [...tiles.keys()]) if (!seen.has(key)) remove(key);
      empty.hidden = gyros.size > 0 || !linked;
      setText(sum, linked ? sumUp(gyros, linked, now_ms) : "Not connected: all values are old.");
    },
  };
}
