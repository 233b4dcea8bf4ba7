// SPDX-License-Identifier: MIT
// The window of time that the charts share: it ends now, or stands where somebody moved it.
export const kLeast_s = 10, kGreatest_s = 31 * 86400;

export class TimeView {
  /** `now()`: the data's own present, seconds since 1970. `changed()` is called after each change. */
  constructor(span_s, now, changed) {
    Object.assign(this, { span_s, end_s: null, now, changed });
  }

  get isLive() {
    return this.end_s === null;
  }

  range() {
    const to_s = this.end_s ?? this.now();
    return [to_s - this.span_s, to_s];
  }

  /** From `from_s` to `to_s`, kept within 10 s to 31 days; what would reach beyond now ends now, and goes with it. */
  zoom(from_s, to_s) {
    const middle_s = (from_s + to_s) / 2, now_s = this.now();
    this.span_s = Math.min(kGreatest_s, Math.max(kLeast_s, to_s - from_s));
    const end_s = middle_s + this.span_s / 2;
    this.end_s = end_s >= now_s ? null : end_s;
    this.changed();
  }

  setSpan(span_s) {
    this.span_s = span_s;
    this.changed();
  }

  /** Moves by a part of the window; below 0: into the past. */
  pan(part) {
    const [from_s, to_s] = this.range();
    this.zoom(from_s + part * this.span_s, to_s + part * this.span_s);
  }

  /** A window that goes with the present stays there; another one keeps its middle. */
  scale(factor) {
    const [from_s, to_s] = this.range(), middle_s = (from_s + to_s) / 2;
    if (this.isLive) return this.setSpan(Math.min(kGreatest_s, Math.max(kLeast_s, factor * this.span_s)));
    this.zoom(middle_s - (factor * this.span_s) / 2, middle_s + (factor * this.span_s) / 2);
  }

  live() {
    this.end_s = null;
    this.changed();
  }
}
