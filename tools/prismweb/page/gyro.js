// SPDX-License-Identifier: MIT
// The view of one axis: numbers, strip charts, training domain, line counters, events.
import { kMeans, kSpans } from "./chart_list.js";
import { makeDomain } from "./domain.js";
import { el, setText } from "./dom.js";
import { makeEvents } from "./events.js";
import { fileName, moment, span } from "./charts/format.js";
import { makeLinePanel } from "./line_panel.js";
import { makeNumbers } from "./numbers.js";
import { LiveRows } from "./live_rows.js";
import { loadRange } from "./range.js";
import { saveCsv, savePng } from "./save.js";
import { statusOf, modelName } from "./state.js";
import { stepFor } from "./steps.js";
import { Strips } from "./strips.js";
import { TimeView } from "./time_view.js";

const kMoveDelay_ms = 150, kMaxOffset_s = 5, kTick_ms = 900, kSlowest_s = 15, kRetry_ms = 5000;
const kReload_ms = 1500;
const kMaxRows = 5000; // limit of `range`

export class GyroView {
  /** `announce(text)` sends a text to screen readers. */
  constructor(parent, { socket, gyro, axis, announce }) {
    Object.assign(this, { socket, gyro, axis, announce, requests: 0, drawn_ms: 0 });
    this.rows = new LiveRows({ reloadSoon: () => this.reloadSoon(), discard: () => this.requests++ });
    this.current = { time_s: Date.now() / 1000, at_ms: performance.now() };
    this.view = new TimeView(3600, () => this.current.time_s + (this.current.isFixed ? 0 : (performance.now() - this.current.at_ms) / 1000), () => this.rangeChanged());
    this.build(parent);
    this.reload();
  }

  build(parent) {
    this.numbers = makeNumbers();
    this.spans = kSpans.map(([span_s, name]) => el("button", { type: "button", click: () => this.setSpan(span_s) }, name));
    const tool = (name, label, act) => el("button", { type: "button", "aria-label": label, title: label, click: act }, name);
    this.now = el("button", { type: "button", class: "now", click: () => this.goLive() }, "now");
    this.means = tool("means: window", "switch between 1 s means and means of the model's window", () => this.switchMeans());
    this.busy = el("p", { class: "busy", role: "status" });
    this.files = [tool("PNG", "save the charts as a picture", () => this.savePng()), tool("CSV", "save the charts' rows as a table", () => this.saveCsv())];
    const tools = el("div", { class: "tools", role: "toolbar", "aria-label": "time and files" }, el("div", { class: "group spans" }, ...this.spans),
      el("div", { class: "group" }, tool("◀", "earlier", () => this.view.pan(-0.5)), tool("▶", "later", () => this.view.pan(0.5)),
        tool("+", "zoom in", () => this.view.scale(0.5)), tool("−", "zoom out", () => this.view.scale(2)), this.now),
      el("div", { class: "group" }, this.means), el("div", { class: "group" }, ...this.files));
    const left = el("div", { class: "left" }), panel = (title, ...children) => el("section", { class: "panel" }, el("h2", {}, title), ...children);
    const domain = el("div");
    this.line = makeLinePanel();
    this.events = makeEvents((time_s) => this.lookAt(time_s));
    const right = el("aside", { class: "right" }, panel("Training domain", domain), panel("Line", this.line.element));
    this.element = el("div", { class: "gyro" }, this.numbers.element, tools, el("div", { class: "columns" }, left, right));
    parent.append(this.element);
    const head = el("div", { class: "strip-head" });
    left.append(head);
    this.strips = new Strips(left, { range: () => this.view.range(), zoom: (from_s, to_s) => this.view.zoom(from_s, to_s), live: () => this.goLive() });
    head.append(this.strips.time, this.busy);
    left.append(panel("Events", this.events.element));
    this.domain = makeDomain(domain);
    this.strips.events = this.gyro.events;
    this.observer = new ResizeObserver(() => {
      this.strips.plotArea = undefined;
      this.draw();
    });
    this.observer.observe(left);
    this.showSpan();
  }

  setSpan(span_s) {
    this.view.setSpan(span_s);
    this.announce(`span ${span(span_s)}`);
  }

  showSpan() {
    this.spans.forEach((button, i) => button.setAttribute("aria-pressed", String(kSpans[i][0] === this.view.span_s)));
    this.now.setAttribute("aria-pressed", String(this.view.isLive));
  }

  /** Sets whether the rows of the shown range are loaded. Until then they cannot be saved, and empty charts do not show "no data". */
  setComplete(complete) {
    this.strips.complete = complete;
    for (const button of this.files) button.disabled = !complete;
  }

  goLive() {
    this.strips.pointAt(null);
    this.view.live();
  }

  /** Call after a change of the time range. Draws the loaded rows; requests the others, in a series after its first and last change. */
  rangeChanged() {
    this.showSpan();
    this.setComplete(false);
    this.draw();
    clearTimeout(this.moveTimer);
    const since_ms = performance.now() - (this.moved_ms ?? 0);
    this.moved_ms = performance.now();
    this.moveTimer = setTimeout(() => this.reload(), since_ms > 3 * kMoveDelay_ms ? 0 : kMoveDelay_ms);
  }

  /** Reloads once after a delay. Further calls do not postpone it, because they may come each second. */
  reloadSoon() {
    this.reloadTimer ??= setTimeout(() => this.reload(), kReload_ms);
  }

  async reload() {
    clearTimeout(this.reloadTimer);
    this.reloadTimer = undefined;
    this.setComplete(false);
    const request = ++this.requests, [from_s, to_s] = this.view.range(), length_s = to_s - from_s + this.length_s();
    const rows = Math.max(200, Math.min(600, Math.round(this.strips.area().width / 2)));
    this.strips.element.setAttribute("aria-busy", "true");
    try {
      // starts one window earlier, so that the first running mean is complete; rows of 1 s if possible, because they have means
      const result = await loadRange(this.socket, this.gyro.name, this.axis.name, to_s - length_s, to_s, length_s < kMaxRows - 2 ? kMaxRows : rows);
      if (request === this.requests) this.take(result, stepFor(length_s, rows));
    } catch (error) {
      if (request !== this.requests) return;
      setText(this.busy, `rows: ${error.message}`);
      clearTimeout(this.retryTimer);
      this.retryTimer = setTimeout(() => this.reload(), kRetry_ms);
    } finally {
      if (request === this.requests) this.strips.element.setAttribute("aria-busy", "false");
    }
  }

  /** Length of the model's window and of the running means. */
  length_s() {
    return this.axis.window_s ?? 100;
  }

  take({ steps, last_s, known_s, building, problem }, step_s) {
    this.last_s = last_s;
    this.setComplete(true);
    this.rows.take(steps, known_s, step_s, this.view.isLive);
    const unbuilt = typeof building === "number" && building < 1, middle = "Band: minimum and maximum second of each step; line: their middle.";
    const progress = unbuilt ? `Building the long view: ${Math.floor(100 * building)} % of the log read.` : steps.hasMeans ? "" : middle;
    setText(this.busy, problem ? `Minutes and hours are not stored: ${problem}. ${progress}` : progress);
    clearTimeout(this.retryTimer);
    if (unbuilt || problem) this.retryTimer = setTimeout(() => this.reload(), unbuilt ? 2000 : 5000);
    this.draw();
    const [from_s, to_s] = this.view.range(), shown = this.rows.steps.rows.filter((row) => row.time_s > from_s).length;
    this.strips.describe(`${span(this.view.span_s)} until ${this.view.isLive ? "now" : `${moment(to_s)} UTC`}, ${shown} ${shown === 1 ? "row" : "rows"} of ${span(this.rows.steps.step_s)}`);
  }

  /** Adds a live second. */
  window(row) {
    if (!this.rows.window(row, this.view.isLive)) return;
    if (!this.anchored) this.anchor(row.time_s);
    this.current = { time_s: row.time_s + 1, at_ms: performance.now() };
    if (this.view.isLive) this.forget(row.time_s);
  }

  /** Removes old rows. Also required in a hidden tab, which does not draw. */
  forget(to_s) {
    this.rows.forget(to_s - this.view.span_s - this.length_s());
  }

  /** Call after a sleep of the computer, which the steady clock does not count. */
  slept(ms) {
    this.current.at_ms -= ms;
  }

  /** Moves a live view to the current time: redraws each chart when it has moved by a pixel, one chart after the other. */
  tick() {
    const since_ms = performance.now() - this.drawn_ms;
    if (!this.view.isLive || since_ms < kTick_ms) return;
    const to_s = this.view.range()[1], pixel_s = Math.min(kSlowest_s, this.view.span_s / this.strips.area().width);
    const share = Math.min(1, Math.abs(to_s - this.drawn_to_s) / pixel_s);
    Object.assign(this, { drawn_ms: performance.now(), drawn_to_s: to_s });
    this.forget(to_s);
    this.rows.steps.run(this.length_s());
    this.strips.refresh(this.rows.steps.rows, this.rows.steps.step_s, share);
  }

  /** Averaging time of the rate chart's curves. */
  meansLabel() {
    if (this.bySecond) return "1 s";
    return this.rows.steps.step_s > this.length_s() ? span(this.rows.steps.step_s) : "window";
  }

  draw() {
    setText(this.means, `means: ${this.meansLabel()}`);
    Object.assign(this, { drawn_ms: performance.now(), drawn_to_s: this.view.range()[1] });
    this.rows.steps.run(this.length_s());
    this.strips.draw(this.rows.steps.rows, this.rows.steps.step_s);
  }

  /** Updates numbers, domain and events. */
  update(linked, now_ms) {
    const status = statusOf(this.gyro, this.axis, linked, now_ms);
    const known_s = this.axis.window?.time_s ?? this.last_s;  // without a window: the last row of the log
    if (!this.anchored && this.gyro.status?.clock === "device" && Number.isFinite(known_s)) this.anchor(known_s, true);
    this.numbers.draw(this.gyro, this.axis, status, now_ms);
    const id = this.model === undefined ? "not known" : this.model?.id ?? null;
    if (this.shownModel !== id) {
      this.shownModel = id;
      this.domain.show(this.model);
    }
    this.domain.draw(status.old ? null : this.axis.window, this.rows.steps.rows);
    this.events.draw(this.gyro.events);
    this.element.classList.toggle("old", status.old);
    this.tick();
  }

  /** Sets the current time from a row, because a device's clock may differ from this computer's. `isFixed`: constant until the next row. */
  anchor(time_s, isFixed = false) {
    this.anchored = true;
    const offset_s = Math.abs(time_s + 1 - this.view.now());
    this.current = { time_s: time_s + 1, at_ms: performance.now(), isFixed };
    if (offset_s > kMaxOffset_s) this.rangeChanged();
  }

  switchMeans() {
    this.bySecond = !this.bySecond;
    this.strips.useMeans(kMeans[this.bySecond ? "second" : "window"]);
    this.draw();
  }

  lookAt(time_s) {
    this.view.zoom(time_s - this.view.span_s / 2, time_s + this.view.span_s / 2);
    this.strips.pointAt(time_s);
  }

  about() {
    const [from_s, to_s] = this.view.range(), { name, status } = this.gyro;
    return [`${name} axis ${this.axis.name}${status?.gyro_serial ? `, gyro ${status.gyro_serial}` : ""}, model ${modelName(this.axis)}`,
      `${moment(from_s)} to ${moment(to_s)} UTC, rows of ${span(this.rows.steps.step_s)}`];
  }

  fileName() {
    return fileName(`${this.gyro.name}-${this.axis.name}-${moment(this.view.range()[1]).replace(" ", "T").replaceAll(":", "")}`);
  }

  saveCsv() {
    const [from_s, to_s] = this.view.range(), rows = this.rows.steps.rows.filter((row) => row.time_s > from_s && row.time_s <= to_s);
    saveCsv(this.fileName(), rows, this.rows.steps.step_s, this.about(), this.rows.steps.parts);
    this.announce("table saved");
  }

  savePng() {
    const [name, time] = this.about(), means = this.meansLabel();
    savePng(this.fileName(), this.strips, [name, `${time}, rates: means of ${means === "window" ? span(this.length_s()) : means}`]);
    this.announce("picture saved");
  }

  /** Handles a key of the charts. Returns false for another key. */
  key(event) {
    const digit = Number(event.key);
    if (digit >= 1 && digit <= kSpans.length) this.setSpan(kSpans[digit - 1][0]);
    else if (event.key === "+" || event.key === "=") this.view.scale(0.5);
    else if (event.key === "-") this.view.scale(2);
    else if (event.key === "l" || event.key === "L") this.goLive();
    else if (event.key === "m" || event.key === "M") this.switchMeans();
    else if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
      const by = event.key === "ArrowLeft" ? -1 : 1;
      if (event.shiftKey) this.view.pan(0.25 * by);
      else this.announce(this.strips.step(by));
    } else if (event.key === "Escape" && this.strips.cursor_s !== null) this.strips.pointAt(null);
    else return false;
    return true;
  }

  destroy() {
    this.observer.disconnect();
    this.requests++; // discards pending results
    for (const timer of [this.moveTimer, this.reloadTimer, this.retryTimer]) clearTimeout(timer);
    this.strips.destroy();
    this.element.remove();
  }
}
