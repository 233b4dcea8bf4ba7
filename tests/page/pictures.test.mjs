// SPDX-License-Identifier: MIT
// Numbers behind the drawings that the page makes without a library, and behind saved files.
import assert from "node:assert/strict";
import { test } from "node:test";

const from = (name) => import(new URL(`../../tools/prismweb/page/${name}`, import.meta.url));
const { sorted, sparkPath } = await from("overview.js"), { inputsOf, lineRows, onScale } = await from("panels.js"), { csvOf } = await from("rows.js");
const { modelName } = await from("state.js"), { ticksOf } = await from("format.js");

test("a spark line ends at the right edge and has a gap at unknown seconds", () => {
  assert.equal(sparkPath([[598, 1], [599, 1.5], [600, 2]], 2), "M0.0,41.0L120.0,22.0L240.0,3.0");
  assert.equal(sparkPath([[0, 1], [1, 1], [2, null], [3, 1], [600, 1]], 600), "M0.0,22.0L0.4,22.0L1.2,22.0M240.0,22.0", "one second is not a gap");
  assert.equal(sparkPath([[0, 1], [1, null], [2, null], [3, 2]], 3), "M0.0,41.0M240.0,3.0");
  assert.equal(sparkPath([[0, null], [1, 5]], 600), "");
});

test("a value outside the training domain is drawn outside its range, but within the scale", () => {
  assert.deepEqual(onScale(24, 10, 30), { from: 4 / 28, to: 24 / 28, at: 18 / 28, inside: true });
  assert.deepEqual([onScale(9, 10, 20).inside, onScale(9, 10, 20).at < onScale(9, 10, 20).from], [false, true]);
  assert.equal(onScale(1e9, 10, 20).at, 1);
  assert.deepEqual([onScale(null, 10, 20).at, onScale(null, 10, 20).inside], [null, null]);
});

test("inputs of a model have the values and units of the correction, also those of sensor lines, even if the model has no domain", () => {
  const inputs = inputsOf({ inputs: ["T", "room", "anode"], domain: { min: [], max: [] } }, { T: { value: 25, unit: "degC" }, room: { value: null, unit: "degC" } });
  assert.deepEqual(inputs.map((input) => [input.name, input.unit, input.value, input.min]), [["T", "degC", 25, undefined], ["room", "degC", null, undefined], ["anode", "", undefined, undefined]]);
});

test("the table is sorted by name with its numbers, by state with the worst first, and with unknown values last", () => {
  const entry = (name, level, deg_per_h) => ({ name, status: { level, word: level }, rate: { deg_per_h } });
  const entries = [entry("gyro10", "good", 8), entry("gyro2", "bad", null), entry("gyro1", "care", 9)], order = (...how) => sorted(entries, ...how).map(({ name }) => name);
  assert.deepEqual(order("name", false), ["gyro1", "gyro2", "gyro10"]);
  assert.deepEqual(order("state", false), ["gyro2", "gyro1", "gyro10"]);
  assert.deepEqual([order("rate", false), order("rate", true)], [["gyro10", "gyro1", "gyro2"], ["gyro1", "gyro10", "gyro2"]]);
});

test("a saved table has one line per row and units in the column names; a name cannot add a line", () => {
  const rows = [{ end_s: 1795455900, time_s: 1795455898, raw_1s: [1, 2, 3] }, { end_s: 1795455905, time_s: 1795455903 }];
  const lines = csvOf(rows, 5, ["gyro\n1,2,3"]).trimEnd().split("\n");
  assert.deepEqual(lines, ["# gyro 1 2 3", "# step_s: 5", "time_utc,time_s,min_rate_deg_per_h,mean_rate_deg_per_h,max_rate_deg_per_h", "2026-11-23T17:45:00Z,1795455900,1,2,3", "2026-11-23T17:45:05Z,1795455905,,,"]);
});

test("a saved table leaves unknown values empty, and its comments cannot start a formula", () => {
  const row = { end_s: 10, time_s: 5.5, bias: [1, 2, 3], sd: [4, 4, 4], samples: [200, 200, 200] };
  const parts = { bias: [true, false, true], sd: [false, false, true], samples: [false, true, false] };
  const lines = csvOf([row], 10, ['model x",=1+1;=2\t=3'], parts).trimEnd().split("\n");
  assert.equal(lines[0], "# model x =1+1 =2 =3");
  assert.equal(lines.at(-1).split(",").slice(2).join(","), "1,,3,,,4,,200,");
});

test("a model that is not known yet is a dash, not none", () => {
  assert.deepEqual([undefined, null, { kind: "ls" }, { kind: "ls", name: "m" }].map((model) => modelName({ model })), ["–", "none", "ls", "m"]);
});

test("scales have round numbers with the necessary decimals", () => {
  assert.deepEqual(ticksOf(8.44, 8.486, 4).map((tick) => tick.label), ["8.44", "8.45", "8.46", "8.47", "8.48"]);
  assert.deepEqual(ticksOf(0, 200, 3).map((tick) => tick.label), ["0", "100", "200"]);
  assert.deepEqual(ticksOf(-0.002, 0.0021, 3).map((tick) => tick.label), ["\u22120.002", "0.000", "0.002"]);
  assert.deepEqual(ticksOf(-0.03, 0.04, 2).map((tick) => tick.label), ["\u22120.02", "0.00", "0.02", "0.04"]);
  assert.deepEqual(ticksOf(5, 5, 3).map((tick) => tick.v), [5]);
  assert.deepEqual(ticksOf(15.041067, 15.041067000000002, 3).map((tick) => tick.v), [15.041067], "was an endless loop");
  assert.deepEqual(ticksOf(NaN, NaN, 3), []);
});

test("the line's panel names the counters above 0 and the sensor lines", () => {
  const line = { device: "/dev/x", baud: 921600, decoder: { frames: 12345, bad_check: 1, bad_length: 0, bad_body: 3, refused: 4 }, timing: { period_s: 0.00501, missing_frames: 4 }, nominal_period_s: 0.005,
    hardware: null, notes: ["<b>"], sensor_lines: { room: { state: "connecting", age_s: null }, case: { state: "receiving", age_s: 2 } } };
  const rows = Object.fromEntries(lineRows(line));
  assert.equal(rows["frames good"], "12\u2009345");
  assert.equal(rows["frames rejected"], "1 checksum, 3 content, 4 fault");
  assert.deepEqual([rows["frames lost"], rows["bytes skipped"]], ["4 missing", "none"]);
  assert.equal(rows.period, "5.010000 ms, 2000.0 ppm off");
  assert.deepEqual([rows.room, rows.case], ["unplugged, no value yet", "receiving, last value 2.0 s ago"]);
  assert.equal(rows["hardware errors"], "not counted by this device");
  assert.equal(rows.note, "<b>");
  assert.equal(Object.fromEntries(lineRows({ ...line, hardware: { overruns: 2, breaks: 0 } }))["hardware errors"], "2 overruns");
  assert.deepEqual(lineRows(null), []);
});
