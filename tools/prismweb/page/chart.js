// SPDX-License-Identifier: MIT
// One strip chart: a dygraphs plot with our own legend, which shows the values at the cursor as text.
import { plotters } from "./charts/band.js";
import { colour, el, setText } from "./dom.js";
import { decimalsFor, fixed } from "./charts/format.js";
import { tableOf } from "./steps.js";
import { ticksOf } from "./charts/ticks.js";

/* global Dygraph */
// The legend of dygraphs writes inline styles, which the page's content security policy forbids.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);

export const kRightGap_px = 14;
const kTickGap_px = 34, kNarrow_px = 480;

/** Width of the vertical scale's labels, px. */
export const labelWidth = (plot) => (plot.clientWidth < kNarrow_px ? 54 : 72);

function legendOf(spec) {
  const values = new Map();
  const list = el("ul", { class: "legend" }, ...spec.series.map((series) => {
    const value = el("span", { class: "value" });
    values.set(series.label, value);
    return el("li", {}, el("span", { class: `swatch c${series.colour}`, "aria-hidden": "true" }), el("span", { class: "label" }, series.label), value);
  }));
  return { list, values };
}

export class Chart {
  /** `select(time_s)` is called with the time of the row under the mouse, or null. */
  constructor(spec, { select, underlay }) {
    Object.assign(this, { spec, select, underlay, rows: [], step_s: 1 });
    const { list, values } = legendOf(spec);
    this.values = values;
    this.plot = el("div", { class: `plot${spec.tall ? " tall" : ""}` });
    this.title = el("h3", {}, spec.title, el("span", { class: "unit" }, ` ${spec.unit}`));
    this.element = el("section", { class: "chart", "data-chart": spec.key, role: "img" }, el("header", {}, this.title, list), this.plot);
  }

  options() {
    const grid = colour("--grid"), styles = {};
    for (const series of this.spec.series) {
      styles[series.label] = { color: colour(series.colour), strokeWidth: series.width ?? 1.2, ...(series.pattern && { strokePattern: series.pattern }) };
    }
    return {
      labels: ["time", ...this.spec.series.map((series) => series.label)], customBars: true, labelsUTC: true, series: styles, plotter: plotters(), fillAlpha: 0.18,
      gridLineColor: grid, axisLineColor: grid, gridLineWidth: 1, axisLabelFontSize: 11, rightGap: kRightGap_px, yRangePad: 4,
      highlightCircleSize: 3, interactionModel: {}, connectSeparatedPoints: false, ...(this.spec.fromZero && { includeZero: true }),
      axes: {
        x: { ticker: Dygraph.dateTicker, axisLabelFormatter: Dygraph.dateAxisLabelFormatter, pixelsPerLabel: 72, axisLabelWidth: 68 },
        y: { axisLabelWidth: labelWidth(this.plot), ticker: (low, high, pixels) => ticksOf(low, high, pixels / kTickGap_px) },
      },
      highlightCallback: (event, time_ms) => this.select(time_ms / 1000),
      unhighlightCallback: () => this.select(null),
      underlayCallback: (context, area, graph) => this.underlay(context, area, graph, this),
    };
  }

  /** Number of decimals that fits the chart's vertical range. */
  decimals() {
    if (!this.graph) return 3;
    const [low, high] = this.graph.yAxisRange();
    return decimalsFor((high - low) / 2);
  }

  /** Draws the rows in `dateWindow`, [from_ms, to_ms]. An empty chart shows that it has no data only if the rows are `complete`. */
  draw(rows, step_s, dateWindow, complete) {
    Object.assign(this, { rows, step_s });
    const file = rows.length > 0 ? tableOf(rows, step_s, this.spec.series) : [[dateWindow[0], ...this.spec.series.map(() => [NaN, NaN, NaN])]];
    const known = (suffix) => rows.some((row) => row.time_s * 1000 >= dateWindow[0] && this.spec.series.some((series) => row[series.key + suffix]));
    this.plot.dataset.empty = known("") || !complete ? "" : known("_1s") ? "no complete window in this time" : "no data in this time";
    if (this.graph) this.graph.updateOptions({ file, dateWindow });
    else this.graph = new Dygraph(this.plot, file, { ...this.options(), dateWindow });
  }

  /** Plots other quantities for the series with these labels: {raw: "raw_1s", …}. */
  use(keys) {
    this.spec = { ...this.spec, series: this.spec.series.map((series) => ({ ...series, key: keys[series.label] })) };
  }

  /** Call after the colours changed. */
  recolour() {
    if (this.graph) this.graph.updateOptions(this.options());
  }

  /** Shows the values of `row` in the legend, or none if it is null. */
  show(row) {
    for (const series of this.spec.series) {
      const value = row?.[series.key], decimals = series.decimals ?? Math.min(this.decimals() + 1, 7);
      let text = fixed(value?.[1], decimals);
      const sd = series.band ? row?.[series.band]?.[2] : undefined;
      if (value && Number.isFinite(sd)) text += ` ± ${fixed(series.times * sd, decimals)}`;
      else if (value && value[2] > value[0] && this.step_s > 1) text += ` (${fixed(value[0], decimals)} … ${fixed(value[2], decimals)})`;
      setText(this.values.get(series.label), text);
    }
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
