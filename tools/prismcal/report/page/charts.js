// SPDX-License-Identifier: MIT
// Interactive charts of a report: drag zooms, Shift-drag moves, double-click resets; the values at the cursor are shown as text. A chart is
// drawn when its figure comes near the screen. It replaces the SVG, which is kept for printing.
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

/** Formats a number with the digits that the range of its axis requires. */
const formatted = (value, [low, high], log) => (log ? String(Number(value.toPrecision(4))).replace("-", "\u2212") : fixed(value, Math.min(9, decimalsFor(high - low) + 1)));

function drawBars({ drawingContext: context, points, color, dygraph }) {
  const known = points.filter((point) => Number.isFinite(point.yval)), base = dygraph.toDomYCoord(0);
  const gaps = known.slice(1).map((point, i) => point.canvasx - known[i].canvasx), width = 0.9 * Math.min(...gaps, 40);
  context.fillStyle = color;
  for (const { canvasx, canvasy } of known) context.fillRect(canvasx - width / 2, Math.min(base, canvasy), width, Math.abs(base - canvasy));
}

/** Draws a band without a break at rows that only other series have. */
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

function styleOf(series) {
  const style = { color: series.colour, strokeWidth: isPoints(series.form) ? 0 : series.width, plotter: Dygraph.Plotters.linePlotter };
  if (series.dash) style.strokePattern = series.dash;
  if (series.right) style.axis = "y2";
  if (series.form === "band") style.plotter = drawRange;
  if (series.form === "bars") style.plotter = drawBars;
  if (isPoints(series.form) || series.form === "linepoints") Object.assign(style, { drawPoints: true, pointSize: series.form === "linepoints" ? 2 : 1.6 });
  if (series.form === "open") Object.assign(style, { drawPointCallback: openPoint, pointSize: 2.4 });
  return style;
}

/** dygraphs' interaction without touch, because touch scrolls the page. */
const mouseOnly = () => Object.fromEntries(Object.entries(Dygraph.defaultInteractionModel).filter(([name]) => !name.startsWith("touch")));

const rangeOf = ({ min, max }) => (min === undefined && max === undefined ? null : [min ?? null, max ?? null]);

class PanelChart {
  constructor(panel, height_px, figure) {
    Object.assign(this, { panel, figure, rows: tableOf(panel.series) });
    this.values = panel.series.map(() => el("span", "value"));
    this.at = el("span", "at");
    const keys = panel.series.flatMap((series, i) => (series.name ? [this.keyOf(series, i)] : series.form === "band" ? [] : [el("li", "", this.values[i])]));
    this.plot = el("div", "plot");
    this.plot.style.height = `${height_px}px`;
    this.element = el("div", "panel", el("div", "head", el("b", "", panel.title), el("span", "unit", panel.y.label), el("ul", "keys", ...keys)), this.plot,
      el("div", "foot", this.at, el("span", "unit", panel.x.label)));
  }

  keyOf(series, i) {
    const swatch = el("i", series.form);
    swatch.style.color = series.colour;
    return el("li", "", swatch, series.right ? `${series.name} (right, ${this.panel.right.label}) ` : `${series.name} `, this.values[i]);
  }

  /** Call after the element is added to the page, because it then has a width. */
  draw() {
    const { panel } = this, names = panel.series.map((series, i) => `${i}`), ticks = (axis) => (low, high, px) => (axis.log ? decadesOf(low, high) : ticksOf(low, high, px / 40));
    const wide = { ticker: (low, high, px) => (panel.x.log ? decadesOf(low, high) : ticksOf(low, high, px / 90)), logscale: Boolean(panel.x.log), axisLabelWidth: 60 };
    this.graph = new Dygraph(this.plot, this.rows, {
      labels: ["x", ...names], customBars: true, connectSeparatedPoints: true, fillAlpha: 0.22, legend: "never", labelsUTC: true,
      gridLineColor: kGrid, axisLineColor: "#9ca3af", gridLineWidth: 1, axisLabelFontSize: 12, rightGap: 14, yRangePad: 6, xRangePad: panel.x.log ? 0 : 4,
      highlightCircleSize: 3, interactionModel: mouseOnly(), animatedZooms: false, includeZero: panel.series.some((series) => series.form === "bars"),
      series: Object.fromEntries(panel.series.map((series, i) => [names[i], styleOf(series)])),
      axes: { x: wide, y: { ticker: ticks(panel.y), logscale: Boolean(panel.y.log), axisLabelWidth: 66, valueRange: rangeOf(panel.y) },
        y2: { ticker: ticks(panel.right), logscale: Boolean(panel.right.log), axisLabelWidth: 60, valueRange: rangeOf(panel.right), drawGrid: false, independentTicks: true } },
      ...(panel.x.min !== undefined && panel.x.max !== undefined && { dateWindow: [panel.x.min, panel.x.max] }),
      highlightCallback: (event, x) => this.figure.pointAt(this, x), unhighlightCallback: () => this.figure.pointAt(this, null),
      zoomCallback: (low, high) => this.figure.zoom(this, this.graph.isZoomed("x") ? [low, high] : null),
    });
    this.show(null);
  }

  /** Shows the values of the row nearest to x and returns its index; null hides them and returns -1. */
  show(x) {
    const row = x === null ? -1 : nearestRow(this.rows, x), { graph, panel } = this;
    this.at.textContent = row < 0 ? "" : "at " + formatted(this.rows[row][0], graph.xAxisRange(), panel.x.log);
    panel.series.forEach((series, i) => {
      const value = row < 0 ? null : valueNear(this.rows, row, i, isPoints(series.form) ? 0 : kNearRows), axis = graph.yAxisRange(series.right ? 1 : 0);
      const log = series.right ? panel.right.log : panel.y.log, text = (v) => formatted(v, axis, log);
      this.values[i].textContent = !value ? "" : series.form === "band" ? `${text(value[0])} … ${text(value[2])}` : text(value[1]);
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
    } catch (error) { // shows the SVG again
      grid.remove();
      figure.classList.remove("charted");
      throw error;
    }
  }

  /** The other panels of the figure with the same x axis: their zoom and cursor are linked. */
  linked(chart) {
    return this.charts.filter((other) => other !== chart && other.panel.x.label === chart.panel.x.label && Boolean(other.panel.x.log) === Boolean(chart.panel.x.log));
  }

  pointAt(chart, x) {
    chart.show(x);
    for (const other of this.linked(chart)) {
      const row = other.show(x);
      if (row < 0) other.graph.clearSelection(); else other.graph.setSelection(row);
    }
  }

  zoom(chart, range) {
    for (const other of this.linked(chart)) if (range) other.graph.updateOptions({ dateWindow: range }); else other.graph.resetZoom();
  }
}

// Removes the legend of dygraphs, because it writes inline styles.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);
const visibility = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (!isIntersecting) continue;
    visibility.unobserve(target);
    new FigureCharts(target);
  }
}, { rootMargin: "300px" });
for (const data of document.querySelectorAll("figure > script")) visibility.observe(data.parentElement);
