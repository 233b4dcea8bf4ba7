// SPDX-License-Identifier: MIT
// Compares the page's Allan deviation with `prismcal allan` (its result is in allan.json) and with the theory of noise.
// allan.csv is simulated: white noise of 0.06 deg/h, a random walk of 0.0008 deg/h per second, five missing seconds. To update allan.json:
// prismcal allan tests/page/allan.csv --grid dense --json | jq -c '{values,holes,runs,tau0_s,points:[.points[]|{m,deviation:.measured_deg_per_h,clusters}]}'
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const { allanDeviation, clusterSizes } = await import(new URL("../../tools/prismweb/page/allan.js", import.meta.url));
const { evenly } = await import(new URL("../../tools/prismweb/page/allan_view.js", import.meta.url));
const near = (found, expected, relative, what) => assert.ok(Math.abs(found / expected - 1) < relative, `${what}: ${found}, expected ${expected}`);

test("the results are those of prismcal allan, for a record with a gap", () => {
  const golden = JSON.parse(readFileSync(new URL("allan.json", import.meta.url)));
  const lines = readFileSync(new URL("allan.csv", import.meta.url), "utf8").trimEnd().split("\n").slice(1);
  const rates = lines.map((line) => (line.endsWith(",") ? NaN : Number(line.split(",")[1])));
  assert.ok(rates.includes(NaN) && golden.runs === 2, "the record has a gap");
  const points = allanDeviation(rates, golden.tau0_s);
  assert.deepEqual(points.map(({ m, clusters }) => [m, clusters]), golden.points.map(({ m, clusters }) => [m, clusters]));
  points.forEach((point, i) => near(point.deviation, golden.points[i].deviation, 1e-9, `m = ${point.m}`));
});

/** Nearly normal noise: the sum of twelve values of Park and Miller's generator, minus 6. */
function noise(seed) {
  let state = seed;
  const even = () => (state = (state * 48271) % 2147483647) / 2147483647;
  return () => Array.from({ length: 12 }, even).reduce((a, b) => a + b) - 6;
}

test("white noise falls with 1/sqrt(tau), beginning at its standard deviation", () => {
  const random = noise(1), rates = Array.from({ length: 40000 }, () => 8 + 0.06 * random());
  const points = allanDeviation(rates, 1, [1, 4, 16, 64, 256]);
  // limit: three standard deviations of the estimate, 1/sqrt(2 · clusters) each
  for (const { m, deviation, clusters } of points) near(deviation, 0.06 / Math.sqrt(m), 3 / Math.sqrt(2 * clusters), `m = ${m}`);
});

test("a ramp rises with tau: slope · tau / sqrt(2)", () => {
  const points = allanDeviation(Array.from({ length: 1000 }, (_, i) => 0.01 * i), 1, [1, 10, 100]);
  for (const { tau_s, deviation } of points) near(deviation, (0.01 * tau_s) / Math.SQRT2, 1e-9, `tau ${tau_s}`);
});

test("a record that is too short or has no known value gives no point", () => {
  for (const rates of [[], [1], [1, 2], [NaN, NaN, NaN, NaN]]) assert.deepEqual(allanDeviation(rates, 1), []);
  assert.deepEqual(clusterSizes(9), [1, 2, 3]);
});

test("rows become evenly spaced values, NaN for a missing row", () => {
  const rows = [0, 10, 40, 50].map((end_s) => ({ time_s: end_s + 0.5, seconds: 10, raw_1s: end_s === 50 ? undefined : [0, end_s, 0] }));
  assert.deepEqual(evenly(rows, 10, "raw_1s"), [0, 10, NaN, NaN, 40, NaN]);
  rows[1].seconds = 8;
  rows[2].seconds = 9;
  assert.deepEqual(evenly(rows, 10, "raw_1s"), [0, NaN, NaN, NaN, 40, NaN], "an incomplete step is a gap");
});
