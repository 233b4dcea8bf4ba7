// SPDX-License-Identifier: MIT
// Computations of the page, without a browser.
import assert from "node:assert/strict";
import { test } from "node:test";

const page = new URL("../../tools/prismweb/page/", import.meta.url);
const from = (name) => import(new URL(name, page));
const format = await from("format.js"), state = await from("state.js");
const { csvOf, LiveRows, stepsOf } = await from("rows.js"), { Steps, indexAt, stepFor, tableOf } = await from("steps.js"), { TimeView, kMax_s } = await from("time_view.js");

test("an unknown number is a dash, and zero has no minus sign", () => {
  for (const unknown of [null, undefined, NaN, Infinity, "8"]) assert.equal(format.fixed(unknown, 3), "–");
  assert.equal(format.fixed(-0.0001, 2), "0.00");
  assert.equal(format.fixed(-1.5, 1), "\u22121.5");
  assert.equal(format.withUnit(null, 3, "V"), "–");
  assert.equal(format.plusMinus(1, null), "1.000");
  assert.equal(format.plusMinus(0.01, 0.0042), "0.0100 ± 0.0042");
});

test("formats of spans, times, file names and decimals", () => {
  assert.deepEqual([0.04, 59.9, 200, 3600, 7260, 90000].map(format.span), ["0.0 s", "59 s", "3 min 20 s", "1 h", "2 h 1 min", "1 d 1 h"]);
  assert.equal(format.moment(1795455900), "2026-11-23 17:45:00");
  assert.equal(format.fileName("../a<script>/ö b"), "a-script-b");
  assert.equal(format.fileName("///"), "gyro");
  assert.deepEqual([0.01, 3, 250].map(format.decimalsFor), [4, 2, 0]);
});

test("a value has as many decimals as its standard deviation supports", () => {
  assert.deepEqual([0.0099, 0.01, 0.25, 12, null].map(format.decimalsOf), [4, 3, 2, 0, 3]);
});

test("a time is read as it is shown, in UTC, and an invalid one is not a number", () => {
  const time_s = 1795455900;
  for (const text of ["2026-11-23 17:45:00", " 2026-11-23T17:45:00Z ", "2026-11-23 17:45"]) assert.equal(format.parseMoment(text), time_s, text);
  assert.equal(format.moment(format.parseMoment("2026-11-23")), "2026-11-23 00:00:00");
  for (const text of ["", "now", "2026-02-30", "23.11.2026", "2026-11-23 25:00", "2026-11-23 17:45 and"]) assert.ok(Number.isNaN(format.parseMoment(text)), text);
  assert.equal(format.period(time_s, time_s + 60), "2026-11-23 17:45:00 – 17:46:00 UTC");
  assert.equal(format.period(time_s, time_s + 86400), "2026-11-23 17:45:00 – 2026-11-24 17:45:00 UTC");
});

test("the worst reason of a quality decides; an unknown reason is caution", () => {
  assert.equal(state.levelOfQuality("good"), "good");
  assert.equal(state.levelOfQuality("warming+no_model"), "care");
  assert.equal(state.levelOfQuality("extrapolating+rate_invalid"), "bad");
  assert.equal(state.levelOfQuality("a_reason_of_next_year"), "care");
  assert.equal(state.levelOfQuality(undefined), "bad");
});

const second = (time_s, rate, more) => ({ axis: "z", time_s, samples: 200, missing: 0, rate_deg_per_h: rate, corrected_deg_per_h: rate, quality: "good", ...more });

test("live seconds are added to the step in which they end, with minimum, mean and maximum", () => {
  const steps = new Steps(5);
  for (const [time_s, rate] of [[101, 1], [102, 2], [105, 6], [106, 7]]) assert.equal(steps.push(second(time_s, rate)), true);
  assert.deepEqual(steps.rows.map((row) => [row.end_s, row.time_s, row.seconds, row.raw_1s]), [[105, 103, 3, [1, 3, 6]], [110, 108, 1, [7, 7, 7]]]);
  assert.equal(steps.push(second(99, 1)), false, "a clock that was set back returns false");
});

test("temperature and UHFO are those of the second, not the window's means", () => {
  const steps = new Steps(1), own = { temperature_degc: 25, uhfo_v: 5.4 }, mean = { mean_temperature_degc: 24, mean_uhfo_v: 5.3 };
  for (const [i, more] of [{ ...own, ...mean }, { ...mean, temperature_degc: null, uhfo_v: null }].entries()) steps.push(second(i + 1, 1, more));
  assert.deepEqual(steps.rows.map((row) => [row.temperature?.[1], row.uhfo?.[1]]), [[25, 5.4], [undefined, undefined]]);
});

test("steps longer than a second mark their unknown parts, and so do coarser steps made of them", () => {
  const columns = ["time_s", "rate_min", "rate_max", "bias_min", "bias_max", "rate_mean", "corrected_mean"], rows = [[10, 1, 3, 1, 3, 2, 2]];
  const { parts } = stepsOf({ columns, rows, step_s: 10 });
  assert.deepEqual([parts.raw_1s, parts.bias, parts.sd, parts.samples], [[true, true, true], [true, false, true], [false, false, true], [false, true, false]]);
  assert.deepEqual(stepsOf({ columns, rows, step_s: 10 }).coarser(30).parts, parts);
  assert.deepEqual(stepsOf({ columns, rows, step_s: 1 }).coarser(30).parts, {}, "all parts of seconds are known");
});

test("an unknown rate is not included in the mean", () => {
  const steps = new Steps(1);
  steps.push(second(1, null, { quality: "rate_invalid" }));
  assert.equal(steps.rows[0].raw_1s, undefined);
  assert.equal(steps.rows[0].good, 0);
});

test("a running mean is the mean of its seconds, is unknown if more than half of them are, and does not span a gap", () => {
  const steps = new Steps(1);
  for (let t = 1; t <= 10; t++) steps.push(second(t, t));
  for (let t = 30; t <= 33; t++) steps.push(second(t, 100));
  steps.run(4);
  assert.deepEqual(steps.rows.map((row) => row.raw?.[1]), [undefined, 1.5, 2, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, undefined, 100, 100, 100]);
});

test("a window's corrected rate is its mean minus the current bias, or the mean of the corrected rates if the bias has no mean", () => {
  const steps = new Steps(1);
  for (const [time_s, bias] of [[1, null], [2, 0.1], [3, 0.1], [4, 0.3]]) {
    steps.push(second(time_s, 10 + time_s, { bias_deg_per_h: bias, corrected_deg_per_h: bias === null ? null : 10 + time_s - bias }));
  }
  steps.run(4);
  const close = (value) => value && Number(value[1].toFixed(9));
  assert.deepEqual(steps.rows.map((row) => close(row.corrected)), [undefined, 11.4, 11.9, 12.2]);
  steps.parts = { bias: [true, false, true] };
  steps.run(4);
  assert.deepEqual(steps.rows.map((row) => close(row.corrected)), [undefined, undefined, 12.4, 12.833333333]);
});

test("coarser steps have the true means of their seconds, without unknown ones", () => {
  const steps = new Steps(1);
  for (let t = 1; t <= 9; t++) steps.push(second(t, t === 7 ? null : t, { quality: t > 5 ? "warming" : "good" }));
  const rows = steps.coarser(5).rows;
  assert.deepEqual(rows.map((row) => [row.end_s, row.seconds, row.good, row.samples]), [[5, 5, 5, [200, 200, 200]], [10, 4, 0, [200, 200, 200]]]);
  assert.deepEqual([rows[0].raw_1s, rows[1].raw_1s[0], rows[1].raw_1s[2]], [[1, 3, 5], 6, 9]);
  assert.deepEqual([100, 3700, 5000, 1e6].map((seconds) => stepFor(seconds, 500)), [1, 10, 10, 120]);
});

test("no line is drawn across a gap, and a band has the given number of sd on both sides", () => {
  const rows = [1, 2, 9].map((time_s) => ({ time_s, bias: [1, 1, 1], sd: [0.5, 0.5, 0.5] }));
  const table = tableOf(rows, 1, [{ key: "bias", band: "sd", times: 2 }]);
  assert.deepEqual(table.map((row) => row[0]), [1000, 2000, 3000, 9000]);
  assert.deepEqual(table[2][1], [NaN, NaN, NaN]);
  assert.deepEqual(table[3][1], [0, 1, 2]);
  assert.deepEqual([0, 1.5, 2, 100].map((time_s) => indexAt(rows, time_s)), [0, 0, 1, 2]);
  assert.equal(indexAt([], 1), -1);
});

test("rows of `range` are read by column name, in any order", () => {
  const answer = { step_s: 10, columns: ["good", "new_one", "rate_max", "rate_min", "time_s", "seconds", "samples", "missing", "sd_max"], rows: [[9, 7, 3, 1, 110, 10, 2000, 20, null]] };
  const steps = stepsOf(answer), [row] = steps.rows;
  assert.deepEqual([row.raw_1s, row.corrected_1s, row.samples[1], row.missing[1], row.good, row.end_s, row.time_s, row.sd], [[1, 2, 3], undefined, 200, 2, 9, 110, 105.5, undefined]);
  assert.equal(steps.hasMeans, false, "the middle of minimum and maximum is not a mean");
  const means = stepsOf({ ...answer, columns: [...answer.columns, "rate_mean", "corrected_mean"], rows: [[...answer.rows[0], 1.2, null]] });
  assert.deepEqual([means.hasMeans, means.rows[0].raw_1s], [true, [1, 1.2, 3]]);
  means.push(second(110.5, 5));
  assert.equal(means.rows.length, 2);
});

test("other sensors are read by their columns, added from live seconds, and saved", () => {
  const steps = stepsOf({ step_s: 5, columns: ["time_s", "seconds", "rate_min", "rate_max", "sensors.room.t_min", "sensors.room.t_max"], rows: [[10, 5, 1, 1, 20, 22], [15, 5, 1, 1, null, null]] });
  assert.deepEqual([steps.rows[0]["sensors.room.t"], steps.rows[1]["sensors.room.t"], steps.parts["sensors.room.t"]], [[20, 21, 22], undefined, [true, false, true]]);
  for (const [time_s, value] of [[16, 24], [17, 26], [18, null]]) steps.push(second(time_s, 1, { sensors: { "room.t": value } }));
  assert.deepEqual(steps.rows[2]["sensors.room.t"], [24, 25, 26]);
  assert.match(csvOf(steps.rows, 5, []), /,min_sensors.room.t,mean_sensors.room.t,max_sensors.room.t\n/);
});

test("the time range follows the current time until it is moved, and again when it reaches the current time", () => {
  let changes = 0;
  const view = new TimeView(100, () => 1000, () => changes++);
  assert.deepEqual(view.range(), [900, 1000]);
  view.pan(-0.5);
  assert.deepEqual([view.isLive, ...view.range()], [false, 850, 950]);
  view.scale(0.5);
  assert.deepEqual(view.range(), [875, 925]);
  view.zoom(990, 1010);
  assert.deepEqual([view.isLive, view.span_s], [true, 20]);
  view.zoom(0, 1);
  assert.equal(view.span_s, 10);
  view.setSpan(1e12);
  view.scale(2);
  assert.equal(view.span_s, kMax_s);
  assert.equal(changes, 6);
});

/** A status of the only axis z: `own` has its members. */
const statusOfZ = (whole, own) => ({ ...whole, axes: { z: { axis: "z", ...own } } });

function gyroOf(status) {
  const gyro = state.makeGyro("g");
  state.takeInstance(gyro, { name: "g", state: "running", axes: [] });
  state.takeStatus(gyro, status, 0);
  return gyro;
}

test("stale values are marked as old, for each reason", () => {
  const gyro = gyroOf(statusOfZ({ state: "receiving" }, { quality: "good" })), axis = gyro.axes.get("z");
  state.takeWindow(gyro, second(10, 1), 5000);
  const now = (linked, now_ms) => state.statusOf(gyro, axis, linked, now_ms);
  assert.deepEqual([now(true, 6000).level, now(true, 6000).old], ["good", false]);
  assert.deepEqual([now(true, 9000).level, now(true, 9000).old], ["bad", true]);
  assert.equal(now(false, 6000).old, true);
  gyro.status.state = "connecting";
  assert.deepEqual([now(true, 6000).word, now(true, 6000).old], ["unplugged", true]);
  state.takeInstance(gyro, { name: "g", state: "gone", axes: ["z"] });
  assert.deepEqual([now(true, 6000).word, now(true, 6000).old], ["prismd stopped", true]);
  state.takeInstance(gyro, { name: "g", state: "stopped", axes: ["z"] });
  assert.deepEqual([now(true, 6000).word, now(true, 6000).level], ["stopped", "care"]);
});

test("a row without a time is ignored: the status of a gyro without data has a row of nulls", () => {
  const gyro = gyroOf(statusOfZ({ state: "connecting" }, { quality: "no_data", window: { axis: "z", time_s: null, rate_deg_per_h: null } }));
  assert.equal(gyro.axes.get("z").window, null);
  state.takeStatus(gyro, statusOfZ({ state: "receiving", age_s: 0.5 }, { quality: "good", window: second(10, 1) }), 1000);
  assert.equal(gyro.axes.get("z").window.time_s, 10);
});

test("the age of a line without data is that of the status, or the time of the last row of the log", () => {
  const gyro = state.makeGyro("g");
  state.takeInstance(gyro, { name: "g", state: "running", axes: ["z"] });
  state.takeStatus(gyro, statusOfZ({ state: "silent", age_s: 7200 }, {}), 1000);
  assert.equal(state.ageOf(gyro.axes.get("z"), 1000), "2 h old");
  assert.equal(state.ageOf({ window_ms: -Infinity, last_s: 1795455900 }, 1000), "last row of 2026-11-23 17:45:00 UTC", "of a log, without a row since prismd started");
});

test("the progress of warming is separate from its word; all is good only if every axis is", () => {
  const gyro = gyroOf(statusOfZ({ state: "receiving", age_s: 0 }, { quality: "warming", warm_s: 35, full_s: 110 })), axis = gyro.axes.get("z");
  const { word, count } = state.statusOf(gyro, axis, true, 0);
  assert.deepEqual([word, count], ["warming up", "35 of 110 s"]);
  assert.deepEqual([state.allGood([gyro], true, 0), state.allGood([], true, 0)], [false, false]);
  axis.quality = "good";
  assert.deepEqual([state.allGood([gyro], true, 0), state.allGood([gyro, state.makeGyro("h")], true, 0)], [true, false]);
});

test("responses for one axis and for several are read the same way, and a removed axis is deleted", () => {
  const gyro = gyroOf({ state: "receiving", axes: { x: { axis: "x", quality: "good" }, y: { axis: "y", quality: "no_model" } } });
  assert.deepEqual([...gyro.axes.values()].map((axis) => [axis.name, axis.quality]), [["x", "good"], ["y", "no_model"]]);
  state.takeParts(gyro, "stability", { axes: { x: { axis: "x", improvement: 0.5 } } });
  assert.equal(gyro.axes.get("x").stability.improvement, 0.5);
  state.takeStatus(gyro, { state: "receiving", axes: { y: { axis: "y", quality: "good" } } }, 0);
  assert.deepEqual([...gyro.axes.keys()], ["y"]);
});

test("the main number is the corrected rate with the digits of its uncertainty, the raw rate without a model, and unknown if the last second has no rate", () => {
  const of = (model, row, stability) => {
    const { what, text, sd } = state.rateOf({ model, stability, window: row && { rate_deg_per_h: 8, mean_rate_deg_per_h: 8.51234, ...row } });
    return [what, text, sd];
  };
  const sd = { sd_deg_per_h: 0.004, sd_mean_deg_per_h: 0.0052 };
  assert.deepEqual(of({ name: "m" }, { corrected_mean_deg_per_h: 8.412345, ...sd }), ["corrected", "8.4123", "± 0.0052"]);
  assert.deepEqual(of({ name: "m" }, { corrected_mean_deg_per_h: 8.412345, sd_deg_per_h: 0.12, sd_mean_deg_per_h: null }), ["corrected", "8.41", "± 0.12"]);
  assert.deepEqual(of({ name: "m" }, { corrected_mean_deg_per_h: null, ...sd }), ["corrected", "–", ""]);
  assert.deepEqual(of(null, {}), ["raw (no model)", "8.512", ""]);
  assert.deepEqual(of(null, {}, { all: { sd_deg_per_h: 0.02 } }), ["raw (no model)", "8.512", ""]);
  assert.deepEqual(of(null, {}, { all: { sd_deg_per_h: 0.2 } }), ["raw (no model)", "8.51", ""]);
  assert.deepEqual(of(null, { rate_deg_per_h: null }), ["raw (no model)", "–", ""]);
  assert.deepEqual(of({ name: "m" }, { corrected_mean_deg_per_h: 8.4, rate_deg_per_h: null }), ["corrected", "–", ""]);
  assert.deepEqual(of(null, null), ["corrected", "–", ""]);
});

test("at rest the main number is the difference from the Earth rate, with a sign and the digits of its uncertainty", () => {
  const row = { rate_deg_per_h: 8, corrected_mean_deg_per_h: 8.412345, sd_mean_deg_per_h: 0.0052 };
  const of = (at_rest, window = row) => {
    const { what, text, sd } = state.mainOf({ model: { name: "m" }, window, at_rest });
    return [what, text, sd];
  };
  const rest = { difference_deg_per_h: 0.00312, sd_deg_per_h: 0.0142, unknown: null };
  assert.deepEqual(of(rest), ["difference from the Earth rate, at rest", "+0.003", "± 0.014"]);
  assert.deepEqual(of({ ...rest, difference_deg_per_h: -1.3 }), ["difference from the Earth rate, at rest", "\u22121.300", "± 0.014"]);
  assert.deepEqual(of(rest, { ...row, rate_deg_per_h: null }), ["corrected", "–", ""], "no current rate");
  assert.deepEqual(of({ difference_deg_per_h: null, sd_deg_per_h: null, unknown: "moving" }), ["corrected, moving", "8.4123", "± 0.0052"]);
  assert.deepEqual(of({ difference_deg_per_h: null, sd_deg_per_h: null, unknown: "no_site" }), ["corrected", "8.4123", "± 0.0052"]);
});

test("the monitor's verdict has its date, and an axis without a verdict has none", () => {
  const gyro = gyroOf(statusOfZ({ state: "receiving" }, { monitor: { verdict: "holds", text: "holds: -20 to 55 degC seen", at_s: 1795455900 } }));
  assert.equal(state.verdictOf(gyro.axes.get("z")), "holds: -20 to 55 °C seen (2026-11-23 17:45:00 UTC)");
  for (const monitor of [null, undefined]) assert.equal(state.verdictOf({ monitor }), undefined);
});

test("a problem of the device is shown with all axes, one of an axis with that axis; unknown inputs have their names", () => {
  const problem = (level, kind, axis, text) => ({ level, kind, axis, text });
  const health = { state: "caution", problems: [problem("caution", "line", null, "room stopped changing")] }, part = { axis: "x", quality: "good" };
  const gyro = gyroOf({ state: "receiving", age_s: 0, health, axes: { x: part, y: { ...part, axis: "y" } } }), of = (name) => state.statusOf(gyro, gyro.axes.get(name), true, 0);
  assert.deepEqual(of("x"), { level: "care", word: "caution", count: "", why: "room stopped changing", old: false });
  Object.assign(gyro.axes.get("y"), { quality: "input_missing", correction: { inputs: { T: { value: 20, unit: "degC" }, room: { value: null, unit: "degC" } } } });
  assert.deepEqual([of("x").level, of("y").level, of("y").word], ["care", "bad", "input missing"]);
  assert.equal(of("y").why, "an input of the model is unknown: room; room stopped changing");
  gyro.status.health.problems = [problem("failed", "disk", null, "log: no space"), problem("caution", "quality", "y", "y: quality: no_model")];
  gyro.axes.get("y").quality = "no_model";
  assert.deepEqual([of("x"), of("y")].map(({ level, word, why }) => [level, word, why]), [["bad", "fault", "log: no space"], ["bad", "fault", "no model loaded; rates are not corrected; log: no space"]]);
  gyro.status.health.problems = [problem("caution", "question", "y", "y: T has been 25.004 degC for 9 s")];
  assert.deepEqual([of("x").level, of("y").why], ["good", "no model loaded; rates are not corrected; y: T has been 25.004 °C for 9 s"]);
  gyro.status.health.problems = ["z: T has been 25.004 degC for 9 s", "room has been 25.004 degC for 9 s", "disk: full"].map((text) => problem("caution", "question", null, text));
  assert.equal(of("x").why, "z: T, room has been 25.004 °C for 9 s; disk: full");
  gyro.status.health.problems = ["log: no space"];
  assert.deepEqual([of("x").level, of("x").why], ["care", "log: no space"], "a prismd of 0.3");
  assert.equal(state.inWords("room: connecting; quality is now warming+input_missing"), "room: unplugged; quality is now warming+input missing");
});

test("a second that was cut short does not remove the values before it", () => {
  const gyro = gyroOf(statusOfZ({ state: "receiving" }, { model: { name: "m" } })), axis = gyro.axes.get("z");
  const means = { mean_rate_deg_per_h: 8.5, mean_temperature_degc: 25, corrected_mean_deg_per_h: 8.4 }, none = { mean_rate_deg_per_h: null, mean_temperature_degc: null };
  state.takeWindow(gyro, second(10, 8, means), 1);
  state.takeWindow(gyro, second(11, 8, none), 2);
  const of = (old) => [state.readable(axis, old).window.time_s, state.rateOf(state.readable(axis, old)).deg_per_h ?? null];
  assert.deepEqual([of(true), of(false)], [[10, 8.4], [11, null]]);
  state.takeWindow(gyro, second(14, 8, none), 3);
  assert.deepEqual(of(true), [14, null], "values older than the displayed age are not shown");
});

test("a trace has either corrected or raw rates, never both", () => {
  const gyro = gyroOf(statusOfZ({ state: "receiving" }, { model: { name: "m" } })), axis = gyro.axes.get("z");
  state.takeWindow(gyro, second(10, 8.5, { mean_rate_deg_per_h: 8.5, corrected_mean_deg_per_h: null }), 1);
  state.takeWindow(gyro, second(11, 8.5, { mean_rate_deg_per_h: 8.5, corrected_mean_deg_per_h: 8.4 }), 2);
  const told = () => axis.trace.map((row) => row[state.partOfTrace(axis)]);
  assert.deepEqual(told(), [null, 8.4]);
  axis.model = null;
  assert.deepEqual(told(), [null, 8.4], "the last row is still corrected");
  state.takeWindow(gyro, second(12, 8.5, { mean_rate_deg_per_h: 8.5 }), 3);
  assert.deepEqual(told(), [8.5, 8.5, 8.5]);
});

test("a trace keeps ten minutes, and restarts when the device's clock does", () => {
  const gyro = gyroOf(statusOfZ({ state: "receiving" }, {}));
  for (let t = 1; t <= 1000; t++) state.takeWindow(gyro, { ...second(t, t), corrected_mean_deg_per_h: t }, t);
  const { trace } = gyro.axes.get("z");
  assert.deepEqual([trace[0][0], trace.length], [400, 601]);
  state.takeWindow(gyro, second(5, 1), 1001);
  assert.equal(gyro.axes.get("z").trace.length, 1);
});

test("the first live second after a gap loads the rows again, once, at any step", () => {
  for (const step_s of [1, 4]) {
    let reloads = 0;
    const rows = new LiveRows({ reloadSoon: () => reloads++, discard: () => {} }), loaded = new Steps(1);
    for (let time_s = 1; time_s <= 100; time_s++) loaded.push({ time_s, rate_deg_per_h: 8 });
    rows.take(loaded, 100, step_s, true);
    rows.window({ time_s: 101 }, true);
    assert.equal(reloads, 0);
    const late = new LiveRows({ reloadSoon: () => reloads++, discard: () => {} });
    late.take(loaded, 100, step_s, true);
    for (const time_s of [110, 110, 111]) late.window({ time_s }, true);
    assert.deepEqual([reloads, late.steps.rows.at(-1).end_s], [1, step_s === 1 ? 111 : 112]);
  }
});
