// SPDX-License-Identifier: MIT
// Where a model was trained, and where the gyro is now: a gauge for each input, and temperature against its slope as a map.
import { el, setAttribute, setText, svg } from "./dom.js";
import { decimalsFor, fixed, withUnit } from "./charts/format.js";

const kOfWindow = { T: ["mean_temperature_degc", "°C"], dTdt: ["slope_degc_per_s", "°C/s"], U: ["mean_uhfo_v", "V"] };
const kWidth = 240, kHeight = 150, kPad = 0.2;

/** Where things stand on a scale from 0 to 1 that shows a range with a fifth more to both sides. Exported for its test. */
export function onScale(value, least, greatest) {
  const wide = greatest > least ? greatest - least : Math.max(Math.abs(least), 1e-9);
  const place = (x) => Math.min(1, Math.max(0, (x - least + kPad * wide) / (wide * (1 + 2 * kPad))));
  return { from: place(least), to: place(greatest), at: Number.isFinite(value) ? place(value) : null,
    inside: Number.isFinite(value) ? value >= least && value <= greatest : null };
}

/** The inputs of a model with their training range and the present value. */
export function inputsOf(model, row) {
  return (model?.inputs ?? []).map((input, i) => {
    const name = typeof input === "string" ? input : input.name, [member, unit] = kOfWindow[name] ?? [];
    return { name, unit: unit ?? input.unit ?? "", value: row?.[member], least: model.domain?.min?.[i], greatest: model.domain?.max?.[i] };
  });
}

function makeGauge() {
  const range = svg("rect", { class: "range", y: 5, height: 8, rx: 2 }), point = svg("path", { class: "present" });
  const words = el("span", { class: "value" }), within = el("span", { class: "note" }), name = el("span", { class: "label" }), verdict = el("span", { class: "verdict" });
  const picture = svg("svg", { viewBox: `0 0 ${kWidth} 18`, class: "gauge", "aria-hidden": "true" }, svg("line", { class: "scale", x1: 0, x2: kWidth, y1: 9, y2: 9 }), range, point);
  return { element: el("li", {}, el("div", {}, name, words, within, verdict), picture), name, words, within, verdict, range, point };
}

function drawGauge(gauge, input) {
  const known = Number.isFinite(input.least) && Number.isFinite(input.greatest);
  const decimals = known ? decimalsFor((input.greatest - input.least) / 3) : 4;
  const scale = known ? onScale(input.value, input.least, input.greatest) : null;
  setText(gauge.name, input.name);
  setText(gauge.words, withUnit(input.value, decimals, input.unit));
  setText(gauge.within, known ? `trained ${fixed(input.least, decimals)} … ${fixed(input.greatest, decimals)} ${input.unit}` : "");
  setText(gauge.verdict, scale?.inside === false ? "▲ outside" : "");
  setAttribute(gauge.range, "x", (scale?.from ?? 0) * kWidth);
  setAttribute(gauge.range, "width", ((scale?.to ?? 0) - (scale?.from ?? 0)) * kWidth);
  const x = (scale?.at ?? -1) * kWidth;
  setAttribute(gauge.point, "d", scale?.at == null ? "" : `M${x} 3l4 6l-4 6l-4 -6z`);
  setAttribute(gauge.point, "class", scale?.inside === false ? "present outside" : "present");
}

/** The domain in `place`: show(model) when the model is another (undefined: not known yet; null: none), draw(row, rows) when there is something new. */
export function makeDomain(place) {
  const list = el("ul", { class: "gauges" }), trail = svg("path", { class: "trail" }), box = svg("rect", { class: "range" });
  const point = svg("circle", { class: "present", r: 4.5 }), note = el("p", { class: "note" });
  const map = svg("svg", { viewBox: `0 0 ${kWidth} ${kHeight}`, class: "map", role: "img", "aria-label": "temperature and its slope; the box is the training range" }, box, trail, point);
  const caption = el("p", { class: "note" }, "x: T, y: dT/dt; box: training range, line: data shown in the charts");
  const figure = el("figure", {}, map, caption);
  place.append(note, list, figure);
  let model = null, gauges = [];
  const hasMap = () => ["T", "dTdt"].every((name) => inputsOf(model, null).some((input) => input.name === name && Number.isFinite(input.least)));
  return {
    show(next) {
      model = next;
      gauges = inputsOf(model, null).map(makeGauge);
      list.replaceChildren(...gauges.map((gauge) => gauge.element));
      figure.hidden = !hasMap();
      const boxed = inputsOf(model, null).some((input) => Number.isFinite(input.least));
      setText(note, model === undefined ? "The model is not known yet." : !model ? "No model is loaded." : boxed ? "" : "This model has no training range.");
    },
    draw(row, rows) {
      const inputs = inputsOf(model, row);
      inputs.forEach((input, i) => drawGauge(gauges[i], input));
      if (figure.hidden) return;
      const [t, slope] = ["T", "dTdt"].map((name) => inputs.find((input) => input.name === name));
      const x = (value) => onScale(value, t.least, t.greatest).at * kWidth, y = (value) => (1 - onScale(value, slope.least, slope.greatest).at) * kHeight;
      for (const [name, value] of [["x", x(t.least)], ["y", y(slope.greatest)], ["width", x(t.greatest) - x(t.least)], ["height", y(slope.least) - y(slope.greatest)]]) setAttribute(box, name, value);
      const every = Math.max(1, Math.floor(rows.length / 200));
      const points = rows.filter((one, i) => i % every === 0 && one.temperature && one.slope);
      setAttribute(trail, "d", points.map((one, i) => `${i ? "L" : "M"}${x(one.temperature[1]).toFixed(1)} ${y(one.slope[1]).toFixed(1)}`).join(""));
      const known = Number.isFinite(t.value) && Number.isFinite(slope.value);
      point.toggleAttribute("hidden", !known);
      if (!known) return;
      setAttribute(point, "cx", x(t.value));
      setAttribute(point, "cy", y(slope.value));
      setAttribute(point, "class", inputs.some((input) => onScale(input.value, input.least, input.greatest).inside === false) ? "present outside" : "present");
    },
  };
}
