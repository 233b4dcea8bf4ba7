// SPDX-License-Identifier: MIT
// Converts the result of `range` (docs/protocol.md) to rows of the charts.
import { Steps } from "./steps.js";

/** Column stem of `range`: quantity of the charts. */
const kStems = { rate: "raw_1s", corrected: "corrected_1s", bias: "bias", temperature: "temperature", slope: "slope", uhfo: "uhfo" };

/** Whether a result with steps longer than 1 s has [min, mean, max] of each quantity. Without a mean the charts draw the middle. */
function partsOf(at) {
  const parts = Object.fromEntries(Object.entries(kStems).map(([stem, key]) => [key, [true, `${stem}_mean` in at, true]]));
  return { ...parts, sd: [false, false, true], samples: [false, true, false], missing: [false, true, false] };
}

/** Converts {columns, rows, step_s} of a result to Steps. A step without a mean gets the middle of minimum and maximum. */
export function stepsOf({ columns, rows, step_s }) {
  const steps = new Steps(step_s), at = Object.fromEntries(columns.map((name, i) => [name, i]));
  const hasMeans = "rate_mean" in at && "corrected_mean" in at;
  for (const cells of rows) {
    const row = steps.row(cells[at.time_s], cells[at.seconds] ?? 0);
    for (const [stem, key] of Object.entries(kStems)) {
      const min = cells[at[`${stem}_min`]], max = cells[at[`${stem}_max`]], mean = cells[at[`${stem}_mean`]];
      if (Number.isFinite(min)) row[key] = [min, mean ?? (min + max) / 2, max];
    }
    const perSecond = (total) => (Number.isFinite(total) ? Array(3).fill(total / Math.max(row.seconds, 1)) : undefined);
    const sd = cells[at.sd_max];
    Object.assign(row, { sd: Number.isFinite(sd) ? [sd, sd, sd] : undefined, samples: perSecond(cells[at.samples]), missing: perSecond(cells[at.missing]), good: cells[at.good] });
    steps.rows.push(row);
  }
  steps.hasMeans = hasMeans || step_s === 1;
  if (step_s > 1) steps.parts = partsOf(at);
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
