// SPDX-License-Identifier: MIT
// The training range of a model and the current values: a gauge for each input, and a map of temperature and slope.
import { el, setAttribute, setText, svg } from "./dom.js";
import { decimalsFor, fixed, withUnit } from "./charts/format.js";

const kWindowMembers = { T: ["mean_temperature_degc", "°C"], dTdt: ["slope_degc_per_s", "°C/s"], U: ["mean_uhfo_v", "V"] };
const kWidth = 240, kHeight = 150, kPad = 0.2;

/** Positions on a scale from 0 to 1 that shows the range and a fifth of it on both sides. Exported for its test. */
export function onScale(value, min, max) {
  const width = max > min ? max - min : Math.max(Math.abs(min), 1e-9);
  const position = (x) => Math.min(1, Math.max(0, (x - min + kPad * width) / (width * (1 + 2 * kPad))));
  return { from: position(min), to: position(max), at: Number.isFinite(value) ? position(value) : null,
    inside: Number.isFinite(value) ? value >= min && value <= max : null };
}

/** Returns the inputs of a model with training range and current value. */
export function inputsOf(model, row) {
  return (model?.inputs ?? []).map((input, i) => {
    const name = typeof input === "string" ? input : input.name, [member, unit] = kWindowMembers[name] ?? [];
    return { name, unit: unit ?? input.unit ?? "", value: row?.[member], min: model.domain?.min?.[i], max: model.domain?.max?.[i] };
  });
}

function makeGauge() {
  const range = svg("rect", { class: "range", y: 5, height: 8, rx: 2 }), point = svg("path", { class: "current" });
  const value = el("span", { class: "value" }), within = el("span", { class: "note" }), name = el("span", { class: "label" }), outside = el("span", { class: "verdict" });
  const picture = svg("svg", { viewBox: `0 0 ${kWidth} 18`, class: "gauge", "aria-hidden": "true" }, svg("line", { class: "scale", x1: 0, x2: kWidth, y1: 9, y2: 9 }), range, point);
  return { element: el("li", {}, el("div", {}, name, value, within, outside), picture), name, value, within, outside, range, point };
}

function drawGauge(gauge, input) {
  const known = Number.isFinite(input.min) && Number.isFinite(input.max);
  const decimals = known ? decimalsFor((input.max - input.min) / 3) : 4;
  const scale = known ? onScale(input.value, input.min, input.max) : null;
  setText(gauge.name, input.name);
  setText(gauge.value, withUnit(input.value, decimals, input.unit));
  setText(gauge.within, known ? `trained ${fixed(input.min, decimals)} … ${fixed(input.max, decimals)} ${input.unit}` : "");
  setText(gauge.outside, scale?.inside === false ? "▲ outside" : "");
  setAttribute(gauge.range, "x", (scale?.from ?? 0) * kWidth);
  setAttribute(gauge.range, "width", ((scale?.to ?? 0) - (scale?.from ?? 0)) * kWidth);
  const x = (scale?.at ?? -1) * kWidth;
  setAttribute(gauge.point, "d", scale?.at == null ? "" : `M${x} 3l4 6l-4 6l-4 -6z`);
  setAttribute(gauge.point, "class", scale?.inside === false ? "current outside" : "current");
}

/** Makes the domain in `parent`. Call show(model) for a new model (undefined: not known yet, null: none), draw(row, rows) for new rows. */
export function makeDomain(parent) {
  const list = el("ul", { class: "gauges" }), trail = svg("path", { class: "trail" }), box = svg("rect", { class: "range" });
  const point = svg("circle", { class: "current", r: 4.5 }), note = el("p", { class: "note" });
  const map = svg("svg", { viewBox: `0 0 ${kWidth} ${kHeight}`, class: "map", role: "img", "aria-label": "temperature and its slope; the box is the training range" }, box, trail, point);
  const caption = el("p", { class: "note" }, "x: T, y: dT/dt; box: training range, line: data shown in the charts");
  const figure = el("figure", {}, map, caption);
  parent.append(note, list, figure);
  let model = null, gauges = [];
  const hasMap = () => ["T", "dTdt"].every((name) => inputsOf(model, null).some((input) => input.name === name && Number.isFinite(input.min)));
  return {
    show(newModel) {
      model = newModel;
      gauges = inputsOf(model, null).map(makeGauge);
      list.replaceChildren(...gauges.map((gauge) => gauge.element));
      figure.hidden = !hasMap();
      const hasRange = inputsOf(model, null).some((input) => Number.isFinite(input.min));
      setText(note, model === undefined ? "The model is not known yet." : !model ? "No model is loaded." : hasRange ? "" : "This model has no training range.");
    },
    draw(row, rows) {
      const inputs = inputsOf(model, row);
      inputs.forEach((input, i) => drawGauge(gauges[i], input));
      if (figure.hidden) return;
      const [t, slope] = ["T", "dTdt"].map((name) => inputs.find((input) => input.name === name));
      const x = (value) => onScale(value, t.min, t.max).at * kWidth, y = (value) => (1 - onScale(value, slope.min, slope.max).at) * kHeight;
      for (const [name, value] of [["x", x(t.min)], ["y", y(slope.max)], ["width", x(t.max) - x(t.min)], ["height", y(slope.min) - y(slope.max)]]) setAttribute(box, name, value);
      const every = Math.max(1, Math.floor(rows.length / 200));
      const points = rows.filter((one, i) => i % every === 0 && one.temperature && one.slope);
      setAttribute(trail, "d", points.map((one, i) => `${i ? "L" : "M"}${x(one.temperature[1]).toFixed(1)} ${y(one.slope[1]).toFixed(1)}`).join(""));
      const known = Number.isFinite(t.value) && Number.isFinite(slope.value);
      point.toggleAttribute("hidden", !known);
      if (!known) return;
      setAttribute(point, "cx", x(t.value));
      setAttribute(point, "cy", y(slope.value));
      setAttribute(point, "class", inputs.some((input) => onScale(input.value, input.min, input.max).inside === false) ? "current outside" : "current");
    },
  };
}
