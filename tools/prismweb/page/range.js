// SPDX-License-Identifier: MIT
// What `range` answers (docs/page.md), as rows of the charts.
import { Steps } from "./steps.js";

/** Column stems of `range`: the charts' quantity. */
const kStems = { rate: "raw_1s", corrected: "corrected_1s", bias: "bias", temperature: "temperature", slope: "slope", uhfo: "uhfo" };

/** Which of [least, mean, greatest] an answer in longer steps has of each quantity: where it has no mean, the middle is drawn, and is none. */
function partsOf(at) {
  const parts = Object.fromEntries(Object.entries(kStems).map(([stem, key]) => [key, [true, `${stem}_mean` in at, true]]));
  return { ...parts, sd: [false, false, true], samples: [false, true, false], missing: [false, true, false] };
}

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
  if (step_s > 1) steps.parts = partsOf(at);
  return steps;
}

/**
 * Asks for rows of `from_s` to `to_s` in at most `points` steps. `known_s`: the last second that the answer has if there was one: live rows
 * behind it are to be added. `building`: what is built so far, 0 to 1, or null.
 */
export async function loadRange(socket, instance, axis, from_s, to_s, points) {
  const end_s = Math.ceil(to_s), answer = await socket.call(instance, "range", { axis, from_s: Math.floor(from_s), to_s: end_s, points });
  const steps = stepsOf(answer), { last_s, building } = answer;
  // `last_s` is what there is by now: the answer may end before, as it was asked some time ago
  const known_s = steps.step_s === 1 ? steps.rows.at(-1)?.end_s ?? -Infinity : Math.min(last_s ?? -Infinity, end_s);
  return { steps, last_s, known_s, building };
}
