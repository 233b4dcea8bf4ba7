// SPDX-License-Identifier: MIT
// The rows of a view: the result of `range` (docs/protocol.md), the live seconds after it, and their table as a file.
import { el } from "./dom.js";
import { moment } from "./format.js";
import { kQuantities, sensorKey, Steps } from "./steps.js";

const kMaxBack_s = 2.5, kMaxRecent = 120, kMaxStep_s = 1.5; // a longer step to the next second is a gap
/** Column stem of `range`: quantity of the charts. */
const kStems = { rate: "raw_1s", corrected: "corrected_1s", bias: "bias", temperature: "temperature", slope: "slope", uhfo: "uhfo" };

/** Whether a result with steps longer than 1 s has [min, mean, max] of each quantity. Without a mean the charts draw the middle. */
function partsOf(at, stems) {
  const parts = Object.fromEntries(stems.map(([stem, key]) => [key, [true, `${stem}_mean` in at, true]]));
  return { ...parts, sd: [false, false, true], samples: [false, true, false], missing: [false, true, false] };
}

/** Converts {columns, rows, step_s} of a result to Steps. A step without a mean gets the middle of minimum and maximum. */
export function stepsOf({ columns, rows, step_s }) {
  const steps = new Steps(step_s), at = Object.fromEntries(columns.map((name, i) => [name, i]));
  const hasMeans = "rate_mean" in at && "corrected_mean" in at, sensors = columns.map((name) => name.match(/^(sensors\..*)_min$/)?.[1]).filter(Boolean);
  const stems = [...Object.entries(kStems), ...sensors.map((stem) => [stem, stem])];
  for (const cells of rows) {
    const row = steps.row(cells[at.time_s], cells[at.seconds] ?? 0);
    for (const [stem, key] of stems) {
      const min = cells[at[`${stem}_min`]], max = cells[at[`${stem}_max`]], mean = cells[at[`${stem}_mean`]];
      if (Number.isFinite(min)) row[key] = [min, mean ?? (min + max) / 2, max];
    }
    const perSecond = (total) => (Number.isFinite(total) ? Array(3).fill(total / Math.max(row.seconds, 1)) : undefined);
    const sd = cells[at.sd_max];
    Object.assign(row, { sd: Number.isFinite(sd) ? [sd, sd, sd] : undefined, samples: perSecond(cells[at.samples]), missing: perSecond(cells[at.missing]), good: cells[at.good] });
    steps.rows.push(row);
  }
  steps.hasMeans = hasMeans || step_s === 1;
  if (step_s > 1) steps.parts = partsOf(at, stems);
  return steps;
}

/**
 * Requests the rows from `from_s` to `to_s` in at most `points` steps. `known_s`: end of the range for which the result has all rows; later
 * live rows must be added. `building`: fraction of the long view that is built, 0 to 1, or null.
 * `problem`: why prismweb cannot store minutes and hours, or null.
 */
export async function loadRange(socket, instance, axis, from_s, to_s, points) {
  const end_s = Math.ceil(to_s), result = await socket.call(instance, "range", { axis, from_s: Math.floor(from_s), to_s: end_s, points });
  const steps = stepsOf(result), { last_s, building, store_problem: problem } = result;
  // `last_s` is the last row when prismweb responded; the rows may end before it, at `end_s`
  const known_s = steps.step_s === 1 ? steps.rows.at(-1)?.end_s ?? -Infinity : Math.min(last_s ?? -Infinity, end_s);
  return { steps, last_s, known_s, building, problem };
}

export class LiveRows {
  /** `hooks`: reloadSoon() if rows are missing; discard() if the result of a pending request must not be used. */
  constructor(hooks) {
    Object.assign(this, { hooks, steps: new Steps(1), recent: [], known_s: -Infinity });
  }

  /** Takes the result of a request, which ends at `known_s`. The charts have steps of `step_s`. */
  take(steps, known_s, step_s, isLive) {
    Object.assign(this, { known_s, steps: steps.step_s < step_s ? steps.coarser(step_s) : steps });
    if (isLive) this.follow();
  }

  /** Adds a live second. Returns false if it is a duplicate. */
  window(row, isLive) {
    const last_s = this.recent.at(-1)?.time_s ?? -Infinity;
    if (row.time_s === last_s) return false;
    if (row.time_s < last_s || row.time_s < this.known_s - kMaxBack_s) this.restart(isLive);
    this.recent.push(row);
    if (this.recent.length > kMaxRecent) this.recent.shift();
    if (!isLive || row.time_s <= this.known_s) return true;
    this.reloadAfterGap(row.time_s, this.steps.step_s === 1 ? this.steps.rows.at(-1)?.end_s ?? -Infinity : Math.max(last_s, this.known_s));
    if (!this.steps.push(row)) this.hooks.reloadSoon();
    return true;
  }

  /** Adds the live seconds after the result. Rows missing between them may be available now. */
  follow() {
    const after = this.recent.filter((row) => row.time_s > this.known_s);
    if (after.length > 0) this.reloadAfterGap(after[0].time_s, this.known_s);
    for (const row of after) this.steps.push(row);
  }

  /** Reloads once for each row after a gap, because the data may also have the gap. */
  reloadAfterGap(time_s, last_s) {
    if (!(time_s - last_s > kMaxStep_s) || last_s === -Infinity || this.gap_end_s === time_s) return;
    this.gap_end_s = time_s;
    this.hooks.reloadSoon();
  }

  /** Call if the data's time went back. Removes the rows of a live view, which are later than all new rows. */
  restart(isLive) {
    Object.assign(this, { recent: [], known_s: -Infinity, gap_end_s: undefined });
    if (!isLive) return;
    this.steps = new Steps(this.steps.step_s);
    this.hooks.discard();
    this.hooks.reloadSoon();
  }

  /** Removes rows that end before `time_s`. */
  forget(time_s) {
    this.steps.forget(time_s - this.steps.step_s);
  }
}

/**
 * Returns the rows as CSV: time, and minimum, mean and maximum of each quantity; empty if unknown or if the steps do not have this value
 * (`parts` of Steps). Comments contain no separators, because a cell that starts with "=" would be a formula.
 */
export function csvOf(rows, step_s, about, parts = {}) {
  const sensors = new Set(rows.flatMap(Object.keys).filter((key) => key.startsWith(sensorKey(""))));
  const quantities = [...Object.entries(kQuantities), ...[...sensors].map((key) => [key, key])].filter(([name]) => rows.some((row) => row[name]));
  const lines = about.map((line) => `# ${line.replace(/[\r\n,;\t"]+/g, " ")}`);
  lines.push(`# step_s: ${step_s}`);
  lines.push(["time_utc", "time_s", ...quantities.flatMap(([, member]) => ["min", "mean", "max"].map((part) => `${part}_${member}`))].join(","));
  const number = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(12))) : "");
  for (const row of rows) {
    const cells = quantities.flatMap(([name]) => [0, 1, 2].map((part) => (parts[name]?.[part] === false ? "" : number(row[name]?.[part]))));
    lines.push([moment(row.end_s).replace(" ", "T") + "Z", row.end_s, ...cells].join(","));
  }
  return lines.join("\n") + "\n";
}

export function saveCsv(name, ...table) {
  const url = URL.createObjectURL(new Blob([csvOf(...table)], { type: "text/csv" }));
  el("a", { href: url, download: `${name}.csv` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
