// SPDX-License-Identifier: MIT
// Series of different x as one table, as dygraphs wants it.

/** [low, middle, high] of a series' entry; NaN where its curve breaks. */
function valueOf(series, i) {
  const y = series.y[i] ?? NaN, high = series.form === "band" ? series.high[i] ?? NaN : y;
  return [y, (y + high) / 2, high];
}

/**
 * Rows [x, …[low, middle, high]] in the order of x, of every entry of every series one. null: the series has nothing there, and its curve
 * goes on. Several entries of one series at one x are as many rows.
 */
export function tableOf(series) {
  const entries = series.flatMap((one, s) => one.x.map((x, i) => ({ x, s, i }))).filter(({ x }) => x !== null);
  entries.sort((a, b) => a.x - b.x || a.i - b.i);
  const rows = [];
  let first = 0; // of the rows with this x
  for (const { x, s, i } of entries) {
    if (rows.length > 0 && rows[rows.length - 1][0] !== x) first = rows.length;
    let row = rows.slice(first).find((one) => one[s + 1] === null);
    if (!row) rows.push((row = [x, ...series.map(() => null)]));
    row[s + 1] = valueOf(series[s], i);
  }
  return rows;
}

/** The row whose x is nearest, of a table with at least one. */
export function nearestRow(rows, x) {
  let low = 0, high = rows.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] < x) low = middle + 1; else high = middle;
  }
  return low > 0 && x - rows[low - 1][0] <= rows[low][0] - x ? low - 1 : low;
}

/** The entry of a series at a row, or the nearest one at most `far` rows away; null if there is none. */
export function valueNear(rows, row, s, far) {
  for (let d = 0; d <= far; d++) {
    for (const at of [row - d, row + d]) if (Number.isFinite(rows[at]?.[s + 1]?.[1])) return rows[at][s + 1];
  }
  return null;
}

/** {v, label} at powers of ten, and at 2 and 5 times them where few are in sight; empty if `low` has no logarithm. */
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
