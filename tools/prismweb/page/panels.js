// SPDX-License-Identifier: MIT
// The numbers of one axis above its charts, and panels: inputs of the model, counters of the line, events.
import { el, setAttribute, setText, svg } from "./dom.js";
import { count, decimalsFor, fixed, kUnknown, moment, plusMinus, span, unitText, withUnit } from "./format.js";
import { ageOf, differenceOf, inWords, isValid, kMarks, levelOfSeverity, mainOf, modelName, rateOf, readable, stabilityText, verdictOf, wordOfLine } from "./state.js";

const kWidth = 240, kPad = 0.2, kEventsShown = 60;
const kInputNames = { T: "T, temperature", dTdt: "dT/dt, slope", U: "U, UHFO" };

/** Positions on a scale from 0 to 1 that shows the range and a fifth of it on both sides. Exported for its test. */
export function onScale(value, min, max) {
  const width = max > min ? max - min : Math.max(Math.abs(min), 1e-9);
  const position = (x) => Math.min(1, Math.max(0, (x - min + kPad * width) / (width * (1 + 2 * kPad))));
  return { from: position(min), to: position(max), at: Number.isFinite(value) ? position(value) : null,
    inside: Number.isFinite(value) ? value >= min && value <= max : null };
}

/** Returns the inputs of a model with training range and current value; `values`: by name, with unit, as in `bias`. */
export function inputsOf(model, values) {
  return (model?.inputs ?? []).map((name, i) => ({ name, unit: "", ...values?.[name], min: model.domain?.min?.[i], max: model.domain?.max?.[i] }));
}

function makeGauge() {
  const range = svg("rect", { class: "range", y: 5, height: 8, rx: 2 }), point = svg("path", { class: "current" });
  const value = el("span", { class: "value" }), within = el("span", { class: "note" }), name = el("span", { class: "label" }), outside = el("span", { class: "verdict" });
  const picture = svg("svg", { viewBox: `0 0 ${kWidth} 18`, class: "gauge", "aria-hidden": "true" }, svg("line", { class: "scale", x1: 0, x2: kWidth, y1: 9, y2: 9 }), range, point);
  return { element: el("li", {}, el("div", {}, name, value, within, outside), picture), name, value, within, outside, range, point };
}

function drawGauge(gauge, input, isCurrent, isFar) {
  const known = Number.isFinite(input.min) && Number.isFinite(input.max);
  const decimals = known ? decimalsFor((input.max - input.min) / 3) : 4;
  const scale = known ? onScale(input.value, input.min, input.max) : null;
  setText(gauge.name, kInputNames[input.name] ?? input.name);
  setText(gauge.value, withUnit(input.value, decimals, unitText(input.unit)));
  setText(gauge.within, known ? `trained ${fixed(input.min, decimals)} … ${fixed(input.max, decimals)}` : "");
  setText(gauge.outside, scale?.inside === false ? (isFar ? "▲ outside" : "slightly outside") : isCurrent && !Number.isFinite(input.value) ? "■ unknown" : "");
  setAttribute(gauge.outside, "class", scale?.inside === false && !isFar ? "note" : "verdict");
  setAttribute(gauge.range, "x", (scale?.from ?? 0) * kWidth);
  setAttribute(gauge.range, "width", ((scale?.to ?? 0) - (scale?.from ?? 0)) * kWidth);
  const x = (scale?.at ?? -1) * kWidth;
  setAttribute(gauge.point, "d", scale?.at == null ? "" : `M${x} 3l4 6l-4 6l-4 -6z`);
  setAttribute(gauge.point, "class", scale?.inside === false && isFar ? "current outside" : "current");
}

/** The inputs of a model (undefined: not known yet, null: none); draw(model, values, isFar): undefined values are not current; `isFar`: prismd regards a value as outside the training range. */
export function makeInputs() {
  const list = el("ul", { class: "gauges" }), note = el("p", { class: "note" });
  let drawn, gauges = [];
  return {
    element: el("div", {}, note, list),
    draw(model, values, isFar) {
      const inputs = inputsOf(model, values), hasRange = inputs.some((input) => Number.isFinite(input.min));
      if (drawn !== model?.id) list.replaceChildren(...(gauges = inputs.map(makeGauge)).map(({ element }) => element));
      drawn = model?.id;
      setText(note, model === undefined ? "The model is not known yet." : !model ? "No model is loaded." : hasRange ? "" : "This model has no training range.");
      inputs.forEach((input, i) => drawGauge(gauges[i], input, values !== undefined, isFar));
    },
  };
}

/** "2 checksum, 1 length" of the counters above 0, or "none". */
const counted = (counters) => Object.entries(counters).filter(([, value]) => value > 0).map(([name, value]) => `${count(value)} ${name}`).join(", ") || "none";

/** Returns [label, value] pairs for a `line` response. Exported for its test. */
export function lineRows(line) {
  if (!line) return [];
  const { decoder = {}, timing = {}, hardware } = line, parts_per_million = 1e6 * (timing.period_s / line.nominal_period_s - 1);
  const sensor = ([name, { state, age_s }]) => [name, `${wordOfLine(state)}${Number.isFinite(age_s) ? `, last value ${span(age_s)} ago` : ", no value yet"}`];
  return [
    ["device", line.device ?? kUnknown],
    ...(line.baud ? [["speed", `${count(line.baud)} baud`]] : []),
    ["frames good", count(decoder.frames)],
    ["frames rejected", counted({ checksum: decoder.bad_check, length: decoder.bad_length, content: decoder.bad_body, fault: decoder.refused })],
    ["frames lost", counted({ missing: timing.missing_frames, duplicate: timing.duplicates, resets: timing.resets })],
    ["bytes skipped", counted({ bytes: decoder.skipped_bytes, resyncs: decoder.resyncs, timeouts: decoder.timeouts })],
    ["period", Number.isFinite(timing.period_s) ? `${fixed(1000 * timing.period_s, 6)} ms, ${fixed(parts_per_million, 1)} ppm off` : kUnknown],
    ["hardware errors", hardware ? counted(hardware) : "not counted by this device"],
    ...Object.entries(line.sensor_lines ?? {}).map(sensor),
    ...(line.notes ?? []).map((note) => ["note", note]),
  ];
}

export function makeLinePanel() {
  const list = el("dl", { class: "line" });
  let drawn = "";
  return {
    element: list,
    draw(line) {
      const rows = lineRows(line), labels = rows.map(([label]) => label).join("\n");
      if (labels !== drawn) list.replaceChildren(...rows.map(([label]) => el("div", {}, el("dt", {}, label), el("dd", { class: "value" }))));
      drawn = labels;
      rows.forEach(([, value], i) => setText(list.children[i].lastChild, value));
    },
  };
}

/** The last events, newest first. lookAt(time_s) is called for a click on an event. */
export function makeEvents(lookAt) {
  const list = el("ol", { class: "events" });
  let drawn = "";
  const entry = (event) => {
    const level = levelOfSeverity(event.severity), repeats = event.repeats ? ` (${event.repeats} more times)` : "";
    return el("li", { class: level }, el("button", { type: "button", click: () => lookAt(event.time_s) },
      el("span", { class: "mark", "aria-label": event.severity }, kMarks[level]), el("time", {}, moment(event.time_s)), el("span", { class: "text" }, inWords(event.text) + repeats)));
  };
  return {
    element: list,
    draw(events) {
      const last = events.at(-1), now = `${events.length} ${last?.time_s} ${last?.text} ${last?.repeats}`;
      if (now === drawn) return;
      drawn = now;
      list.replaceChildren(...events.slice(-kEventsShown).reverse().map(entry));
    },
  };
}

/** Cell name: [label, unit, function of (window row, axis) that returns the text; null or undefined: no cell]. */
const kCells = {
  corrected: ["corrected", "deg/h", (row, axis) => differenceOf(axis) && `${rateOf(axis).text} ${rateOf(axis).sd}`],
  raw: ["raw", "deg/h", (row, axis) => fixed(isValid(row) ? row.mean_rate_deg_per_h : null, rateOf(axis).decimals)],
  bias: ["bias ± sd", "deg/h", (row) => plusMinus(row.bias_deg_per_h, row.sd_deg_per_h)],
  temperature: ["temperature", "°C", (row) => fixed(row.mean_temperature_degc, 3)],
  slope: ["slope", "°C/s", (row) => fixed(row.slope_degc_per_s, 6)],
  uhfo: ["UHFO", "V", (row, axis) => (axis.window && !axis.hasUhfo ? null : fixed(row.mean_uhfo_v, 4))],
  stability: ["stability since start", "deg/h", (row, axis) => stabilityText(axis.stability)],
  model: ["model", "", (row, axis) => modelName(axis)],
  monitor: ["monitor", "", (row, axis) => verdictOf(axis)],
};

export function makeNumbers() {
  const values = {}, mark = el("span", { class: "mark", "aria-hidden": "true" }), word = el("span", { class: "word", role: "status" }), progress = el("span", { class: "count" });
  const label = el("span", { class: "label" }), rate = el("span", { class: "value big" }), sd = el("span", { class: "value sd" }), why = el("p", { class: "why" }), age = el("span", { class: "age" });
  const name = el("h1"), cells = Object.entries(kCells).map(([key, [title, unit]]) => {
    values[key] = el("span", { class: "value" });
    return el("div", { class: `cell ${key}` }, el("dt", {}, title), el("dd", {}, values[key], unit ? el("span", { class: "unit" }, ` ${unit}`) : null));
  });
  const element = el("section", { class: "numbers", "aria-label": "current values" },
    el("div", { class: "hero" }, name, el("p", { class: "verdict" }, mark, word, progress),
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
      setText(progress, status.count ?? "");
      setText(why, status.level === "good" ? `${status.why}; means of ${span(axis.window_s ?? 100)}` : status.why);
      const main = mainOf(shown);
      setText(label, main.what);
      setText(rate, main.text);
      setText(sd, main.sd);
      setText(age, status.old ? ageOf(axis, now_ms) : "");
      for (const [key, [, , textOf]] of Object.entries(kCells)) {
        const text = textOf(row, shown);
        values[key].closest(".cell").hidden = text === null || text === undefined;
        setText(values[key], text ?? "");
      }
    },
  };
}
