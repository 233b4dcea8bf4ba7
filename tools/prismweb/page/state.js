// SPDX-License-Identifier: MIT
// State of each gyro and whether it is current. Independent of the document.
import { levelOfQuality, levelOfState, textOfQuality, worse } from "./quality.js";
import { kUnknown, span } from "./charts/format.js";

const kEventsKept = 256;
const kFresh_ms = 3500; // rows come each second
const kMaxGap_s = 2.5;
export const kTrace_s = 600;

/** `run`: number of starts since the page opened; `polls`: methods with a pending periodic request. */
export const makeGyro = (name) => ({ name, state: "", gone: "", status: null, axes: new Map(), events: [], run: 0, polls: new Set() });

/** `model`: undefined until the first status, null without a model. */
const makeAxis = (name) => ({ name, window: null, window_ms: -Infinity, trace: [], stability: null, quality: "no_data", model: undefined });

export function axisOf(gyro, name) {
  if (!gyro.axes.has(name)) gyro.axes.set(name, makeAxis(name));
  return gyro.axes.get(name);
}

/** Returns [axis name, part] pairs of a result. */
export const byAxis = (result) => Object.entries(result?.axes ?? {});

export function takeStatus(gyro, status, now_ms) {
  gyro.status = status;
  const parts = byAxis(status);
  for (const name of [...gyro.axes.keys()]) if (!parts.some(([axis]) => axis === name)) gyro.axes.delete(name);
  for (const [name, part] of parts) {
    const axis = axisOf(gyro, name);
    axis.quality = part.quality ?? "no_data";
    axis.model = part.model ?? null;
    for (const key of ["window_s", "warm_s", "full_s"]) axis[key] = part[key];
    if (Number.isFinite(part.window?.time_s) && !axis.window) axis.window = part.window;
    // a line without data sends no rows; the status has the age of the last one
    if (axis.window_ms === -Infinity && Number.isFinite(status.age_s)) axis.window_ms = now_ms - 1000 * status.age_s;
  }
}

export function takeStability(gyro, answer) {
  for (const [name, part] of byAxis(answer)) axisOf(gyro, name).stability = part;
}

/** Adds one second's row, live or from the history. If the data's time restarts, so does the trace. */
export function takeWindow(gyro, row, now_ms) {
  const axis = axisOf(gyro, row.axis ?? "");
  const last = axis.trace[axis.trace.length - 1];
  if (last && row.time_s < last[0] - 1) axis.trace.length = 0;
  if (!last || row.time_s > last[0] || axis.trace.length === 0) {
    axis.trace.push([row.time_s, ...(isValid(row) ? [row.corrected_mean_deg_per_h, row.mean_rate_deg_per_h] : [null, null])]);
  }
  while (axis.trace.length > 0 && axis.trace[0][0] < row.time_s - kTrace_s) axis.trace.shift();
  axis.window = row;
  if (Number.isFinite(row.mean_rate_deg_per_h) || Number.isFinite(row.mean_temperature_degc)) axis.complete = row;
  axis.window_ms = now_ms;
  axis.quality = row.quality ?? axis.quality;
}

/**
 * Returns the axis with the row to display: for `old` data the last row with means, if its time is close to the last row's. A second
 * that was cut short by the end of prismd has no means.
 */
export function readable(axis, old) {
  const { window, complete } = axis;
  return old && complete && Math.abs(window.time_s - complete.time_s) < kMaxGap_s ? { ...axis, window: complete } : axis;
}

/** Whether the last second had a rate. Without one the window's mean continues but is not current. */
export const isValid = (row) => Number.isFinite(row.rate_deg_per_h);

const corrects = ({ window, model }) => model !== null || Number.isFinite(window?.corrected_mean_deg_per_h);

/** Index in a trace's [time_s, corrected, raw] of the rate that rateOf() returns. A line never mixes the two. */
export const partOfTrace = (axis) => (corrects(axis) ? 1 : 2);

/** The main value of an axis, {what, deg_per_h}: the corrected rate, or the raw rate without a model. */
export function rateOf(axis) {
  const { window } = axis, row = window ?? {};
  const deg_per_h = corrects(axis) ? row.corrected_mean_deg_per_h : row.mean_rate_deg_per_h;
  return { what: corrects(axis) || !window ? "corrected" : "raw (no model)", deg_per_h: isValid(row) ? deg_per_h : null };
}

export function takeEvent(gyro, event) {
  gyro.events.push(event);
  if (gyro.events.length > kEventsKept) gyro.events.shift();
}

/** Applies one entry of `instances`. */
export function takeInstance(gyro, { state, axes }) {
  if (state === "running" && gyro.state !== "running") gyro.status = null;
  gyro.state = state;
  gyro.gone = state === "gone" ? "prismd does not respond at its socket; prismweb retries" : "";
  for (const axis of axes) axisOf(gyro, axis);
}

/**
 * Returns the status of an axis: {level, word, count, why, old}. `old`: the values are not current. `count`: progress of the warm-up, or
 * empty; separate from `word`, so that a screen reader does not repeat it each second.
 * `linked`: the page has its connection.
 */
export function statusOf(gyro, axis, linked, now_ms) {
  if (!linked) return { level: "bad", word: "not connected", why: "the page has no connection to prismweb", old: true };
  if (gyro.state === "stopped") return { level: "care", word: "stopped", why: "this instance was stopped", old: true };
  if (gyro.gone) return { level: "bad", word: "prismd stopped", why: gyro.gone, old: true };
  if (!gyro.status) return { level: "care", word: "loading", why: "waiting for the first status", old: true };
  const state = gyro.status.state ?? "unknown";
  if (levelOfState(state) === "bad") return { level: "bad", word: state, why: gyro.status.detail || "no data on the line", old: true };
  if (now_ms - axis.window_ms > kFresh_ms) {
    return { level: "bad", word: "no data", why: "no row in the last seconds", old: true };
  }
  const level = levelOfQuality(axis.quality);
  const count = axis.quality?.includes("warming") && axis.full_s ? `${axis.warm_s ?? 0} of ${axis.full_s} s` : "";
  return { level, word: axis.quality, count, why: textOfQuality(axis.quality), old: false };
}

/** Returns true if each gyro has an axis and all axes are good; false without gyros. */
export function allGood(gyros, linked, now_ms) {
  const axes = [...gyros].map((gyro) => [...gyro.axes.values()].map((axis) => statusOf(gyro, axis, linked, now_ms).level));
  return axes.length > 0 && axes.every((levels) => levels.length > 0 && levels.every((level) => level === "good"));
}

/** Returns the worst level of a gyro's axes, for the title and announcements. */
export const worstLevelOf = (gyro, linked, now_ms) =>
  [...gyro.axes.values()].map((axis) => statusOf(gyro, axis, linked, now_ms).level).reduce(worse, gyro.gone || !linked ? "bad" : "good");

/** The model's name; a dash if it is not known yet. */
export const modelName = ({ model }) => (model === undefined ? kUnknown : model?.name || model?.kind || "none");

/** Age of the last row of an axis, as text. */
export function ageOf(axis, now_ms) {
  return Number.isFinite(axis.window_ms) ? `${span((now_ms - axis.window_ms) / 1000)} old` : "no row yet";
}
