// SPDX-License-Identifier: MIT
// The rows of a view: those that `range` answered, joined by the live seconds after them.
import { Steps } from "./steps.js";

const kBack_s = 2.5, kRecent = 120, kNext_s = 1.5; // what follows a second comes no later than so

export class LiveRows {
  /** `hooks`: reloadSoon() if rows are missing; discard() if an answer in progress belongs to the time before. */
  constructor(hooks) {
    Object.assign(this, { hooks, steps: new Steps(1), fine: new Steps(1), recent: [], known_s: -Infinity });
  }

  /** The steps of an answer that ends at `known_s`, drawn in steps of `step_s`. */
  take(steps, known_s, step_s, isLive) {
    Object.assign(this, { fine: steps, known_s, steps: steps.step_s < step_s ? steps.coarser(step_s) : steps });
    if (isLive) this.follow();
  }

  /** A live second; false if it is the last one again. */
  window(row, isLive) {
    const before_s = this.recent.at(-1)?.time_s ?? -Infinity;
    if (row.time_s === before_s) return false;
    if (row.time_s < before_s || row.time_s < this.known_s - kBack_s) this.restart(isLive);
    this.recent.push(row);
    if (this.recent.length > kRecent) this.recent.shift();
    if (!isLive || row.time_s <= this.known_s) return true;
    this.askForHole(row.time_s, this.fine.step_s === 1 ? this.fine.rows.at(-1)?.end_s ?? -Infinity : before_s);
    if (!this.push(row)) this.hooks.reloadSoon();
    return true;
  }

  push(row) {
    if (this.fine !== this.steps) this.fine.push(row);
    return this.steps.push(row);
  }

  /** The live seconds after the answer. What is missing between them may be there by now. */
  follow() {
    const after = this.recent.filter((row) => row.time_s > this.known_s);
    if (after.length > 0) this.askForHole(after[0].time_s, this.known_s);
    for (const row of after) this.push(row);
  }

  /** Once for each row after a gap: a gap that is in the data, too, stays. */
  askForHole(time_s, before_s) {
    if (!(time_s - before_s > kNext_s) || before_s === -Infinity || this.holed_s === time_s) return;
    this.holed_s = time_s;
    this.hooks.reloadSoon();
  }

  /** The data's time went back: the rows drawn are in its future, and would reject all that comes. Of the past they stay. */
  restart(isLive) {
    Object.assign(this, { recent: [], known_s: -Infinity, holed_s: undefined });
    if (!isLive) return;
    const isFine = this.fine === this.steps;
    this.steps = new Steps(this.steps.step_s);
    this.fine = isFine ? this.steps : new Steps(this.fine.step_s);
    this.hooks.discard();
    this.hooks.reloadSoon();
  }

  /** Removes what ended before `time_s`. */
  forget(time_s) {
    for (const steps of new Set([this.steps, this.fine])) steps.forget(time_s - steps.step_s);
  }
}
