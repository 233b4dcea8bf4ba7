// SPDX-License-Identifier: MIT
// The strip charts below each other: one window of time, one cursor, the same marks in all. What is not on the screen is
// not drawn, and no frame of the browser has more of it than it has room for.
import { Chart, kRightGap_px, labelWidth } from "./chart.js";
import { kCharts } from "./chart_list.js";
import { colour, el, setText } from "./dom.js";
import { moment } from "./charts/format.js";
import { listenToGestures } from "./gestures.js";
import { meaningOfSeverity } from "./quality.js";
import { indexAt } from "./steps.js";
import { measured } from "./timing.js";

const kSlice_ms = 3;
const kTick_px = 6; // what dygraphs keeps on both sides of its labels

export class Strips {
  /** `view`: {range(): [from_s, to_s], zoom(from_s, to_s), live()}. */
  constructor(place, view) {
    Object.assign(this, { view, rows: [], step_s: 1, whole: false, events: [], dirty: new Set(), seen: new Set(), cursor_s: null });
    this.time = el("output", { class: "cursor-time", "aria-live": "off" });
    this.line = el("div", { class: "cursor", hidden: true });
    this.element = el("div", { class: "strips", tabindex: "0", role: "group",
      "aria-label": "Charts. Arrow keys move the cursor, with Shift the time; plus and minus zoom; L goes back to now." });
    const hooks = { select: (time_s) => this.pointAt(time_s), underlay: (...args) => this.underlay(...args) };
    this.charts = kCharts.map((spec) => new Chart(spec, hooks));
    this.element.append(...this.charts.map((chart) => chart.element), this.line);
    place.append(this.element);
    this.sight = this.watchSight();
    this.stop = listenToGestures(this.element, (clientX) => this.timeAt(clientX), { ...view, touch: (time_s) => this.pointAt(time_s) });
  }

  /** Where the plots begin and how wide they are, from the strips' left in pixels; asked for once after each change of size, as asking lays the page out. */
  area() {
    this.place ??= this.measure();
    return this.place;
  }

  measure() {
    const plot = this.charts[0].plot, label = labelWidth(plot) + kTick_px;
    return { left: plot.offsetLeft + label, width: Math.max(plot.clientWidth - label - kRightGap_px, 1) };
  }

  timeAt(clientX) {
    const { left, width } = this.area(), [from_s, to_s] = this.view.range();
    return from_s + ((clientX - this.element.getBoundingClientRect().left - left) / width) * (to_s - from_s);
  }

  /** New rows, a new window of time, or new colours: all charts are to be drawn anew. */
  draw(rows, step_s) {
    Object.assign(this, { rows, step_s });
    for (const chart of this.charts) this.dirty.add(chart);
    this.schedule();
  }

  /** The same rows with more behind: of the charts on the screen that share which was not drawn for longest. */
  refresh(rows, step_s, share) {
    Object.assign(this, { rows, step_s });
    const seen = [...this.seen].sort((a, b) => a.drawn_ms - b.drawn_ms);
    for (const chart of seen.slice(0, Math.ceil(seen.length * share))) this.dirty.add(chart);
    for (const chart of this.charts) if (!this.seen.has(chart)) this.dirty.add(chart);
    this.schedule();
  }

  /**
   * Draws what is on the screen, a slice at a time; another chart is due until somebody scrolls there. Not within a frame: what the
   * browser then does with the drawn canvas takes as long again, and a key or a finger comes in between. A hidden page draws nothing.
   */
  schedule() {
    const later = document.hidden ? requestAnimationFrame : setTimeout;
    this.drawing ??= later(() => {
      this.drawing = undefined;
      const end_ms = performance.now() + kSlice_ms, due = [...this.dirty].filter((chart) => this.seen.has(chart));
      while (due.length > 0 && performance.now() < end_ms) this.drawChart(due.shift());
      if (due.length > 0) return this.schedule();
      this.showCursor();
      if (this.whole && this.seen.size > 0) measured("prism-drawn");
    });
  }

  drawChart(chart) {
    const begin_ms = performance.now(), [from_s, to_s] = this.view.range();
    this.dirty.delete(chart);
    chart.drawn_ms = begin_ms;
    Object.assign(this.element.dataset, { from: from_s, to: to_s });
    chart.draw(this.rows, this.step_s, [from_s * 1000, to_s * 1000], this.whole);
    chart.show(this.pointed());
    measured("prism-chart", begin_ms);
  }

  /** All charts as they are now, also those that nobody sees: for a picture. */
  drawAll() {
    for (const chart of this.charts) this.drawChart(chart);
  }

  watchSight() {
    const sight = new IntersectionObserver((changes) => {
      for (const { target, isIntersecting } of changes) {
        const chart = this.charts.find((one) => one.element === target);
        if (isIntersecting) this.seen.add(chart);
        else this.seen.delete(chart);
      }
      this.schedule();
    }, { rootMargin: "100px" });
    for (const chart of this.charts) sight.observe(chart.element);
    return sight;
  }

  /** The rate chart draws these quantities: one of kMeans. */
  useMeans(keys) {
    this.charts[0].use(keys);
  }

  recolour() {
    for (const chart of this.charts) chart.recolour();
  }

  /** The cursor at a time; null: none. */
  pointAt(time_s) {
    if (time_s !== null && !Number.isFinite(time_s)) return;
    this.cursor_s = time_s;
    this.showCursor();
  }

  /** The row whose values stand beside the charts: the last one that is shown, or that of the cursor; none where the cursor is in a hole. */
  pointed() {
    if (this.cursor_s === null) return this.rows.at(-1)?.end_s > this.view.range()[0] ? this.rows.at(-1) : undefined;
    const index = indexAt(this.rows, this.cursor_s);
    return [this.rows[index], this.rows[index + 1]].find((row) => row && Math.abs(row.time_s - this.cursor_s) <= this.step_s);
  }

  /** Cursor, its values and its time belong to one row: they are told anew with each change of the rows and of the window, which may leave it behind. */
  showCursor() {
    const [from_s, to_s] = this.view.range();
    if (this.cursor_s !== null && !(this.cursor_s >= from_s && this.cursor_s <= to_s)) this.cursor_s = null;
    this.placeCursor(from_s, to_s);
    const row = this.pointed();
    for (const chart of this.charts) chart.show(row);
    setText(this.time, this.cursor_s === null ? "" : row ? this.wordsOf(row) : `${moment(this.cursor_s)} UTC · no row`);
  }

  wordsOf(row) {
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

  /** The cursor goes so many rows on; from nowhere, to the last. Answers what a screen reader should say. */
  step(by) {
    const [from_s, to_s] = this.view.range(), rows = this.rows.filter((row) => row.time_s >= from_s && row.time_s <= to_s);
    if (rows.length === 0) return "no data";
    const now = this.cursor_s === null ? rows.length - 1 : indexAt(rows, this.cursor_s) + by;
    this.pointAt(rows[Math.max(0, Math.min(rows.length - 1, now))].time_s);
    return [this.time.textContent, ...this.charts.map((chart) => `${chart.spec.title} ${chart.element.querySelector(".legend").textContent}`)].join("; ");
  }

  /** Below the rate: a bar where seconds were not good, full where none was. */
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

  /** Events as marks: a line over the chart's height, and above it a sign by its severity. */
  underlay(context, area, graph, chart) {
    const [from_s, to_s] = this.view.range();
    if (chart === this.charts[0]) this.underlayQuality(context, area, graph);
    for (const event of this.events) {
      if (event.time_s < from_s || event.time_s > to_s) continue;
      const meaning = meaningOfSeverity(event.severity), x = Math.round(graph.toDomXCoord(event.time_s * 1000)) + 0.5;
      context.strokeStyle = context.fillStyle = colour(meaning === "good" ? "--mark" : `--${meaning}`);
      context.setLineDash([2, 3]);
      context.beginPath();
      context.moveTo(x, area.y);
      context.lineTo(x, area.y + area.h);
      context.stroke();
      context.setLineDash([]);
      context.beginPath();
      if (meaning === "bad") context.rect(x - 3, area.y, 6, 6);
      else if (meaning === "care") { context.moveTo(x, area.y); context.lineTo(x + 4, area.y + 7); context.lineTo(x - 4, area.y + 7); }
      else context.arc(x, area.y + 3, 2.5, 0, 7);
      context.fill();
    }
  }

  describe(words) {
    for (const chart of this.charts) chart.describe(words);
  }

  destroy() {
    this.stop();
    this.sight.disconnect();
    this.seen.clear(); // a slice that is still due finds nothing to draw
    this.cursor_s = null;
    for (const chart of this.charts) chart.destroy();
    this.element.remove();
  }
}
