// SPDX-License-Identifier: MIT
// The data of the charts: rows with equal time steps, with minimum, mean and maximum of each quantity. Past rows come from `range`; live
// seconds are added.

/** Quantity: its member in the notification `window` (docs/protocol.md). */
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
/** Quantity of another sensor, and stem of its columns in `range`. */
export const sensorKey = (name) => `sensors.${name}`;
const kRunning = { raw: "raw_1s", corrected: "corrected_1s" };

/** Joins two [min, mean, max]; `value` has the fraction `share` of the seconds of both. */
const join = (old, value, share) =>
  old ? [Math.min(old[0], value[0]), old[1] + (value[1] - old[1]) * share, Math.max(old[2], value[2])] : [...value];

export class Steps {
  /** `parts`: quantity → which of [min, mean, max] are known; all are known of a quantity that is not listed. */
  constructor(step_s) {
    Object.assign(this, { step_s, rows: [], hasMeans: true, parts: {} });
  }

  /** Returns an empty row that ends at `end_s`. `time_s` is the mean of the times of its seconds, which are those of their ends. */
  row(end_s, seconds) {
    return { end_s, time_s: end_s - (this.step_s - 1) / 2, seconds, good: 0 };
  }

  /** Adds a live second. Returns false if it is older than the last row, e.g. after a clock was set back: request `range` again. */
  push(window) {
    const values = {};
    for (const [name, member] of Object.entries(kQuantities)) {
      const value = window[member];
      if (Number.isFinite(value)) values[name] = Array(3).fill(value);
    }
    for (const [name, value] of Object.entries(window.sensors ?? {})) if (Number.isFinite(value)) values[sensorKey(name)] = Array(3).fill(value);
    return this.add(window.time_s, { ...values, seconds: 1, good: window.quality === "good" ? 1 : 0 });
  }

  /** Adds values of one or several seconds that end at `time_s`. Returns false if they are older than the last row. */
  add(time_s, values) {
    const end_s = Math.ceil(time_s / this.step_s) * this.step_s, last = this.rows.at(-1);
    if (last && end_s < last.end_s) return false;
    const row = last?.end_s === end_s ? last : this.row(end_s, 0);
    if (row !== last) this.rows.push(row);
    row.seconds += values.seconds;
    row.good += values.good;
    for (const [name, value] of Object.entries(values)) {
      if (Array.isArray(value)) row[name] = join(row[name], value, values.seconds / row.seconds);
    }
    return true;
  }

  /** Returns the same data in longer steps; `step_s` is a multiple of this step. */
  coarser(step_s) {
    const result = Object.assign(new Steps(step_s), { hasMeans: this.hasMeans, parts: this.parts });
    for (const row of this.rows) result.add(row.end_s, row);
    return result;
  }

  /** Removes rows that end before `time_s`. */
  forget(time_s) {
    const keep = this.rows.findIndex((row) => row.end_s >= time_s);
    if (keep > 0) this.rows.splice(0, keep);
  }

  /**
   * Sets the running means of raw and corrected rate over the last `length_s` of each row; unknown if less than half of the seconds are
   * known. Without means, minimum and maximum are copied. The corrected rate of a window is its mean minus the bias (and the offset by
   * command, which only the corrected second has) at its end, as in prismd; if the bias has no mean, as in long steps, it is the mean of the corrected rates.
   */
  run(length_s) {
    if (!this.hasMeans) {
      for (const row of this.rows) for (const [name, of] of Object.entries(kRunning)) row[name] = row[of];
      return;
    }
    const width_s = Math.max(1, Math.round(length_s / this.step_s)) * this.step_s, hasBias = this.parts.bias?.[1] !== false;
    for (const [name, of] of Object.entries(kRunning)) {
      let begin = 0, sum = 0, known = 0;
      this.rows.forEach((row, i) => {
        if (row[of]) { sum += row.seconds * row[of][1]; known += row.seconds; }
        for (; this.rows[begin].end_s <= row.end_s - width_s; begin++) {
          if (this.rows[begin][of]) { sum -= this.rows[begin].seconds * this.rows[begin][of][1]; known -= this.rows[begin].seconds; }
        }
        const mean = sum / known;
        row[name] = row[of] && 2 * known >= Math.min(width_s, length_s) ? [mean, mean, mean] : undefined;
      });
    }
    if (hasBias) for (const row of this.rows) {
      const off = row.raw_1s && row.corrected_1s ? row.raw_1s[1] - row.corrected_1s[1] : row.bias?.[1];
      row.corrected = row.raw && row.bias && row.raw.map((rate) => rate - off);
    }
  }
}

/**
 * Returns rows for dygraphs, [ms, [low, middle, high], …], of the given series. A gap of more than two steps gets an empty row, so that
 * no line is drawn across it.
 */
export function tableOf(rows, step_s, series) {
  const table = [], empty = series.map(() => [NaN, NaN, NaN]);
  let last_s = NaN;
  for (const row of rows) {
    if (row.time_s - last_s > 2.5 * step_s) table.push([(last_s + step_s) * 1000, ...empty]);
    last_s = row.time_s;
    table.push([row.time_s * 1000, ...series.map((one) => bandOf(row, one))]);
  }
  return table;
}

/** Returns [min, mean, max], or with `band` the mean ± `times` that quantity. */
function bandOf(row, { key, band, times }) {
  const value = row[key];
  if (!value) return [NaN, NaN, NaN];
  const width = band ? row[band] : undefined;
  return width ? [value[0] - times * width[2], value[1], value[2] + times * width[2]] : value;
}

/** Index of the last row with a time up to `time_s`, or of the first; -1 without rows. */
export function indexAt(rows, time_s) {
  let low = 0, high = rows.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (rows[middle].time_s <= time_s) low = middle;
    else high = middle - 1;
  }
  return high < 0 ? -1 : low;
}

/** The shortest step with which `seconds` are at most `rows` rows. */
export const stepFor = (seconds, rows) => [1, 2, 5, 10, 15, 30, 60].find((step_s) => seconds / step_s <= rows) ?? 120;
