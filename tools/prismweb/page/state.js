// SPDX-License-Identifier: MIT
// State of each gyro, whether it is current, and its words and levels: good, care (caution) or bad (check). Independent of the document.
import { decimalsOf, fixed, kUnknown, moment, span, unitText } from "./format.js";

/** Level, word and explanation of each reason in a quality (docs/protocol.md). */
const kReasons = {
  good: ["good", "good", "corrected without reservation"],
  warming: ["care", "warming up", "the averaging window is not full yet; no correction until it is"],
  no_model: ["care", "no model", "no model loaded; rates are not corrected"],
  extrapolating: ["care", "outside training range", "an input is outside the model's training range"],
  fallback: ["care", "fallback model", "an input of the main model is unknown; the fallback model corrects"],
  settling: ["care", "settling", "the gyro's body may still differ from the start's temperature"],
  slew_limited: ["care", "slew limited", "the applied bias is moving to the model's value (slew limit)"],
  clocks_differ: ["bad", "wrong frame rate", "frames arrive at another rate than the description says; times and slopes are wrong"],
  no_data: ["bad", "no data", "no current measurement"],
  rate_invalid: ["bad", "rate invalid", "the gyro reports an invalid rate"],
  input_missing: ["bad", "input missing", "an input of the model is unknown"],
  over_limit: ["bad", "bias over limit", "the model's bias is above the configured limit"],
  implausible: ["bad", "implausible", "a measured value is implausible for its sensor"],
};
/** Word and explanation of each state of a line without data. */
const kLines = {
  connecting: ["unplugged", "the device does not exist or does not accept a connection"],
  silent: ["silent", "no data on the line"],
  ended: ["ended", "the recording has ended"],
  none: ["no line", "the configuration has no line"],
};
const kRank = { good: 0, care: 1, bad: 2 };
export const kMarks = { good: "●", care: "▲", bad: "■" };

export const worse = (a, b) => (kRank[a] >= kRank[b] ? a : b);
const reasonsOf = (quality) => (quality || "no_data").split("+").map((reason) => kReasons[reason] ?? ["care", reason, reason]);

/** Level of a quality such as "warming+no_model". Unknown reasons are "care". */
export const levelOfQuality = (quality) => reasonsOf(quality).map(([level]) => level).reduce(worse);

export const levelOfSeverity = (severity) => ({ error: "bad", warning: "care" })[severity] ?? "good";

const delivers = (state) => state === "receiving" || state === "replaying";

/** Word for the state of a line, also of a sensor. */
export const wordOfLine = (state) => kLines[state]?.[0] ?? state;

const kEventsKept = 256;
const kFresh_ms = 3500; // rows come each second
const kMaxGap_s = 2.5;
export const kTrace_s = 600;

/** `pending`, `missing`: methods whose result is awaited, and those to request again. */
export const makeGyro = (name) => ({ name, state: "", gone: "", status: null, axes: new Map(), events: [], pending: new Set(), missing: new Set() });

/** `model`: undefined until the first status, null without a model. `stability`, `correction`, `description`: results of `stability`, `bias`, `model`. `last_s`: last row of the log, if there is no newer one. */
export const makeAxis = (name) => ({ name, window: null, window_ms: -Infinity, trace: [], quality: "no_data" });

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
    for (const key of ["window_s", "warm_s", "full_s", "at_rest", "monitor"]) axis[key] = part[key];
    if (Number.isFinite(part.window?.time_s) && !axis.window) axis.window = part.window;
    // a line without data sends no rows; the status has the age of the last one
    if (axis.window_ms === -Infinity && Number.isFinite(status.age_s)) axis.window_ms = now_ms - 1000 * status.age_s;
  }
}

/** Keeps the result of `stability`, `bias` or `model` with each axis. */
export function takeParts(gyro, method, answer) {
  for (const [name, part] of byAxis(answer)) axisOf(gyro, name)[kMembers[method]] = part;
}
const kMembers = { stability: "stability", bias: "correction", model: "description" };

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
  axis.hasUhfo ||= Number.isFinite(row.uhfo_v);
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

/** A number with as many decimals as its standard deviation supports: {what, deg_per_h, text, sd, decimals}. */
function numberOf(what, deg_per_h, sd, decimals = decimalsOf(sd)) {
  return { what, deg_per_h, decimals, text: fixed(deg_per_h, decimals), sd: Number.isFinite(deg_per_h) && Number.isFinite(sd) ? `± ${fixed(sd, decimals)}` : "" };
}

/** The corrected rate of an axis, or the raw rate without a model. The standard deviation of a raw rate is that of its means since the start. */
export function rateOf(axis) {
  const { window, stability, at_rest } = axis, row = window ?? {}, corrected = corrects(axis), valid = isValid(row);
  if (!corrected && window) return numberOf("raw (no model)", valid ? row.mean_rate_deg_per_h : null, null, decimalsOf(stability?.all?.sd_deg_per_h));
  return numberOf(at_rest?.unknown === "moving" ? "corrected, moving" : "corrected", valid ? row.corrected_mean_deg_per_h : null, row.sd_mean_deg_per_h ?? row.sd_deg_per_h);
}

/** The difference of the corrected rate from the Earth rate, which the gyro measures at rest: the model's error. Null if it is not known. */
export function differenceOf({ window, at_rest }) {
  const difference = at_rest?.difference_deg_per_h, number = numberOf("difference from the Earth rate, at rest", difference, at_rest?.sd_deg_per_h);
  if (!Number.isFinite(difference) || !isValid(window ?? {})) return null;
  return { ...number, text: difference > 0 ? `+${number.text}` : number.text };
}

/** The main value of an axis. */
export const mainOf = (axis) => differenceOf(axis) ?? rateOf(axis);

/** "holds: 31 days, 412 h at rest (2026-11-23 04:00:00 UTC)": the last verdict of the monitor. Undefined without one. */
export function verdictOf({ monitor }) {
  return monitor ? `${unitText(monitor.text)} (${moment(monitor.at_s)} UTC)` : undefined;
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

/** A text of prismd with the page's units, and its words for qualities and states of lines. */
export const inWords = (text) => unitText(text).replace(/[a-z]+(_[a-z]+)+|extrapolating|connecting/g, (word) => kReasons[word]?.[1] ?? wordOfLine(word));

/** The problems; those that say the same of several sensors, as of T and the thermometer that measures it, are one. */
function joined(problems) {
  const sensors = new Map();
  for (const text of problems) {
    const end = Math.max(text.search(/ (is|has been) /), 0), what = text.slice(end);
    sensors.set(what, [...(sensors.get(what) ?? []), text.slice(0, end)]);
  }
  return [...sensors].map(([what, names]) => names.join(", ") + what);
}

/** Level and texts of the problems of an axis and of its device, without those of its quality. A prismd before 0.4 has only texts. */
function healthOf({ status }, axis) {
  const own = (status.health?.problems ?? []).map((one) => (one.text ? one : { text: String(one) })).filter((one) => !["quality", "no_model"].includes(one.kind) && (one.axis ?? axis.name) === axis.name);
  return [own.map((one) => (one.level === "failed" ? "bad" : "care")).reduce(worse, "good"), joined(own.map((one) => one.text)).map(inWords)];
}

/** The explanations of a quality that is not good. They name the inputs that are unknown. */
function explained({ quality, correction }) {
  const inputs = correction?.inputs ?? {}, unknown = Object.keys(inputs).filter((name) => !Number.isFinite(inputs[name].value)).join(", ");
  return reasonsOf(quality).filter(([level]) => level !== "good").map(([, , text]) => (unknown ? text.replace("model is unknown", `model is unknown: ${unknown}`) : text));
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
  if (!delivers(state)) return { level: "bad", word: wordOfLine(state), why: gyro.status.detail || kLines[state]?.[1] || state, old: true };
  if (now_ms - axis.window_ms > kFresh_ms) {
    return { level: "bad", word: "no data", why: "no row in the last seconds", old: true };
  }
  const quality = levelOfQuality(axis.quality), [health, problems] = healthOf(gyro, axis);
  const count = axis.quality?.includes("warming") && axis.full_s ? `${axis.warm_s ?? 0} of ${axis.full_s} s` : "";
  const word = kRank[health] <= kRank[quality] ? reasonsOf(axis.quality).map(([, one]) => one).join(", ") : health === "bad" ? "fault" : "caution";
  return { level: worse(quality, health), word, count, why: [...explained(axis), ...problems].join("; ") || kReasons.good[2], old: false };
}

/** Returns true if each gyro has an axis and all axes are good; false without gyros. */
export function allGood(gyros, linked, now_ms) {
  const axes = [...gyros].map((gyro) => [...gyro.axes.values()].map((axis) => statusOf(gyro, axis, linked, now_ms).level));
  return axes.length > 0 && axes.every((levels) => levels.length > 0 && levels.every((level) => level === "good"));
}

/** Returns the worst level of a gyro's axes, for the title and announcements. */
export const worstLevelOf = (gyro, linked, now_ms) =>
  [...gyro.axes.values()].map((axis) => statusOf(gyro, axis, linked, now_ms).level).reduce(worse, gyro.gone || !linked ? "bad" : "good");

/** Standard deviation of the means since the start: of the corrected rate, without a model of the raw one. */
export const stabilityOf = ({ stability }) => stability?.corrected?.sd_deg_per_h ?? stability?.all?.sd_deg_per_h;

/** "0.01552 → 0.00677": raw and corrected. */
export function stabilityText(stability) {
  const raw = stability?.raw?.sd_deg_per_h, corrected = stability?.corrected?.sd_deg_per_h, all = raw ?? stability?.all?.sd_deg_per_h;
  if (Number.isFinite(corrected)) return `${fixed(raw, 5)} → ${fixed(corrected, 5)}`;
  return Number.isFinite(all) ? `${fixed(all, 5)} raw` : kUnknown;
}

/** The address of an axis. */
export const hrefOf = (gyro, axis) => `#/${encodeURIComponent(gyro.name)}/${encodeURIComponent(axis.name)}`;

/** The model's name; a dash if it is not known yet. */
export const modelName = ({ model }) => (model === undefined ? kUnknown : model?.name || model?.kind || "none");

/** Age of the last row of an axis, as text. The clock of the log's rows may differ from this computer's. */
export function ageOf(axis, now_ms) {
  if (Number.isFinite(axis.window_ms)) return `${span((now_ms - axis.window_ms) / 1000)} old`;
  return axis.last_s ? `last row of ${moment(axis.last_s)} UTC` : "no row yet";
}
