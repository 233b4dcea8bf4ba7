// SPDX-License-Identifier: MIT
// What `range` answers (docs/page.md), as rows of the charts.
import { Steps } from "./steps.js";

/** Column stems of `range`: the charts' quantity. */
const kStems = { rate: "raw_1s", corrected: "corrected_1s", bias: "bias", temperature: "temperature", slope: "slope", uhfo: "uhfo" };

/** {columns, rows, step_s} of an answer as Steps. A step without its own mean has the middle between least and greatest. */
export function stepsOf({ columns, rows, step_s }) {
  const steps = new Steps(step_s), at = Object.fromEntries(columns.map((name, i) => [name, i]));
  const hasMeans = "rate_mean" in at && "corrected_mean" in at;
  for (const cells of rows) {
    const row = steps.row(cells[at.time_s], cells[at.seconds] ?? 0);
    for (const [stem, key] of Object.entries(kStems)) {
      const least = cells[at[`${stem}_min`]], greatest = cells[at[`${stem}_max`]], mean = cells[at[`${stem}_mean`]];
      if (Number.isFinite(least)) row[key] = [least, mean ?? (least + greatest) / 2, greatest];
    }
    const even = (total) => (Number.isFinite(total) ? Array(3).fill(total / Math.max(row.seconds, 1)) : undefined);
    const sd = cells[at.sd_max];
    Object.assign(row, { sd: Number.isFinite(sd) ? [sd, sd, sd] : undefined, samples: even(cells[at.samples]), missing: even(cells[at.missing]), good: cells[at.good] });
    steps.rows.push(row);
  }
  steps.hasMeans = hasMeans || step_s === 1;
  return steps;
}

/** Asks for rows of `from_s` to `to_s` in at most `points` steps. `building`: what is built so far, 0 to 1, or null. */
export async function loadRange(socket, instance, axis, from_s, to_s, points) {
  const answer = await socket.call(instance, "range", { axis, from_s: Math.floor(from_s), to_s: Math.ceil(to_s), points });
  return { steps: stepsOf(answer), last_s: answer.last_s, building: answer.building };
}
