// SPDX-License-Identifier: MIT
// Ticks of a scale: round numbers with as few decimals as distinguish them.
import { fixed } from "./format.js";

/**
 * Returns {v, label} of the multiples of 1, 2 or 5 times a power of ten from `low` to `high`: about `wanted` ticks, at least two; one if
 * the range has no width.
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
