// SPDX-License-Identifier: MIT
// The time range of the charts: it ends now, or where the user moved it.
export const kMin_s = 10, kMax_s = 366 * 86400;

export class TimeView {
  /** `now()`: current time of the data, seconds since 1970. `changed()` is called after each change. */
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

  /** Shows `from_s` to `to_s`, limited to 10 s to 366 days. A range that ends after now ends now and becomes live. */
  zoom(from_s, to_s) {
    const middle_s = (from_s + to_s) / 2, now_s = this.now();
    this.set(to_s - from_s, null);
    const end_s = middle_s + this.span_s / 2;
    this.end_s = end_s >= now_s ? null : end_s;
    this.changed();
  }

  setSpan(span_s) {
    this.set(span_s, this.end_s);
    this.changed();
  }

  /** Sets the range without a call of changed(); `end_s`: null for now. */
  set(span_s, end_s) {
    Object.assign(this, { span_s: Math.min(kMax_s, Math.max(kMin_s, span_s)), end_s });
  }

  /** Moves by a fraction of the range; negative: into the past. */
  pan(fraction) {
    const [from_s, to_s] = this.range();
    this.zoom(from_s + fraction * this.span_s, to_s + fraction * this.span_s);
  }

  /** Multiplies the length by `factor`. A live range stays live; another one keeps its middle. */
  scale(factor) {
    const [from_s, to_s] = this.range(), middle_s = (from_s + to_s) / 2;
    if (this.isLive) return this.setSpan(factor * this.span_s);
    this.zoom(middle_s - (factor * this.span_s) / 2, middle_s + (factor * this.span_s) / 2);
  }

  live() {
    this.end_s = null;
    this.changed();
  }
}
