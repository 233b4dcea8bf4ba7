// SPDX-License-Identifier: MIT
// One strip chart: a dygraphs plot with our own legend, which shows the values at the cursor as text; the list of the charts.
import { colour, el, setText } from "./dom.js";
import { decimalsFor, fixed, ticksOf } from "./format.js";
import { tableOf } from "./steps.js";

/* global Dygraph */
// The legend of dygraphs writes inline styles, which the page's content security policy forbids.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);

const kRightGap_px = 28, kTickGap_px = 34, kNarrow_px = 480;
const kLabelMargin_px = 6; // between the labels and the plot in dygraphs

export const kCharts = [
  { key: "rate", title: "Rate", unit: "deg/h", tall: true, series: [
    { key: "raw", label: "raw", colour: "--raw" },
    { key: "corrected", label: "corrected", colour: "--corrected", width: 1.8 }] },
  { key: "bias", title: "Applied bias, ± 2 sd", unit: "deg/h", series: [
    { key: "bias", label: "bias", colour: "--bias", band: "sd", times: 2, width: 1.6 }] },
  { key: "temperature", title: "Temperature", unit: "°C", series: [
    { key: "temperature", label: "T", colour: "--temperature" }] },
  { key: "slope", title: "Temperature slope", unit: "°C/s", series: [
    { key: "slope", label: "dT/dt", colour: "--slope" }] },
  { key: "uhfo", title: "UHFO, the high-frequency oscillator", unit: "V", isOptional: true, series: [
    { key: "uhfo", label: "U", colour: "--uhfo" }] },
  { key: "line", title: "Line", unit: "frames/s", fromZero: true, series: [
    { key: "samples", label: "samples", colour: "--samples", decimals: 0 },
    { key: "missing", label: "missing", colour: "--bad", pattern: [4, 3], decimals: 0 }] },
];

/** The chart of another sensor, as a thermometer on a line of its own. `key`: its quantity. An optional chart is hidden until a row has its quantity. */
export const sensorChart = (key, name, unit) => ({ key, title: name, unit, isOptional: true, series: [{ key, label: name.split(".").at(-1), colour: unit === "°C" ? "--temperature" : "--uhfo" }] });

/** Curves that may be added to another chart, on a scale at the right. */
export const kMore = kCharts.slice(0, -1).flatMap((chart) => chart.series.slice(-1).map((one) => ({ ...one, title: chart.title, unit: chart.unit })));

/**
 * Draws the band between minimum and maximum as one area per contiguous block. The band of dygraphs has four corners for each pair of
 * points, which took half of a chart's time.
 */
function drawBand({ drawingContext: context, points, color, dygraph, plotArea }) {
  context.save();
  context.globalAlpha = dygraph.getNumericOption("fillAlpha");
  context.fillStyle = color;
  for (let begin = 0; begin < points.length; ) {
    if (!Number.isFinite(points[begin].yval)) { begin++; continue; }
    let end = begin, wide = false;
    for (; end < points.length && Number.isFinite(points[end].yval); end++) wide ||= points[end].y_top !== points[end].y_bottom;
    if (wide) fillBlock(context, points, begin, end, plotArea);
    begin = end;
  }
  context.restore();
}

function fillBlock(context, points, begin, end, area) {
  context.beginPath();
  for (let i = begin; i < end; i++) context.lineTo(points[i].canvasx, area.y + area.h * points[i].y_top);
  for (let i = end - 1; i >= begin; i--) context.lineTo(points[i].canvasx, area.y + area.h * points[i].y_bottom);
  context.fill();
}

export class Chart {
  /** `select(time_s)` is called with the time of the row under the mouse, or null; `changed()` if the user adds a curve. */
  constructor(spec, { select, underlay, changed }) {
    Object.assign(this, { spec, select, underlay, rows: [], step_s: 1, more: "", valueRange: null });
    this.plot = el("div", { class: `plot${spec.tall ? " tall" : ""}` });
    this.title = el("h3", {}, spec.title, el("span", { class: "unit" }, ` ${spec.unit}`));
    this.legend = el("ul", { class: "legend" });
    this.auto = el("button", { type: "button", class: "auto", hidden: true, title: "the scale fits the curves again", click: () => this.zoomValues(null) }, "↕ fit");
    const options = kMore.filter((one) => !spec.series.some(({ key }) => key === one.key)).map((one) => el("option", { value: one.key }, `+ ${one.title.toLowerCase()}`));
    this.choice = el("select", { "aria-label": `another curve in the chart ${spec.title}`, title: "another curve in this chart, with a scale at the right",
      change: () => { this.more = this.choice.value; changed(); } }, el("option", { value: "" }, "+"), ...options);
    this.element = el("section", { class: "chart", "data-chart": spec.key, role: "group", hidden: spec.isOptional }, el("header", {}, this.title, this.legend, this.auto, this.choice), this.plot);
  }

  /**
   * Sets the curves: those of the axis, of compared axes, and the one that was added. `hasRight`: a chart of the view has a scale at the
   * right; all have the space, so that equal times are in one column.
   */
  setSeries(series, hasRight) {
    this.choice.value = this.more;
    const more = kMore.filter(({ key }) => key === this.more).map((one) => ({ ...one, label: `${one.label}, ${one.unit}`, pattern: [6, 3], isRight: true }));
    Object.assign(this, { series: [...series, ...more], hasRight });
    this.values = this.series.map(() => el("span", { class: "value" }));
    this.legend.replaceChildren(...this.series.map((one, i) => el("li", {}, el("span", { class: `swatch c${one.colour}`, "aria-hidden": "true" }), el("span", { class: "label" }, one.label), this.values[i])));
    this.destroy();
  }

  /** Width of the labels of a vertical scale, px. */
  labelWidth() {
    return this.plot.clientWidth < kNarrow_px ? 54 : 72;
  }

  /** Left edge (from that of the charts) and width of the area in the scales, px. */
  area() {
    const label = this.labelWidth() + kLabelMargin_px;
    return { left: this.plot.offsetLeft + label, width: Math.max(this.plot.clientWidth - label - (this.hasRight ? label : 0) - kRightGap_px, 1) };
  }

  options() {
    const grid = colour("--grid"), styles = {}, hasOwnRight = this.series.some(({ isRight }) => isRight);
    for (const one of this.series) {
      styles[one.label] = { color: colour(one.colour), strokeWidth: one.width ?? 1.2, ...(one.pattern && { strokePattern: one.pattern }), ...(one.isRight && { axis: "y2" }) };
    }
    const scale = { axisLabelWidth: this.labelWidth(), ticker: (low, high, pixels) => ticksOf(low, high, pixels / kTickGap_px) };
    return {
      labels: ["time", ...this.series.map(({ label }) => label)], customBars: true, labelsUTC: true, series: styles, plotter: [drawBand, Dygraph.Plotters.linePlotter], fillAlpha: 0.18,
      gridLineColor: grid, axisLineColor: grid, gridLineWidth: 1, axisLabelFontSize: 11, yRangePad: 8,
      rightGap: kRightGap_px + (this.hasRight && !hasOwnRight ? scale.axisLabelWidth + kLabelMargin_px : 0),
      highlightCircleSize: 3, interactionModel: {}, connectSeparatedPoints: false, ...(this.spec.fromZero && { includeZero: true }),
      axes: {
        x: { ticker: Dygraph.dateTicker, axisLabelFormatter: Dygraph.dateAxisLabelFormatter, pixelsPerLabel: 72, axisLabelWidth: 56 },
        y: { ...scale, valueRange: this.valueRange },
        y2: { ...scale, drawGrid: false, independentTicks: true },
      },
      highlightCallback: (event, time_ms) => this.select(time_ms / 1000),
      unhighlightCallback: () => this.select(null),
      underlayCallback: (context, area, graph) => this.underlay(context, area, graph, this),
    };
  }

  /** Number of decimals that fits the range of the scale of a curve. */
  decimals({ isRight }) {
    if (!this.graph) return 3;
    const [low, high] = this.graph.yAxisRange(isRight ? 1 : 0);
    return Math.min(decimalsFor((high - low) / 2) + 1, 7);
  }

  /** Draws the rows in `dateWindow`, [from_ms, to_ms]. `empty`: the text of an empty chart; "" until the rows are loaded. */
  draw(rows, step_s, dateWindow, empty) {
    Object.assign(this, { rows, step_s });
    const file = rows.length > 0 ? tableOf(rows, step_s, this.series) : [[dateWindow[0], ...this.series.map(() => [NaN, NaN, NaN])]];
    const known = (suffix) => rows.some((row) => row.time_s * 1000 >= dateWindow[0] && this.series.some((series) => row[series.key + suffix]));
    this.plot.dataset.empty = known("") ? "" : empty && known("_1s") ? "no complete window in this time" : empty;
    if (this.graph) this.graph.updateOptions({ file, dateWindow });
    else this.graph = new Dygraph(this.plot, file, { ...this.options(), dateWindow });
  }

  /** Shows the values between two heights of the plot, px; null: all of them. */
  zoomValues(heights) {
    if (!this.graph) return;
    this.valueRange = heights && heights.map((y) => this.graph.toDataYCoord(y)).sort((a, b) => a - b);
    this.auto.hidden = !heights;
    this.graph.updateOptions({ axes: { y: { valueRange: this.valueRange } } });
  }

  /** Call after the colours or the size changed. A printer has more pixels than the screen. */
  restyle(isPrinted) {
    this.graph?.updateOptions({ ...this.options(), pixelRatio: isPrinted ? 3 : null });
    this.graph?.resize();
  }

  /** Shows the values of `row` in the legend, or none if it is null. */
  show(row) {
    this.series.forEach((series, i) => {
      const value = row?.[series.key], decimals = series.decimals ?? this.decimals(series), sd = series.band ? row?.[series.band]?.[2] : undefined;
      let text = fixed(value?.[1], decimals);
      if (value && Number.isFinite(sd)) text += ` ± ${fixed(series.times * sd, decimals)}`;
      else if (value && value[2] > value[0] && this.step_s > 1) text += ` (${fixed(value[0], decimals)} … ${fixed(value[2], decimals)})`;
      setText(this.values[i], text);
    });
  }

  /** Sets the description for screen readers. */
  describe(text) {
    this.element.setAttribute("aria-label", `${this.spec.title}, ${this.spec.unit}, ${text}`);
  }

  destroy() {
    this.graph?.destroy();
    this.graph = undefined; // a pending draw call then skips this chart
  }
}
