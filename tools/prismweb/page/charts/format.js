// SPDX-License-Identifier: MIT
// Formats numbers, time spans and times. An unknown value is a dash, never a zero.
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

/** Bias and its standard deviation, deg/h. */
export function plusMinus(value, sd, decimals) {
  const text = fixed(value, decimals);
  if (text === kUnknown) return text;
  return fixed(sd, decimals) === kUnknown ? text : `${text} ± ${fixed(sd, decimals)}`;
}

/** The number of decimals with which `span`, the range of a chart, has three digits. */
export function decimalsFor(span) {
  if (!(span > 0)) return 3;
  return Math.min(9, Math.max(0, 2 - Math.floor(Math.log10(span))));
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

/** A name that is valid on every file system: letters, digits, `-`, `_`, `.`. */
export function fileName(text) {
  return text.replace(/[^A-Za-z0-9_.-]+/g, "-").replace(/^[-.]+|-+$/g, "") || "gyro";
}
