// SPDX-License-Identifier: MIT
// Computations of the charts of a report.
import assert from "node:assert/strict";
import { test } from "node:test";
import { decadesOf, nearestRow, tableOf, valueNear } from "../../tools/prismcal/report/page/table.js";

const line = (x, y, more) => ({ form: "line", x, y, ...more });

test("series with different x are one table: null if a series has no entry at x, NaN at a break of its curve", () => {
  assert.deepEqual(tableOf([line([1, 3], [10, null]), line([2, 3], [5, 6])]), [
    [1, [10, 10, 10], null],
    [2, null, [5, 5, 5]],
    [3, [NaN, NaN, NaN], [6, 6, 6]],
  ]);
});

test("a band has both edges and their middle", () => {
  assert.deepEqual(tableOf([{ form: "band", x: [1], y: [2], high: [4] }]), [[1, [2, 3, 4]]]);
});

test("points are sorted by x, and all points at the same x are kept", () => {
  const rows = tableOf([{ form: "points", x: [5, 1, 5], y: [1, 2, 3] }, { form: "points", x: [5], y: [9] }]);
  assert.deepEqual(rows.map(([x, a, b]) => [x, a?.[1], b?.[1]]), [[1, 2, undefined], [5, 1, 9], [5, 3, undefined]]);
  assert.deepEqual(tableOf([{ form: "points", x: [null, 2], y: [1, 1] }]), [[2, [1, 1, 1]]]);
});

test("the value at the cursor is from the nearest row, or from a row close to it", () => {
  const rows = tableOf([line([1, 4, 9], [1, 2, 3]), line([2, 6], [7, 8])]);
  assert.deepEqual([-5, 1.4, 1.6, 5.1, 99].map((x) => rows[nearestRow(rows, x)][0]), [1, 1, 2, 6, 9]);
  assert.equal(valueNear(rows, 1, 0, 0), null);
  assert.equal(valueNear(rows, 1, 0, 1)[1], 1);
  assert.equal(valueNear(rows, 4, 1, 1)[1], 8);
});

test("a logarithmic axis has powers of ten, and also their multiples by 2 and 5 if its range is short", () => {
  assert.deepEqual(decadesOf(1, 14000).map((tick) => tick.label), ["1", "10", "100", "1000", "10000"]);
  assert.deepEqual(decadesOf(0.004, 0.06).map((tick) => tick.label), ["0.005", "0.01", "0.02", "0.05"]);
  assert.deepEqual(decadesOf(1e-6, 1e-3).map((tick) => tick.label), ["1e-6", "1e-5", "1e-4", "0.001"]);
  for (const low of [0, -1, NaN]) assert.deepEqual(decadesOf(low, 10), [], "no logarithm; this caused an endless loop");
});
