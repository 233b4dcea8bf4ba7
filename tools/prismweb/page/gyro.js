// SPDX-License-Identifier: MIT
// The view of one axis: numbers, strip charts, inputs of the model, line counters, events.
import { el, setText } from "./dom.js";
import { fileName, moment, parseMoment, period, span, unitText } from "./format.js";
import { makeEvents, makeInputs, makeLinePanel, makeNumbers } from "./panels.js";
import { LiveRows, loadRange, saveCsv } from "./rows.js";
import { statusOf, modelName } from "./state.js";
import { stepFor } from "./steps.js";
import { kCompared, kComparedColours, Strips } from "./strips.js";
import { TimeView } from "./time_view.js";

const kMoveDelay_ms = 150, kMaxOffset_s = 5, kTick_ms = 900, kSlowest_s = 15, kRetry_ms = 5000, kReload_ms = 1500;
const kSpan_s = 3600, kMaxRows = 5000; // limit of `range`
const kSpans = [[60, "1 min"], [300, "5 min"], [1200, "20 min"], [3600, "1 h"], [21600, "6 h"], [86400, "24 h"], [604800, "7 d"], [2592000, "30 d"], [31536000, "365 d"]];

export class GyroView {
  /**
   * `query`: the part of the address after "?", which moved(query) gets after each change. `gyros`: all gyros by name, for comparison.
   * `announce(text)` sends a text to screen readers.
   */
  constructor(parent, { socket, gyro, axis, gyros, query, moved, announce }) {
    Object.assign(this, { socket, gyro, axis, gyros, moved, announce, requests: 0, drawn_ms: 0, name: `${gyro.name} ${axis.name}` });
    this.rows = this.makeRows();
    this.lines = new Map([[this.name, this.rows]]); // of this axis and of those compared with it, by name
    this.current = { time_s: Date.now() / 1000, at_ms: performance.now() };
    this.view = new TimeView(kSpan_s, () => this.current.time_s + (this.current.isFixed ? 0 : (performance.now() - this.current.at_ms) / 1000), () => this.rangeChanged());
    this.build(parent);
    this.takeQuery(new URLSearchParams(query));
    this.reload();
  }

  makeRows() {
    return new LiveRows({ reloadSoon: () => this.reloadSoon(), discard: () => this.requests++ });
  }

  /** Shows the time range and the curves of an address. */
  takeQuery(query) {
    this.asked = query;
    const [from_s, to_s] = ["from", "to"].map((name) => parseMoment(query.get(name) ?? "")), last_s = Number(query.get("last"));
    if (to_s > from_s) this.view.set(to_s - from_s, to_s);
    else if (last_s > 0) this.view.set(last_s, null);
    for (const name of query.getAll("with").slice(0, kComparedColours.length)) this.lines.set(name, this.makeRows());
    for (const chart of this.strips.charts) chart.more = query.get(chart.spec.key) ?? "";
    this.bySecond = query.get("means") === "1s";
    this.showCurves();
    this.showSpan();
  }

  /** The address of this time range and these curves. */
  query() {
    const [from, to] = this.view.range().map((time_s) => `${moment(Math.round(time_s)).replace(" ", "T")}Z`), { isLive, span_s } = this.view;
    const parts = !isLive ? [`from=${from}`, `to=${to}`] : span_s === kSpan_s ? [] : [`last=${Math.round(span_s)}`];
    parts.push(...this.compared().map((name) => `with=${encodeURIComponent(name)}`), ...(this.bySecond ? ["means=1s"] : []));
    return [...parts, ...this.strips.charts.filter(({ more }) => more).map(({ spec, more }) => `${spec.key}=${more}`)].join("&");
  }

  /** Names of the compared axes. */
  compared() {
    return [...this.lines.keys()].slice(1);
  }

  build(parent) {
    this.numbers = makeNumbers();
    this.spans = kSpans.map(([span_s, name]) => el("button", { type: "button", click: () => this.setSpan(span_s) }, name));
    const tool = (name, label, act) => el("button", { type: "button", "aria-label": label, title: label, click: act }, name);
    this.now = el("button", { type: "button", class: "now", click: () => this.goLive() }, "now");
    this.means = tool("means: window", "switch between 1 s means and means of the model's window", () => this.switchMeans());
    this.busy = el("p", { class: "busy", role: "status" });
    this.file = tool("CSV", "save the charts' rows as a table", () => this.saveCsv());
    const field = (label) => el("input", { type: "text", size: 19, spellcheck: "false", "aria-label": `${label}, UTC`, title: `${label}, UTC: a time as 2026-11-23 14:03:09, or now`, change: () => this.typed() });
    [this.from, this.to] = [field("from"), field("to")];
    this.others = el("select", { "aria-label": "compare with another axis", change: () => this.compare(this.others.value) });
    const tools = el("div", { class: "tools", role: "toolbar", "aria-label": "time, curves and files" }, el("div", { class: "group spans" }, ...this.spans),
      el("div", { class: "group" }, tool("◀", "earlier", () => this.view.pan(-0.5)), tool("▶", "later", () => this.view.pan(0.5)),
        tool("+", "zoom in", () => this.view.scale(0.5)), tool("−", "zoom out", () => this.view.scale(2)), this.now),
      el("div", { class: "group times" }, el("label", {}, "from ", this.from), el("label", {}, "to ", this.to), el("span", { class: "unit" }, "UTC")),
      el("div", { class: "group" }, this.means, this.others, this.file));
    const left = el("div", { class: "left" }), panel = (title, ...children) => el("section", { class: "panel" }, el("h2", {}, title), ...children);
    this.inputs = makeInputs();
    this.line = makeLinePanel();
    this.events = makeEvents((time_s) => this.lookAt(time_s));
    const right = el("aside", { class: "right" }, panel("Inputs of the model", this.inputs.element), panel("Line", this.line.element));
    this.element = el("div", { class: "gyro" }, this.numbers.element, tools, el("div", { class: "columns" }, left, right));
    parent.append(this.element);
    const head = el("div", { class: "strip-head" });
    left.append(head);
    this.strips = new Strips(left, { range: () => this.view.range(), zoom: (from_s, to_s) => this.view.zoom(from_s, to_s), live: () => this.goLive(),
      changed: () => this.curvesChanged() });
    this.period = el("p", { class: "period" });
    this.toLast = el("button", { type: "button", class: "auto", hidden: true, click: () => this.view.zoom(this.last_s - this.view.span_s, this.last_s) });
    head.append(this.period, this.toLast, this.strips.time, this.busy);
    left.append(panel("Events", this.events.element));
    this.strips.events = this.gyro.events;
    this.observer = new ResizeObserver(() => {
      this.strips.plotArea = undefined;
      this.draw();
    });
    this.observer.observe(left);
  }

  setSpan(span_s) {
    this.view.setSpan(span_s);
    this.announce(`span ${span(span_s)}`);
  }

  /** Shows the range in buttons, fields and text. */
  showSpan() {
    this.spans.forEach((button, i) => button.setAttribute("aria-pressed", String(kSpans[i][0] === this.view.span_s)));
    this.now.setAttribute("aria-pressed", String(this.view.isLive));
    this.isWrong = false;
    this.showTimes();
  }

  /** Shows the range as text and in the two fields, unless the user is typing there. */
  showTimes() {
    const [from_s, to_s] = this.view.range();
    setText(this.period, period(from_s, to_s));
    if (this.isWrong || [this.from, this.to].includes(document.activeElement)) return;
    [this.from.value, this.to.value] = [moment(from_s), this.view.isLive ? "now" : moment(to_s)];
  }

  /** Shows the range of the two fields. A time to come is now. */
  typed() {
    const now_s = this.view.now(), from_s = parseMoment(this.from.value), to_s = this.to.value.trim() === "now" ? now_s : Math.min(parseMoment(this.to.value), now_s);
    this.isWrong = !(to_s > from_s);
    if (this.isWrong) return setText(this.busy, `Found "${this.from.value}" to "${this.to.value}", expected two times as 2026-11-23 14:03:09, the later one second, or "now".`);
    this.view.set(to_s - from_s, to_s === now_s ? null : to_s);
    this.rangeChanged();
  }

  /** Shows a text about the rows, unless there is one about the fields. */
  note(text) {
    if (!this.isWrong) setText(this.busy, text);
  }

  /** Compares with another axis, or no longer, if it is compared already. */
  compare(name) {
    if (!this.lines.delete(name)) this.lines.set(name, this.makeRows());
    this.curvesChanged();
    this.reload();
  }

  curvesChanged() {
    this.showCurves();
    this.moved(this.query());
    this.draw();
  }

  showCurves() {
    this.strips.setCurves(this.bySecond, this.compared());
    this.shownOthers = undefined;
  }

  /** Lists the axes to compare with. */
  listOthers() {
    const all = [...this.gyros.values()].flatMap((gyro) => [...gyro.axes.keys()].map((axis) => `${gyro.name} ${axis}`)), compared = this.compared();
    const names = all.filter((name) => compared.includes(name) || (name !== this.name && compared.length < kComparedColours.length)).join("\n");
    if (this.shownOthers === names) return;
    this.shownOthers = names;
    this.others.replaceChildren(el("option", { value: "" }, "compare with …"), ...names.split("\n").map((name) => el("option", { value: name }, compared.includes(name) ? `✓ ${name}` : name)));
  }

  /** Sets whether the rows of the shown range are loaded. Until then they cannot be saved, and empty charts do not show "no data". */
  setComplete(complete) {
    this.strips.empty = complete ? "no data in this time" : "";
    this.toLast.hidden = !complete || !(this.last_s < this.view.range()[0]);
    setText(this.toLast, `show the last rows, until ${moment(this.last_s)} UTC`);
    this.file.disabled = !complete;
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
    this.moved(this.query());
    clearTimeout(this.reloadTimer);
    this.reloadTimer = undefined;
    this.setComplete(false);
    const request = ++this.requests, [from_s, to_s] = this.view.range(), length_s = to_s - from_s + this.length_s();
    const rows = Math.max(200, Math.min(600, Math.round(this.strips.area().width / 2)));
    this.strips.element.setAttribute("aria-busy", "true");
    try {
      // starts one window earlier, so that the first running mean is complete; rows of 1 s if possible, because they have means
      const load = (name) => loadRange(this.socket, name.replace(/ \S*$/, ""), name.match(/\S*$/)[0], to_s - length_s, to_s, length_s < kMaxRows - 2 ? kMaxRows : rows);
      const compared = this.compared(), why = (name) => (error) => ({ why: `${name}: ${error.message}` });
      const [own, ...others] = await Promise.all([load(this.name), ...compared.map((name) => load(name).catch(why(name)))]);
      if (request !== this.requests) return;
      const step_s = stepFor(length_s, rows), failed = others.map((one) => one.why).filter(Boolean);
      others.forEach(({ steps, known_s }, i) => { if (steps) this.lines.get(compared[i])?.take(steps, known_s, step_s, this.view.isLive); });
      this.take(own, step_s);
      if (failed.length > 0) this.note(failed.join(", "));
    } catch (error) {
      if (request !== this.requests) return;
      this.note(`rows: ${error.message}`);
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
    this.note(problem ? `Minutes and hours are not stored: ${problem}. ${progress}` : progress);
    clearTimeout(this.retryTimer);
    if (unbuilt || problem) this.retryTimer = setTimeout(() => this.reload(), unbuilt ? 2000 : 5000);
    this.draw();
    const [from_s, to_s] = this.view.range(), shown = this.rows.steps.rows.filter((row) => row.time_s > from_s).length;
    this.strips.describe(`${span(this.view.span_s)} until ${this.view.isLive ? "now" : `${moment(to_s)} UTC`}, ${shown} ${shown === 1 ? "row" : "rows"} of ${span(this.rows.steps.step_s)}`);
  }

  /** Adds a live second of any axis. */
  window(row, instance) {
    const rows = this.lines.get(`${instance} ${row.axis}`);
    if (!rows?.window(row, this.view.isLive) || rows !== this.rows) return;
    if (!this.anchored) this.anchor(row.time_s);
    this.current = { time_s: row.time_s + 1, at_ms: performance.now() };
    if (this.view.isLive) this.forget(row.time_s);
  }

  /** Removes old rows. Also required in a hidden tab, which does not draw. */
  forget(to_s) {
    for (const rows of this.lines.values()) rows.forget(to_s - this.view.span_s - this.length_s());
  }

  /** The rows of the charts: those of the axis, with the values of compared axes at the same times as quantities such as "bias gyro2 x". */
  chartRows() {
    for (const { steps } of this.lines.values()) steps.run(this.length_s());
    if (this.lines.size === 1) return this.rows.steps.rows;
    const rows = new Map(this.rows.steps.rows.map((row) => [row.end_s, { ...row }]));
    for (const name of this.compared()) {
      for (const { end_s, time_s, ...row } of this.lines.get(name).steps.rows) {
        if (!rows.has(end_s)) rows.set(end_s, { end_s, time_s, seconds: 0, good: 0 });
        const values = { ...row, corrected: row.corrected ?? row.raw, corrected_1s: row.corrected_1s ?? row.raw_1s };
        for (const key of kCompared) rows.get(end_s)[`${key} ${name}`] = values[key];
      }
    }
    return [...rows.values()].sort((a, b) => a.end_s - b.end_s);
  }

  /** Call after a sleep of the computer, which the steady clock does not count. */
  slept(ms) {
    this.current.at_ms -= ms;
  }

  /** Moves a live view to the current time, when the charts have moved by a pixel. */
  tick() {
    const since_ms = performance.now() - this.drawn_ms, [from_s, to_s] = this.view.range(), pixel_s = Math.min(kSlowest_s, (to_s - from_s) / this.strips.area().width);
    if (!this.view.isLive || since_ms < kTick_ms || Math.abs(to_s - this.drawn_to_s) < pixel_s) return;
    this.forget(to_s);
    this.showTimes();
    this.draw();
  }

  /** Averaging time of the rate chart's curves. */
  meansLabel() {
    if (this.bySecond) return "1 s";
    return this.rows.steps.step_s > this.length_s() ? span(this.rows.steps.step_s) : "window";
  }

  draw() {
    setText(this.means, `means: ${this.meansLabel()}`);
    Object.assign(this, { drawn_ms: performance.now(), drawn_to_s: this.view.range()[1] });
    this.strips.draw(this.chartRows(), this.rows.steps.step_s);
  }

  /** Updates numbers, inputs, events and the list of other axes. */
  update(linked, now_ms) {
    const status = statusOf(this.gyro, this.axis, linked, now_ms);
    const known_s = this.axis.window?.time_s ?? this.last_s;  // without a window: the last row of the log
    if (!this.anchored && this.gyro.status?.clock === "device" && Number.isFinite(known_s)) this.anchor(known_s, true);
    this.numbers.draw(this.gyro, this.axis, status, now_ms);
    this.inputs.draw(this.axis.description, status.old ? undefined : this.axis.correction?.inputs, this.axis.quality?.includes("extrapolating"));
    const added = this.strips.addSensors(Object.entries(this.gyro.status?.sensors ?? {}).map(([name, { unit }]) => [name, unitText(unit)]));
    for (const chart of added) chart.more = this.asked.get(chart.spec.key) ?? "";
    if (added.length > 0) this.curvesChanged();
    this.listOthers();
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
    this.curvesChanged();
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
