// SPDX-License-Identifier: MIT
// The strip charts, with a common time range, cursor and event marks. Charts outside the screen are not drawn; drawing is divided into
// short slices so that the page stays responsive.
import { Chart, kCharts, sensorChart } from "./chart.js";
import { colour, el, measured, setText } from "./dom.js";
import { moment } from "./format.js";
import { listenToGestures } from "./gestures.js";
import { levelOfSeverity } from "./state.js";
import { indexAt, sensorKey } from "./steps.js";

const kSlice_ms = 3;
/** Averaging time "1 s": the rates of the rate chart. */
const kBySecond = { raw: "raw_1s", corrected: "corrected_1s" };
/** Quantities of a compared axis, one for each chart, and their bands. */
export const kCompared = ["corrected", "corrected_1s", "bias", "sd", "temperature", "slope", "uhfo", "samples"];
export const kComparedColours = ["--second", "--third", "--fourth"];

export class Strips {
  /** `empty`: text of a chart without data; "" until the rows are loaded. `view`: {range(): [from_s, to_s], zoom(from_s, to_s), live(), changed()}; changed() is called if the user adds a curve. */
  constructor(parent, view) {
    Object.assign(this, { view, rows: [], step_s: 1, empty: "", events: [], dirty: new Set(), visible: new Set(), cursor_s: null });
    this.time = el("output", { class: "cursor-time", "aria-live": "off" });
    this.line = el("div", { class: "cursor", hidden: true });
    this.element = el("div", { class: "strips", tabindex: "0", role: "group",
      "aria-label": "Charts. Arrow keys move the cursor, with Shift the time; plus and minus zoom; L returns to now." });
    this.hooks = { select: (time_s) => this.pointAt(time_s), underlay: (...args) => this.underlay(...args), changed: view.changed };
    this.charts = kCharts.map((spec) => new Chart(spec, this.hooks));
    this.element.append(...this.charts.map((chart) => chart.element), this.line);
    parent.append(this.element);
    this.observer = this.observeVisibility();
    this.stop = listenToGestures(this.element, (clientX) => this.timeAt(clientX), { ...view, touch: (time_s) => this.pointAt(time_s),
      values: (plot, heights) => this.charts.find((chart) => chart.plot === plot)?.zoomValues(heights) });
  }

  /** Adds a chart for each of `sensors`, [name, unit], that has none, above the last one. Returns the added charts. */
  addSensors(sensors) {
    const specs = sensors.map(([name, unit]) => sensorChart(sensorKey(name), name, unit)).filter(({ key }) => !this.charts.some(({ spec }) => spec.key === key));
    const added = specs.map((spec) => new Chart(spec, this.hooks));
    this.charts.splice(-1, 0, ...added);
    this.charts.at(-1).element.before(...added.map(({ element }) => element));
    for (const { element } of added) this.observer.observe(element);
    return added;
  }

  /** Sets the curves of all charts: means of 1 s or of a window, and the names of the compared axes ("gyro2 x"). */
  setCurves(bySecond, compared) {
    const keyOf = ({ key }) => (bySecond && kBySecond[key]) || key, hasRight = this.charts.some(({ more }) => more);
    for (const chart of this.charts) {
      const own = chart.spec.series.map((one) => ({ ...one, key: keyOf(one) }));
      const others = compared.flatMap((name, i) => own.filter(({ key }) => kCompared.includes(key))
        .map((one) => ({ ...one, key: `${one.key} ${name}`, band: one.band && `${one.band} ${name}`, label: name, colour: kComparedColours[i] })));
      chart.setSeries([...own, ...others], hasRight);
    }
    this.plotArea = undefined;
  }

  /** Left edge (from that of the strips) and width of the plots, px. Measured once after each change of size: it forces a layout. */
  area() {
    this.plotArea ??= this.charts[0].area();
    return this.plotArea;
  }

  timeAt(clientX) {
    const { left, width } = this.area(), [from_s, to_s] = this.view.range();
    return from_s + ((clientX - this.element.getBoundingClientRect().left - left) / width) * (to_s - from_s);
  }

  /** Redraws all charts, after a change of rows, time range or colours. */
  draw(rows, step_s) {
    Object.assign(this, { rows, step_s });
    for (const chart of this.charts) {
      this.dirty.add(chart);
      if (chart.element.hidden) chart.element.hidden = !rows.some((row) => chart.series.some(({ key }) => row[key]));
    }
    this.schedule();
  }

  /**
   * Draws the visible charts in slices; the others are drawn when they become visible. Uses timers instead of frames, because the browser
   * needs as long again for the canvas, and input is handled in between. A hidden page does not draw.
   */
  schedule() {
    const later = document.hidden ? requestAnimationFrame : setTimeout;
    this.drawTimer ??= later(() => {
      this.drawTimer = undefined;
      const end_ms = performance.now() + kSlice_ms, due = [...this.dirty].filter((chart) => this.visible.has(chart));
      while (due.length > 0 && performance.now() < end_ms) this.drawChart(due.shift());
      if (due.length > 0) return this.schedule();
      this.showCursor();
      if (this.empty && this.visible.size > 0) measured("prism-drawn");
    });
  }

  drawChart(chart) {
    const begin_ms = performance.now(), [from_s, to_s] = this.view.range();
    this.dirty.delete(chart);
    Object.assign(this.element.dataset, { from: from_s, to: to_s });
    chart.draw(this.rows, this.step_s, [from_s * 1000, to_s * 1000], this.empty);
    chart.show(this.selectedRow());
    measured("prism-chart", begin_ms);
  }

  /** Call before and after printing, and after the colours changed. Print has the width of a sheet, and charts that were not visible. */
  restyle(isPrinted) {
    this.element.classList.toggle("printed", isPrinted);
    this.plotArea = undefined;
    for (const chart of this.charts) {
      chart.restyle(isPrinted);
      if (isPrinted) this.drawChart(chart);
    }
  }

  observeVisibility() {
    const observer = new IntersectionObserver((changes) => {
      for (const { target, isIntersecting } of changes) {
        const chart = this.charts.find((one) => one.element === target);
        if (isIntersecting) this.visible.add(chart);
        else this.visible.delete(chart);
      }
      this.schedule();
    }, { rootMargin: "100px" });
    for (const chart of this.charts) observer.observe(chart.element);
    return observer;
  }

  /** Sets the time of the cursor; null hides it. */
  pointAt(time_s) {
    if (time_s !== null && !Number.isFinite(time_s)) return;
    this.cursor_s = time_s;
    this.showCursor();
  }

  /** The row whose values are shown: at the cursor, or the last one without a cursor; undefined if the cursor is in a gap. */
  selectedRow() {
    if (this.cursor_s === null) return this.rows.at(-1)?.end_s > this.view.range()[0] ? this.rows.at(-1) : undefined;
    const index = indexAt(this.rows, this.cursor_s);
    return [this.rows[index], this.rows[index + 1]].find((row) => row && Math.abs(row.time_s - this.cursor_s) <= this.step_s);
  }

  /** Updates the cursor, its values and its time. Call after each change of rows or range. Hides a cursor outside the range. */
  showCursor() {
    const [from_s, to_s] = this.view.range();
    if (this.cursor_s !== null && !(this.cursor_s >= from_s && this.cursor_s <= to_s)) this.cursor_s = null;
    this.placeCursor(from_s, to_s);
    const row = this.selectedRow();
    for (const chart of this.charts) chart.show(row);
    setText(this.time, this.cursor_s === null ? "" : row ? this.textOf(row) : `${moment(this.cursor_s)} UTC · no row`);
  }

  textOf(row) {
    const near = this.events.filter((event) => Math.abs(event.time_s - row.time_s) <= this.step_s);
    return [moment(row.time_s) + " UTC", `${row.good} of ${row.seconds} s good`, ...near.map((event) => event.text)].join(" · ");
  }

  placeCursor(from_s, to_s) {
    this.element.classList.toggle("pointed", this.cursor_s !== null);
    this.line.hidden = this.cursor_s === null;
    if (this.cursor_s === null) return;
    const { left, width } = this.area();
    this.line.style.transform = `translateX(${left + ((this.cursor_s - from_s) / (to_s - from_s)) * width}px)`;
  }

  /** Moves the cursor by `by` rows, or to the last row if it is hidden. Returns a text for screen readers. */
  step(by) {
    const [from_s, to_s] = this.view.range(), rows = this.rows.filter((row) => row.time_s >= from_s && row.time_s <= to_s);
    if (rows.length === 0) return "no data";
    const index = this.cursor_s === null ? rows.length - 1 : indexAt(rows, this.cursor_s) + by;
    this.pointAt(rows[Math.max(0, Math.min(rows.length - 1, index))].time_s);
    return [this.time.textContent, ...this.charts.map((chart) => `${chart.spec.title} ${chart.element.querySelector(".legend").textContent}`)].join("; ");
  }

  /** Draws a bar below the rate for steps with seconds that were not good; its height is their fraction. */
  underlayQuality(context, area, graph) {
    context.fillStyle = colour("--care");
    for (const row of this.rows) {
      const share = row.seconds > 0 ? 1 - row.good / row.seconds : 0;
      if (share <= 0) continue;
      const [left, right] = [row.end_s - this.step_s, row.end_s].map((time_s) => graph.toDomXCoord(time_s * 1000));
      const height = 2 + 5 * share;
      context.fillRect(left, area.y + area.h - height, Math.max(right - left, 1), height);
    }
  }

  /** Draws events: a line over the height of the chart, and a mark for the severity at its top. */
  underlay(context, area, graph, chart) {
    const [from_s, to_s] = this.view.range();
    if (chart === this.charts[0]) this.underlayQuality(context, area, graph);
    for (const event of this.events) {
      if (event.time_s < from_s || event.time_s > to_s) continue;
      const level = levelOfSeverity(event.severity), x = Math.round(graph.toDomXCoord(event.time_s * 1000)) + 0.5;
      context.strokeStyle = context.fillStyle = colour(level === "good" ? "--mark" : `--${level}`);
      context.setLineDash([2, 3]);
      context.beginPath();
      context.moveTo(x, area.y);
      context.lineTo(x, area.y + area.h);
      context.stroke();
      context.setLineDash([]);
      context.beginPath();
      if (level === "bad") context.rect(x - 3, area.y, 6, 6);
      else if (level === "care") { context.moveTo(x, area.y); context.lineTo(x + 4, area.y + 7); context.lineTo(x - 4, area.y + 7); }
      else context.arc(x, area.y + 3, 2.5, 0, 7);
      context.fill();
    }
  }

  describe(text) {
    for (const chart of this.charts) chart.describe(text);
  }

  destroy() {
    this.stop();
    this.observer.disconnect();
    this.visible.clear(); // a pending slice then draws no chart
    this.cursor_s = null;
    for (const chart of this.charts) chart.destroy();
    this.element.remove();
  }
}
