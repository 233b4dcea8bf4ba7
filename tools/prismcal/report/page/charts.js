// SPDX-License-Identifier: MIT
// The figures of a report as charts: drag zooms, Shift-drag moves, a double click goes back; values under the cursor as text. A figure is
// drawn when it comes near the screen, in the place of its SVG, which is left for print.
import { plotters } from "../../../charts/band.js";
import { decimalsFor, fixed } from "../../../charts/format.js";
import { ticksOf } from "../../../charts/ticks.js";
import { decadesOf, nearestRow, tableOf, valueNear } from "./table.js";

/* global Dygraph */
const kGrid = "#e5e7eb", kNearRows = 3;

const el = (tag, name, ...children) => {
  const element = document.createElement(tag);
  element.className = name;
  element.append(...children);
  return element;
};

/** Of a number on an axis: as many digits as the axis' length asks for. */
const shown = (value, [low, high], log) => (log ? String(Number(value.toPrecision(4))).replace("-", "\u2212") : fixed(value, Math.min(9, decimalsFor(high - low) + 1)));

function drawBars({ drawingContext: context, points, color, dygraph }) {
  const known = points.filter((point) => Number.isFinite(point.yval)), base = dygraph.toDomYCoord(0);
  const gaps = known.slice(1).map((point, i) => point.canvasx - known[i].canvasx), width = 0.9 * Math.min(...gaps, 40);
  context.fillStyle = color;
  for (const { canvasx, canvasy } of known) context.fillRect(canvasx - width / 2, Math.min(base, canvasy), width, Math.abs(base - canvasy));
}

/** The band is drawn over what other series have between its own rows. */
function drawRange(event) {
  plotters()[0]({ ...event, points: event.points.filter((point) => point.yval !== null) });
}

function openPoint(graph, name, context, x, y, colour, size) {
  context.beginPath();
  context.strokeStyle = colour;
  context.lineWidth = 0.8;
  context.arc(x, y, size, 0, 2 * Math.PI);
  context.stroke();
}

const isPoints = (form) => form === "points" || form === "open";

function styleOf(one) {
  const style = { color: one.colour, strokeWidth: isPoints(one.form) ? 0 : one.width, plotter: Dygraph.Plotters.linePlotter };
  if (one.dash) style.strokePattern = one.dash;
  if (one.right) style.axis = "y2";
  if (one.form === "band") style.plotter = drawRange;
  if (one.form === "bars") style.plotter = drawBars;
  if (isPoints(one.form) || one.form === "linepoints") Object.assign(style, { drawPoints: true, pointSize: one.form === "linepoints" ? 2 : 1.6 });
  if (one.form === "open") Object.assign(style, { drawPointCallback: openPoint, pointSize: 2.4 });
  return style;
}

/** Mouse alone: a finger scrolls the page. */
const mouse = () => Object.fromEntries(Object.entries(Dygraph.defaultInteractionModel).filter(([name]) => !name.startsWith("touch")));

const rangeOf = ({ min, max }) => (min === undefined && max === undefined ? null : [min ?? null, max ?? null]);

class PanelChart {
  constructor(panel, height_px, figure) {
    Object.assign(this, { panel, figure, rows: tableOf(panel.series) });
    this.values = panel.series.map(() => el("span", "value"));
    this.at = el("span", "at");
    const keys = panel.series.flatMap((one, i) => (one.name ? [this.keyOf(one, i)] : one.form === "band" ? [] : [el("li", "", this.values[i])]));
    this.plot = el("div", "plot");
    this.plot.style.height = `${height_px}px`;
    this.element = el("div", "panel", el("div", "head", el("b", "", panel.title), el("span", "unit", panel.y.label), el("ul", "keys", ...keys)), this.plot,
      el("div", "foot", this.at, el("span", "unit", panel.x.label)));
  }

  keyOf(one, i) {
    const swatch = el("i", one.form);
    swatch.style.color = one.colour;
    return el("li", "", swatch, one.right ? `${one.name} (right, ${this.panel.right.label}) ` : `${one.name} `, this.values[i]);
  }

  /** Only an element that is on the page has a width. */
  draw() {
    const { panel } = this, names = panel.series.map((one, i) => `${i}`), ticks = (axis) => (low, high, px) => (axis.log ? decadesOf(low, high) : ticksOf(low, high, px / 40));
    const wide = { ticker: (low, high, px) => (panel.x.log ? decadesOf(low, high) : ticksOf(low, high, px / 90)), logscale: Boolean(panel.x.log), axisLabelWidth: 60 };
    this.graph = new Dygraph(this.plot, this.rows, {
      labels: ["x", ...names], customBars: true, connectSeparatedPoints: true, fillAlpha: 0.22, legend: "never", labelsUTC: true,
      gridLineColor: kGrid, axisLineColor: "#9ca3af", gridLineWidth: 1, axisLabelFontSize: 12, rightGap: 14, yRangePad: 6, xRangePad: panel.x.log ? 0 : 4,
      highlightCircleSize: 3, interactionModel: mouse(), animatedZooms: false, includeZero: panel.series.some((one) => one.form === "bars"),
      series: Object.fromEntries(panel.series.map((one, i) => [names[i], styleOf(one)])),
      axes: { x: wide, y: { ticker: ticks(panel.y), logscale: Boolean(panel.y.log), axisLabelWidth: 66, valueRange: rangeOf(panel.y) },
        y2: { ticker: ticks(panel.right), logscale: Boolean(panel.right.log), axisLabelWidth: 60, valueRange: rangeOf(panel.right), drawGrid: false, independentTicks: true } },
      ...(panel.x.min !== undefined && panel.x.max !== undefined && { dateWindow: [panel.x.min, panel.x.max] }),
      highlightCallback: (event, x) => this.figure.pointAt(this, x), unhighlightCallback: () => this.figure.pointAt(this, null),
      zoomCallback: (low, high) => this.figure.zoom(this, this.graph.isZoomed("x") ? [low, high] : null),
    });
    this.show(null);
  }

  /** The values at the row nearest to x; null: none. */
  show(x) {
    const row = x === null ? -1 : nearestRow(this.rows, x), { graph, panel } = this;
    this.at.textContent = row < 0 ? "" : "at " + shown(this.rows[row][0], graph.xAxisRange(), panel.x.log);
    panel.series.forEach((one, i) => {
      const value = row < 0 ? null : valueNear(this.rows, row, i, isPoints(one.form) ? 0 : kNearRows), axis = graph.yAxisRange(one.right ? 1 : 0);
      const log = one.right ? panel.right.log : panel.y.log, text = (v) => shown(v, axis, log);
      this.values[i].textContent = !value ? "" : one.form === "band" ? `${text(value[0])} … ${text(value[2])}` : text(value[1]);
    });
    return row;
  }
}

class FigureCharts {
  constructor(figure) {
    const { columns, height, panels } = JSON.parse(figure.querySelector("script").textContent), drawing = figure.querySelector("svg");
    this.charts = panels.map((panel) => new PanelChart(panel, Math.max(120, height - 62), this));
    const grid = el("div", `charts columns${columns}`, ...this.charts.map((chart) => chart.element));
    grid.setAttribute("role", "img");
    grid.setAttribute("aria-label", drawing.getAttribute("aria-label"));
    drawing.after(grid);
    figure.classList.add("charted");
    try {
      for (const chart of this.charts) chart.draw();
    } catch (error) { // the drawing is there
      grid.remove();
      figure.classList.remove("charted");
      throw error;
    }
  }

  /** Panels of one figure over the same quantity go together. */
  beside(chart) {
    return this.charts.filter((one) => one !== chart && one.panel.x.label === chart.panel.x.label && Boolean(one.panel.x.log) === Boolean(chart.panel.x.log));
  }

  pointAt(chart, x) {
    chart.show(x);
    for (const one of this.beside(chart)) {
      const row = one.show(x);
      if (row < 0) one.graph.clearSelection(); else one.graph.setSelection(row);
    }
  }

  zoom(chart, range) {
    for (const one of this.beside(chart)) if (range) one.graph.updateOptions({ dateWindow: range }); else one.graph.resetZoom();
  }
}

// Its legend writes inline styles, and has no place here.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);
const sight = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (!isIntersecting) continue;
    sight.unobserve(target);
    new FigureCharts(target);
  }
}, { rootMargin: "300px" });
for (const data of document.querySelectorAll("figure > script")) sight.observe(data.parentElement);
