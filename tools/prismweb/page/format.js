// SPDX-License-Identifier: MIT
// Formats numbers, time spans, times and scales. An unknown value is a dash, never a zero.
export const kUnknown = "–";

/** A number with the given decimals, a minus sign (U+2212) and no "-0"; a dash if it is not a finite number. */
export function fixed(value, decimals) {
  if (typeof value !== "number" || !Number.isFinite(value)) return kUnknown;
  const text = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(text) !== 0 ? `\u2212${text}` : text;
}

/** The same, a narrow no-break space and the unit; a dash has no unit. */
export function withUnit(value, decimals, unit) {
  const text = fixed(value, decimals);
  return text === kUnknown ? text : `${text}\u202f${unit}`;
}

/** A unit, or a text with units, of prismd as the page shows it. */
export const unitText = (text) => text.replaceAll("degC", "°C");

/** The number of decimals with which `span`, the range of a chart, has three digits. */
export function decimalsFor(span) {
  if (!(span > 0)) return 3;
  return Math.min(9, Math.max(0, 2 - Math.floor(Math.log10(span))));
}

/** The number of decimals that a value with this standard deviation supports: the deviation has two digits. */
export const decimalsOf = (sd) => decimalsFor(10 * sd);

/** A value and its standard deviation with the decimals that this supports. */
export function plusMinus(value, sd) {
  const text = fixed(value, decimalsOf(sd));
  return text === kUnknown || !Number.isFinite(sd) ? text : `${text} ± ${fixed(sd, decimalsOf(sd))}`;
}

/** An integer with thin spaces between groups of three digits. */
export function count(value) {
  return typeof value === "number" ? String(value).replace(/\B(?=(\d{3})+$)/g, "\u2009") : kUnknown;
}

/** A time span in its two largest units: "9.2 s", "3 min 20 s", "2 d 4 h". */
export function span(seconds) {
  if (!Number.isFinite(seconds)) return kUnknown;
  const s = Math.max(0, seconds);
  if (s < 10) return `${s.toFixed(1)} s`;
  if (s < 60) return `${Math.floor(s)} s`;
  const twoUnits = (unit, name, smaller, smallerName) => {
    const rest = Math.floor((s % unit) / smaller);
    return `${Math.floor(s / unit)} ${name}${rest > 0 ? ` ${rest} ${smallerName}` : ""}`;
  };
  if (s < 3600) return twoUnits(60, "min", 1, "s");
  if (s < 86400) return twoUnits(3600, "h", 60, "min");
  return twoUnits(86400, "d", 3600, "h");
}

const twoDigits = (number) => String(number).padStart(2, "0");

/** "14:03:09" of seconds since 1970, UTC. */
export function clock(time_s) {
  if (!Number.isFinite(time_s)) return kUnknown;
  const t = new Date(time_s * 1000);
  return `${twoDigits(t.getUTCHours())}:${twoDigits(t.getUTCMinutes())}:${twoDigits(t.getUTCSeconds())}`;
}

/** "2026-11-23 14:03:09" of seconds since 1970, UTC. */
export function moment(time_s) {
  if (!Number.isFinite(time_s)) return kUnknown;
  const t = new Date(time_s * 1000);
  return `${t.getUTCFullYear()}-${twoDigits(t.getUTCMonth() + 1)}-${twoDigits(t.getUTCDate())} ${clock(time_s)}`;
}

/** Seconds since 1970 of "2026-11-23", "2026-11-23 14:03" or "2026-11-23T14:03:09Z", UTC; NaN for another text or day. */
export function parseMoment(text) {
  const [, date, time = "00:00"] = text.trim().match(/^(\d{4}-\d\d-\d\d)(?:[ T](\d\d:\d\d(?::\d\d)?)Z?)?$/) ?? [];
  const time_s = Date.parse(`${date}T${time}Z`) / 1000;
  return moment(time_s).startsWith(date) ? time_s : NaN;
}

/** "2026-11-23 14:03:09 – 15:03:09 UTC", with both dates if they differ. */
export function period(from_s, to_s) {
  const [from, to] = [moment(from_s), moment(to_s)];
  return `${from} – ${to.slice(0, 10) === from.slice(0, 10) ? to.slice(11) : to} UTC`;
}

/** A name that is valid on every file system: letters, digits, `-`, `_`, `.`. */
export function fileName(text) {
  return text.replace(/[^A-Za-z0-9_.-]+/g, "-").replace(/^[-.]+|-+$/g, "") || "gyro";
}

/**
 * Ticks of a scale, with as few decimals as distinguish them: returns {v, label} of the multiples of 1, 2 or 5 times a power of ten from
 * `low` to `high`: about `wanted` ticks, at least two; one if the range has no width.
 */
export function ticksOf(low, high, wanted) {
  // if `low` and `high` differ only in their last digits, adjacent multiples are equal and the loop would not end
  if (!(high - low > 1e-12 * Math.max(Math.abs(low), Math.abs(high)))) return Number.isFinite(low) ? [{ v: low, label: fixed(low, 3) }] : [];
  const rough = (high - low) / Math.max(wanted, 1), power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((candidate) => candidate >= rough * 0.85);
  const decimals = Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9)));
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push({ v: k * step, label: fixed(k * step, decimals) });
  return ticks.length >= 2 || wanted > 32 ? ticks : ticksOf(low, high, 2 * Math.max(wanted, 1));
}
