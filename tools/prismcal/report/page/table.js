// SPDX-License-Identifier: MIT
// Joins series with different x into one table for dygraphs.

/** [low, middle, high] of an entry of a series; NaN at a break of its curve. */
function valueOf(series, i) {
  const y = series.y[i] ?? NaN, high = series.form === "band" ? series.high[i] ?? NaN : y;
  return [y, (y + high) / 2, high];
}

/**
 * Returns rows [x, …[low, middle, high]] sorted by x, with all entries of all series. null: the series has no entry at x; its curve
 * continues. Several entries of one series at the same x are separate rows.
 */
export function tableOf(series) {
  const entries = series.flatMap((one, s) => one.x.map((x, i) => ({ x, s, i }))).filter(({ x }) => x !== null);
  entries.sort((a, b) => a.x - b.x || a.i - b.i);
  const rows = [];
  let first = 0; // index of the first row with this x
  for (const { x, s, i } of entries) {
    if (rows.length > 0 && rows[rows.length - 1][0] !== x) first = rows.length;
    let row = rows.slice(first).find((one) => one[s + 1] === null);
    if (!row) rows.push((row = [x, ...series.map(() => null)]));
    row[s + 1] = valueOf(series[s], i);
  }
  return rows;
}

/** Index of the row with the nearest x. The table must not be empty. */
export function nearestRow(rows, x) {
  let low = 0, high = rows.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] < x) low = middle + 1; else high = middle;
  }
  return low > 0 && x - rows[low - 1][0] <= rows[low][0] - x ? low - 1 : low;
}

/** The entry of a series at a row, or the nearest one at most `far` rows away, or null. */
export function valueNear(rows, row, s, far) {
  for (let d = 0; d <= far; d++) {
    for (const at of [row - d, row + d]) if (Number.isFinite(rows[at]?.[s + 1]?.[1])) return rows[at][s + 1];
  }
  return null;
}

/** Returns {v, label} at powers of ten, and at 2 and 5 times them if the range is short; empty if `low` has no logarithm. */
export function decadesOf(low, high) {
  if (!(low > 0 && high < Infinity)) return [];
  const ticks = [], digits = Math.log10(high / low) < 2.5 ? [1, 2, 5] : [1];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const digit of digits) {
      const v = Number(`${digit}e${power}`);
      if (v >= low && v <= high) ticks.push({ v, label: power < -3 || power > 4 ? `${digit}e${power}` : String(v) });
    }
  }
  return ticks;
}
