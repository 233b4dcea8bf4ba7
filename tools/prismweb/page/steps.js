// SPDX-License-Identifier: MIT
// What the charts draw: rows of equal steps of time, each quantity with the least, the mean and the greatest value of its step.
// Rows of the past come from `range`; live seconds are folded in as they come.

/** Quantity: the member of a `window` notification that it is (docs/protocol.md). */
export const kQuantities = {
  raw_1s: "rate_deg_per_h",
  corrected_1s: "corrected_deg_per_h",
  bias: "bias_deg_per_h",
  sd: "sd_deg_per_h",
  temperature: "temperature_degc",
  slope: "slope_degc_per_s",
  uhfo: "uhfo_v",
  samples: "samples",
  missing: "missing",
};
/** What stands for a member that an older prismd does not tell: the mean of its window. */
const kOlder = { temperature: "mean_temperature_degc", uhfo: "mean_uhfo_v" };
const kRunning = { raw: "raw_1s", corrected: "corrected_1s" };

/** [least, mean, greatest] with `value`, of the same form, that stands for `share` of both. */
const fold = (old, value, share) =>
  old ? [Math.min(old[0], value[0]), old[1] + (value[1] - old[1]) * share, Math.max(old[2], value[2])] : [...value];

export class Steps {
  /** `parts`: of a quantity which of [least, mean, greatest] are truly known; all where it is not named. */
  constructor(step_s) {
    Object.assign(this, { step_s, rows: [], hasMeans: true, parts: {} });
  }

  /** A row of the step that ends at `end_s`: its time is the middle of the seconds in it, which are named by their ends. */
  row(end_s, seconds) {
    return { end_s, time_s: end_s - (this.step_s - 1) / 2, seconds, good: 0 };
  }

  /** A live second. One that is older than the last row, as after a clock that was set back, answers false: ask `range` anew. */
  push(window) {
    const values = {};
    for (const [name, member] of Object.entries(kQuantities)) {
      const value = window[member in window ? member : kOlder[name]];
      if (Number.isFinite(value)) values[name] = Array(3).fill(value);
    }
    return this.add(window.time_s, { ...values, seconds: 1, good: window.quality === "good" ? 1 : 0 });
  }

  /** Values of some seconds that end at `time_s`; false where they are older than the last row. */
  add(time_s, values) {
    const end_s = Math.ceil(time_s / this.step_s) * this.step_s, last = this.rows.at(-1);
    if (last && end_s < last.end_s) return false;
    const row = last?.end_s === end_s ? last : this.row(end_s, 0);
    if (row !== last) this.rows.push(row);
    row.seconds += values.seconds;
    row.good += values.good;
    for (const name of Object.keys(kQuantities)) {
      if (values[name]) row[name] = fold(row[name], values[name], values.seconds / row.seconds);
    }
    return true;
  }

  /** The same in steps of a multiple of these. */
  coarser(step_s) {
    const result = Object.assign(new Steps(step_s), { hasMeans: this.hasMeans, parts: this.parts });
    for (const row of this.rows) result.add(row.end_s, row);
    return result;
  }

  /** Takes away what ended before `time_s`. */
  forget(time_s) {
    const keep = this.rows.findIndex((row) => row.end_s >= time_s);
    if (keep > 0) this.rows.splice(0, keep);
  }

  /**
   * Gives each row the running means of `length_s` until it, of raw and corrected rate; unknown while less than half is there. Where
   * only least and greatest are known, these stand for themselves. A window's corrected rate is its mean less the bias now in force, as
   * prismd has it; where the bias has no mean, as in long steps, it is the mean of what was corrected.
   */
  run(length_s) {
    if (!this.hasMeans) {
      for (const row of this.rows) for (const [name, of] of Object.entries(kRunning)) row[name] = row[of];
      return;
    }
    const wide_s = Math.max(1, Math.round(length_s / this.step_s)) * this.step_s, hasBias = this.parts.bias?.[1] !== false;
    for (const [name, of] of Object.entries(kRunning)) {
      let begin = 0, sum = 0, known = 0;
      this.rows.forEach((row, i) => {
        if (row[of]) { sum += row.seconds * row[of][1]; known += row.seconds; }
        for (; this.rows[begin].end_s <= row.end_s - wide_s; begin++) {
          if (this.rows[begin][of]) { sum -= this.rows[begin].seconds * this.rows[begin][of][1]; known -= this.rows[begin].seconds; }
        }
        const mean = sum / known;
        row[name] = row[of] && 2 * known >= Math.min(wide_s, length_s) ? [mean, mean, mean] : undefined;
      });
    }
    if (hasBias) for (const row of this.rows) row.corrected = row.raw && row.bias && row.raw.map((rate) => rate - row.bias[1]);
  }
}

/**
 * Rows for dygraphs, [ms, [low, middle, high], …] of the given series; a hole of more than two steps is an empty row, so that no
 * line is drawn over it.
 */
export function tableOf(rows, step_s, series) {
  const table = [], nothing = series.map(() => [NaN, NaN, NaN]);
  let before_s = NaN;
  for (const row of rows) {
    if (row.time_s - before_s > 2.5 * step_s) table.push([(before_s + step_s) * 1000, ...nothing]);
    before_s = row.time_s;
    table.push([row.time_s * 1000, ...series.map((one) => bandOf(row, one))]);
  }
  return table;
}

/** Least, mean, greatest; or with `band` the mean and so many of that quantity to both sides. */
function bandOf(row, { key, band, times }) {
  const value = row[key];
  if (!value) return [NaN, NaN, NaN];
  const wide = band ? row[band] : undefined;
  return wide ? [value[0] - times * wide[2], value[1], value[2] + times * wide[2]] : value;
}

/** The last row that begins before `time_s`, or the first; -1 where there are none. */
export function indexAt(rows, time_s) {
  let low = 0, high = rows.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (rows[middle].time_s <= time_s) low = middle;
    else high = middle - 1;
  }
  return high < 0 ? -1 : low;
}

/** The step of which a view of so many seconds has at most so many rows. */
export const stepFor = (seconds, rows) => [1, 2, 5, 10, 15, 30, 60].find((step_s) => seconds / step_s <= rows) ?? 120;
