// SPDX-License-Identifier: MIT
// The rows of a view: the result of `range` and the live seconds after it.
import { Steps } from "./steps.js";

const kMaxBack_s = 2.5, kMaxRecent = 120, kMaxStep_s = 1.5; // a longer step to the next second is a gap

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
